"""Where the trials of a file seem to begin, and which columns say something of each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.recordings.mapped.evidence import is_switch, trial_numbers
from armimpedance.recordings.mapped.names import ReadName, read_name
from armimpedance.recordings.mapped.proposed import Proposal, ProposedValue, ReadColumns
from armimpedance.recordings.mapped.raw_file import RawRun
from armimpedance.recordings.mapped.units import known_unit
from armimpedance.recordings.tables.trial_table import NUMBER_COLUMNS, OPTIONAL_NUMBER_COLUMNS

#: What a column of the trial table is called that holds one value a trial.
_OF_ROLES: Final[dict[str, str]] = {
    "condition": "condition",
    "set": "set",
    "direction": "direction_deg",
    "onset": "onset_s",
}
#: Columns of a trial table that keep their names.
_TRIAL_COLUMNS: Final = (*NUMBER_COLUMNS, *OPTIONAL_NUMBER_COLUMNS, "set", "day", "experiment")


def propose_trials(
    found: Proposal, columns: ReadColumns, runs: Sequence[RawRun], files: int, starred: bool
) -> None:
    """Where trials begin, and what the trial table can hold."""
    home = columns.tables.get(found.position.columns[0]) if found.position else None
    inside = [n for n in columns.names.values() if home is None or columns.tables[n.name] is home]
    switches = [
        (n, s)
        for n in inside
        if n.name not in columns.per_trial
        and n.role in ("trigger", "onset", "unknown")
        and (s := is_switch(columns.values[n.name])) is not None
    ]
    if starred:
        found.trials = {"by": "columns"}
    elif found.trials:
        pass
    elif len(runs) > 1 or files > 1:
        found.trials = {"by": "run"}
    elif found.time is not None and _jumps(columns.values[found.time.columns[0]]):
        found.trials = {"by": "gap"}
    elif switches and switches[0][1][1] > 1:
        name, (middle, rises) = switches[0]
        found.trials = {"by": "edge", "column": name.name, "threshold": middle}
        found.trials |= {"before_s": "?", "after_s": "?"}
        why = f"how much of the record around each of the {rises} rises of {name.name} is a trial"
        found.cannot_tell.append(why)
    else:
        found.trials = {"by": "run"}
        found.cannot_tell.append("where trials begin: all of it is taken as one trial")
    if switches and found.trials["by"] != "edge":
        name, (middle, _) = switches[0]
        found.trials |= {"disturbance": name.name, "disturbance_threshold": middle}
    _values(found, columns, runs, inside)


def _values(
    found: Proposal, columns: ReadColumns, runs: Sequence[RawRun], inside: Sequence[ReadName]
) -> None:
    facts = [read_name(name) for name in runs[0].facts]
    once = [columns.names[n] for n in columns.per_trial]
    homes = [columns.tables[n.name] for n in inside[:1]]
    once += [n for n in columns.names.values() if columns.tables[n.name] not in homes]
    for read in [*once, *facts, *(n for n in inside if n.role == "condition")]:
        name = _OF_ROLES.get(read.role)
        known = None if read.unit is None else known_unit(read.unit)
        if read.name in _TRIAL_COLUMNS:
            found.values.setdefault(read.name, ProposedValue(read.name))
        elif read.role in ("onset", "direction") and name is not None:
            unit = "?" if known is None else known.symbol
            found.values.setdefault(name, ProposedValue(read.name, unit))
        elif read.role == "trial" and isinstance(runs[0].facts.get(read.name), float):
            found.values.setdefault("trial", ProposedValue(read.name))
        elif name is not None:
            found.values.setdefault(name, ProposedValue(read.name))
        elif read.name in columns.per_trial and read.name != found.trials.get("column"):
            found.values.setdefault(read.name, ProposedValue(read.name))
    if "condition" not in found.values:
        found.cannot_tell.append("the condition of each trial: none is named")
    for name, value in found.values.items():
        if value.unit == "?":
            units = "s, ms, or sample: the number of one" if name == "onset_s" else "deg or rad"
            found.cannot_tell.append(f"the unit of {value.column} ({units})")


def trial_column(columns: ReadColumns) -> str | None:
    """The column that numbers the trials."""
    named = [n.name for n in columns.names.values() if n.role == "trial"]
    return next((n for n in named if trial_numbers(columns.values[n])), None)


def constant_in_trials(columns: ReadColumns, numbers: str) -> tuple[str, ...]:
    """Columns beside that of the trials' numbers which never change within a trial."""
    marks, home = columns.values[numbers], columns.tables[numbers]
    same_trial = marks[1:] == marks[:-1]
    found = []
    for name, values in columns.values.items():
        if columns.tables[name] is home and name != numbers:
            changes = (values[1:] != values[:-1]) & same_trial
            if values.dtype.kind == "f":
                changes &= ~(np.isnan(values[1:]) & np.isnan(values[:-1]))
            if not changes.any():
                found.append(name)
    return tuple(found)


def _jumps(values: NDArray[Any]) -> bool:
    step = np.diff(np.asarray(values, dtype=np.float64))
    forward = step[step > 0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    return bool(usual > 0 and ((step < 0) | (step > 10 * usual)).any())
