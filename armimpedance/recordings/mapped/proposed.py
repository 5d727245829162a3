"""A proposal for a file: columns with units, trials, and open questions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.recordings.mapped.evidence import (
    FoundMeaning,
    ReadName,
    Role,
    angle_unit,
    is_switch,
    read_name,
    trial_numbers,
)
from armimpedance.recordings.mapped.mapping import JoinedTable, known_unit
from armimpedance.recordings.mapped.raw_file import RawColumn, RawRun, RawTable
from armimpedance.recordings.tables.trial_table import NUMBER_COLUMNS, OPTIONAL_NUMBER_COLUMNS


@dataclass(frozen=True)
class ProposedColumns:
    """Columns of one quantity, their unit with its reason, and `labels` from the file."""

    columns: tuple[str, ...]
    axes: tuple[str, ...]
    unit: FoundMeaning
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProposedValue:
    """Source of a column of the trial table; `unit` "?" if the user must state it."""

    column: str
    unit: str | None = None


_NO_CONDITION: Final = "the condition of each trial: none is named"


@dataclass
class Proposal:
    """A proposal; parts that were not detected are None or empty.

    `rate_hz`, `rate_from`: the rate and the fact that states it, if no column is the time.
    `evidence`: sentences on the sign of the force.
    `cannot_tell`: questions that only the user can answer.
    `others`: columns without a meaning so far.
    """

    kind: str | None = None
    time: ProposedColumns | None = None
    rate_hz: float | None = None
    rate_from: str = ""
    position: ProposedColumns | None = None
    force: ProposedColumns | None = None
    joint_angles: ProposedColumns | None = None
    emg: ProposedColumns | None = None
    trials: dict[str, Any] = field(default_factory=dict)
    values: dict[str, ProposedValue] = field(default_factory=dict)
    tables: tuple[JoinedTable, ...] = ()
    evidence: tuple[str, ...] = ()
    cannot_tell: list[str] = field(default_factory=list)
    others: tuple[str, ...] = ()
    files: str | None = None

    def named_by(self, pattern: str) -> None:
        """Use the pattern of the files' names, too."""
        self.trials["pattern"] = pattern
        if "{condition}" in pattern and "condition" not in self.values:
            self.cannot_tell = [
                question for question in self.cannot_tell if question != _NO_CONDITION
            ]

    def lines(self) -> tuple[str, ...]:
        """Sentences on the proposed meaning of the columns, one line each."""
        named = {"time": self.time, "position": self.position, "force": self.force}
        named |= {"joint angles": self.joint_angles, "EMG": self.emg}
        sentences = [
            f"{name}: {', '.join(s.columns)} in {s.unit.word or '?'} ({s.unit.why})"
            for name, s in named.items()
            if s is not None
        ]
        sentences += (
            [f"sample rate: {self.rate_hz:g} Hz ({self.rate_from})"] if self.rate_hz else []
        )
        sentences += [f"trials: by {self.trials['by']}"] if self.trials else []
        sentences[-1:] = (
            [f"{sentences[-1]} {self.trials['column']}"]
            if "column" in self.trials
            else sentences[-1:]
        )
        sentences += (
            [f"of a file's name: {self.trials['pattern']}"] if "pattern" in self.trials else []
        )
        sentences += [
            f"one row a trial: {table.file}, where {table.table_key} is the log's {table.log_key}"
            for table in self.tables
        ]
        sentences += [f"{name} of a trial: {value.column}" for name, value in self.values.items()]
        return (
            *sentences,
            *([f"no meaning found: {', '.join(self.others)}"] if self.others else []),
        )


class ReadColumns:
    """Columns of the first run with samples, read by name.

    `tables`, `values`, `names`: name of a column -> its table, its values, its parsed name.
    `per_trial`: columns that are constant within each trial.
    """

    def __init__(self, run: RawRun, starred: Mapping[str, Sequence[str]]) -> None:
        self.tables: dict[str, RawTable] = {}
        self.values: dict[str, NDArray[Any]] = {}
        self.names: dict[str, ReadName] = {}
        self.per_trial: tuple[str, ...] = ()
        hidden = {name for names in starred.values() for name in names}
        for table in run.tables:
            for name, column in table.columns.items():
                if name not in hidden:
                    self._add(name, table, column)
        for pattern, names in starred.items():
            table = next(t for t in run.tables if names[0] in t.columns)
            self._add(pattern, table, table.columns[names[0]])

    def _add(self, name: str, table: RawTable, column: RawColumn) -> None:
        self.tables[name], self.values[name] = table, column.values
        read = read_name(column.label or name, column.unit)
        self.names[name] = replace(read, name=name, label=column.label or "")

    def of(self, *roles: Role) -> list[ReadName]:
        """Return the columns of numbers with these roles."""
        return [
            n
            for n in self.names.values()
            if n.role in roles
            and self.values[n.name].dtype.kind == "f"
            and n.name not in self.per_trial
        ]


# Proposed begin of trials, and columns of the trial table.

#: Role -> name of the trial table's column with one value per trial.
_OF_ROLES: Final[dict[str, str]] = {
    "condition": "condition",
    "set": "set",
    "direction": "direction_deg",
    "onset": "onset_s",
}
#: Beginnings of the names of a muscle's maximum or rest.
_OF_EMG: Final = ("mvc_", "rest_")
#: Columns of a trial table that keep their names.
_TRIAL_COLUMNS: Final = (*NUMBER_COLUMNS, *OPTIONAL_NUMBER_COLUMNS, "set", "day", "experiment")


def _switches(
    columns: ReadColumns, inside: Sequence[ReadName]
) -> list[tuple[ReadName, tuple[float, int]]]:
    """Columns that switch between two values, each with the middle and the number of rises."""
    switches = []
    for name in inside:
        if name.name in columns.per_trial or name.role not in ("trigger", "onset", "unknown"):
            continue
        switch = is_switch(columns.values[name.name])
        if switch is not None:
            switches.append((name, switch))
    return switches


def propose_trials(
    proposal: Proposal, columns: ReadColumns, runs: Sequence[RawRun], files: int, starred: bool
) -> None:
    """Propose where trials begin, and the columns of the trial table."""
    home = columns.tables.get(proposal.position.columns[0]) if proposal.position else None
    inside = [n for n in columns.names.values() if home is None or columns.tables[n.name] is home]
    switches = _switches(columns, inside)
    if starred:
        proposal.trials = {"by": "columns"}
    elif proposal.trials:
        pass
    elif len(runs) > 1 or files > 1:
        proposal.trials = {"by": "run"}
    elif proposal.time is not None and _jumps(columns.values[proposal.time.columns[0]]):
        proposal.trials = {"by": "gap"}
    elif switches and switches[0][1][1] > 1:
        name, (middle, rises) = switches[0]
        proposal.trials = {"by": "edge", "column": name.name, "threshold": middle}
        proposal.trials |= {"before_s": "?", "after_s": "?"}
        question = (
            f"how much of the record around each of the {rises} rises of {name.name} is a trial"
        )
        proposal.cannot_tell.append(question)
    else:
        proposal.trials = {"by": "run"}
        proposal.cannot_tell.append("where trials begin: all of it is taken as one trial")
    if switches and proposal.trials["by"] != "edge":
        name, (middle, _) = switches[0]
        proposal.trials |= {"disturbance": name.name, "disturbance_threshold": middle}
    _values(proposal, columns, runs, inside)


def _trial_column(
    read: ReadName, proposal: Proposal, columns: ReadColumns, runs: Sequence[RawRun]
) -> str | None:
    """Name in the trial table for a column of the file; None if it is not one of trials."""
    name = _OF_ROLES.get(read.role)
    last_name = read.name.rpartition(".")[2]
    if last_name in _TRIAL_COLUMNS or last_name.startswith(_OF_EMG):
        return last_name
    side_by_side = proposal.trials.get("by") == "columns"
    if read.role == "trial" and (
        _all_different(columns.values.get(read.name))
        if side_by_side  # a single number for all trials is their count
        else isinstance(runs[0].facts.get(read.name), float)
    ):
        return "trial"
    if name is not None:
        return name
    of_each = read.name in columns.per_trial and read.name != proposal.trials.get("column")
    return read.name if of_each and proposal.trials.get("by") == "column" else None


def _all_different(values: NDArray[Any] | None) -> bool:
    return values is not None and len(np.unique(values)) == len(values)


def _unit_of(read: ReadName, values: NDArray[Any] | None = None) -> str | None:
    """Unit of an onset or a direction, "?" if it is unknown; None for other columns."""
    if read.name.rpartition(".")[2] in _TRIAL_COLUMNS or read.role not in ("onset", "direction"):
        return None
    known = None if read.unit is None else known_unit(read.unit)
    if known is None and read.role == "direction" and values is not None:
        # beyond a full turn in radians it is degrees
        unit = angle_unit([values]).word if values.dtype.kind == "f" else None
        return unit or "?"
    return "?" if known is None else known.symbol


def _values(
    proposal: Proposal, columns: ReadColumns, runs: Sequence[RawRun], inside: Sequence[ReadName]
) -> None:
    facts = [read_name(name) for name in runs[0].facts]
    once = [columns.names[n] for n in columns.per_trial]
    homes = [columns.tables[n.name] for n in inside[:1]]
    once += [n for n in columns.names.values() if columns.tables[n.name] not in homes]
    for read in [*once, *facts, *(n for n in inside if n.role == "condition")]:
        name = _trial_column(read, proposal, columns, runs)
        if name is not None:
            unit = _unit_of(read, columns.values.get(read.name))
            proposal.values.setdefault(name, ProposedValue(read.name, unit))
    if "condition" not in proposal.values:
        proposal.cannot_tell.append(_NO_CONDITION)
    for name, value in proposal.values.items():
        if value.unit == "?":
            units = "s, ms, or sample: the number of one" if name == "onset_s" else "deg or rad"
            proposal.cannot_tell.append(f"the unit of {value.column} ({units})")


def trial_column(columns: ReadColumns) -> str | None:
    """Return the column of trial numbers, or None."""
    named = [n.name for n in columns.names.values() if n.role == "trial"]
    return next((n for n in named if trial_numbers(columns.values[n])), None)


def constant_in_trials(columns: ReadColumns, numbers: str) -> tuple[str, ...]:
    """Columns, other than that of the trial numbers, that are constant within each trial."""
    marks, home = columns.values[numbers], columns.tables[numbers]
    same_trial = marks[1:] == marks[:-1]
    constant = []
    for name, values in columns.values.items():
        if columns.tables[name] is home and name != numbers:
            changes = (values[1:] != values[:-1]) & same_trial
            if values.dtype.kind == "f":
                changes &= ~(np.isnan(values[1:]) & np.isnan(values[:-1]))
            if not changes.any():
                constant.append(name)
    return tuple(constant)


def _jumps(values: NDArray[Any]) -> bool:
    step = np.diff(np.asarray(values, dtype=np.float64))
    forward = step[step > 0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    return bool(usual > 0 and ((step < 0) | (step > 10 * usual)).any())
