"""A recording from data in Python: one table of all samples, or a table for each trial."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.recordings.mapped.apply import mapped_recording
from armimpedance.recordings.mapped.columns_toml import mapping_of_values
from armimpedance.recordings.mapped.joined import with_tables
from armimpedance.recordings.mapped.mapping import UNITS, JoinedTable, known_unit
from armimpedance.recordings.mapped.raw_file import RawColumn, RawFile, RawRun, RawTable, ReadFile
from armimpedance.recordings.tables.trial_table import NUMBER_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

    #: A table of samples: columns of one length; a column may have several axes, (N, d).
    Table = pd.DataFrame | Mapping[str, Any]

#: Name in messages instead of a file.
_HERE: Final = Path("tables in Python")
#: Quantity -> its section in a mapping.
_SECTIONS: Final = {
    "position": "position",
    "force": "force",
    "angle": "position",
    "torque": "force",
    "joint_angles": "joint_angles",
    "commanded": "commanded",
    "added_torque": "added_torque",
    "emg": "emg",
    "time": "time",
}
_OF_TRIALS: Final = "trials"


def recording(
    data: Table | Sequence[Table],
    columns: Mapping[str, str | Sequence[str] | Mapping[str, str]] | None = None,
    *,
    force_by: Literal["limb", "device"],
    sample_rate_hz: float | None = None,
    trials: Table | None = None,
    subject: Subject | None = None,
    **further: Any,
) -> Recording:
    """Make a recording of tables or of a list of trials.

    Names say quantity and unit: ``position_mm``, ``force_N``, ``angle_deg``, ``torque_Nm``,
    ``joint_angles_rad``, ``emg_mV``, ``time_ms``, ``onset_s``, ``direction_deg``. The same checks
    apply as to a file.

    Parameters
    ----------
    data : table, or sequence of tables
        One table of all samples with a column of the trial's number, or one table for each trial. A
        table is a DataFrame or a mapping of arrays (N,) or (N, d); a single number or text is a
        fact of the trial.
    columns : mapping, optional
        Quantity with its unit -> the name of its column, or of its columns: ``{"position_mm":
        ["HandX", "HandY"], "force_N": ["Fx", "Fy"], "trial": "nr", "condition": "cond"}``; of EMG
        muscle -> column. Without it the tables' own names are such quantities.
    force_by : {"limb", "device"}
        Whether it is the force by the limb or by the device.
    sample_rate_hz : float, optional
        Default: the rate from the time column.
    trials : table, optional
        One row per trial, joined by the column `trial`.
    subject : Subject, optional
        Who was measured.
    **further
        Further properties of the recording, by the names of recording.json: `handle_mass_kg`,
        `perturbation`, `shoulder_m`, `gravity`, `torque`, `imposed`, `force_lowpass_hz`.

    Returns
    -------
    Recording
        As if it had been read from files.

    Raises
    ------
    InputError
        A quantity is missing or has no unit, a column is missing, or the data fail a check of
        files.
    TypeError
        The data are not tables.

    Examples
    --------
    >>> import numpy as np
    >>> import armimpedance as ai
    >>> time = np.arange(900) / 1000
    >>> pushed = 5 * np.clip(np.sin(20 * (time - 0.3)), 0, None)[:, None] * [1, 0]
    >>> one = {"position_mm": pushed + [0, 400], "force_N": 0.1 * pushed, "onset_s": 0.3}
    >>> session = ai.recording([one, one], force_by="device", sample_rate_hz=1000)
    >>> session.n_trials, session.position.shape
    (2, (1800, 2))
    """
    tables = [data] if _is_table(data) else list(data) if isinstance(data, Iterable) else [data]
    for table in tables:
        if not _is_table(table):
            raise TypeError(
                f"got {type(table).__name__}: a DataFrame, a mapping of arrays, or a list of "
                "them (one a trial) is expected"
            )
    if not tables:
        raise InputError("no trials", expected="at least one table")
    runs = tuple(_run(table, number) for number, table in enumerate(tables, start=1))
    single_table = _is_table(data) and len(runs) == 1
    named = _own_names(runs[0]) if columns is None else columns
    values = _mapping_values(named, runs[0], single=single_table)
    if columns is None:
        values |= _kept(values, runs[0])
    values["force"] = {**values.get("force", {}), "by": force_by}
    values |= {k: v for k, v in further.items() if v is not None}
    if sample_rate_hz is not None:
        values["sample_rate_hz"] = float(sample_rate_hz)
    files: tuple[ReadFile, ...] = (ReadFile(_HERE, RawFile(runs)),)
    if trials is not None:
        files = _with_trials(files, values, trials)
    mapping = mapping_of_values(values, _HERE)
    if subject is not None:
        mapping = replace(mapping, metadata=replace(mapping.metadata, subject=subject))
    return mapped_recording(files, mapping, _HERE)


def _is_table(data: object) -> bool:
    """True for a mapping of columns or a DataFrame; pandas is not imported."""
    return isinstance(data, Mapping) or (hasattr(data, "columns") and hasattr(data, "to_dict"))


def _run(table: Any, number: int) -> RawRun:
    """Convert a table to a run: columns, with one for each axis of an array, and facts."""
    columns: dict[str, RawColumn] = {}
    facts: dict[str, float | str] = {}
    for name in table if isinstance(table, Mapping) else table.columns:
        values = np.asarray(table[name])
        if values.ndim == 0:
            facts[str(name)] = str(values) if values.dtype.kind in "UO" else float(values)
        elif values.ndim == 1:
            columns[str(name)] = _column(values, str(name))
        elif values.ndim == 2:
            for axis, part in enumerate(values.T):
                columns[_part(str(name), axis)] = _column(part, str(name))
        else:
            raise InputError(
                f"an array of shape {values.shape}", column=str(name), expected="(N,) or (N, d)"
            )
    lengths = {len(column.values) for column in columns.values()}
    if len(lengths) > 1:
        by_name = ", ".join(f"{n}: {len(c.values)}" for n, c in columns.items())
        raise InputError(
            f"columns of different lengths in table {number}", expected=f"one length; {by_name}"
        )
    return RawRun(f"table {number}", (RawTable(columns),), facts)


def _column(values: ArrayLike, name: str) -> RawColumn:
    array = np.asarray(values)
    if array.dtype.kind in "OUS":
        if all(isinstance(value, str) for value in array.tolist()):
            return RawColumn(array.astype(np.str_))
        try:
            return RawColumn(array.astype(float))
        except (TypeError, ValueError):
            return RawColumn(np.array([str(value) for value in array.tolist()]))
    if array.dtype.kind not in "biuf":
        raise InputError(f"values of type {array.dtype}", column=name, expected="real numbers")
    return RawColumn(array.astype(float))


def _part(name: str, axis: int) -> str:
    return f"{name}[{axis}]"


def _own_names(run: RawRun) -> dict[str, str]:
    """Map of the names of a table to themselves, for tables whose names are quantities."""
    (table,) = run.tables
    names = dict.fromkeys([re.sub(r"\[\d+\]$", "", name) for name in table.columns] + [*run.facts])
    return {name: name for name in names}


def _mapping_values(columns: Mapping[str, Any], run: RawRun, *, single: bool) -> dict[str, Any]:
    """Build the keys of a mapping: quantities with their columns, and columns of trials.

    `single`: True if all samples are in a single table.
    """
    values: dict[str, Any] = {"kind": "joint" if _quantities(columns) & {"angle"} else "hand"}
    of_trials: dict[str, Any] = {}
    for name, names in columns.items():
        quantity, unit = split_name(str(name))
        if quantity in _SECTIONS:
            section = _SECTIONS[quantity]
            values[section] = _section(quantity, unit, names, run, str(name))
        elif str(name) == "trial":
            of_trials |= {} if single else {"trial": names}
        else:
            of_trials |= _of_trial(quantity, unit, str(name), names)
    cut: dict[str, Any] = {"by": "run"}
    if single and "trial" in columns and columns["trial"] in run.tables[0].columns:
        cut = {"by": "column", "column": columns["trial"]}
    values[_OF_TRIALS] = {**cut, "columns": of_trials}
    return values


def _kept(values: dict[str, Any], run: RawRun) -> dict[str, Any]:
    """Keep numbers of samples without a known meaning as further columns."""
    of_trials = values[_OF_TRIALS]["columns"]
    known = ("condition", "set", *NUMBER_COLUMNS)
    columns = run.tables[0].columns
    unknown = [name for name in of_trials if name in columns and name not in known]
    for name in unknown:
        del of_trials[name]
    numbers = [name for name in unknown if not columns[name].is_text]
    return {"keep": numbers} if numbers else {}


def _quantities(columns: Mapping[str, Any]) -> set[str]:
    return {split_name(str(name))[0] for name in columns}


def split_name(name: str) -> tuple[str, str | None]:
    """Split a name into quantity and unit: ``position_mm`` is a position in mm."""
    before, _, ending = name.rpartition("_")
    unit = known_unit(ending) if before else None
    return (name, None) if unit is None else (before, unit.symbol)


def _section(quantity: str, unit: str | None, data: Any, run: RawRun, name: str) -> dict[str, Any]:
    """Section of a quantity: columns and unit."""
    if unit is None:
        some = ", ".join(f"{quantity}_{u.replace(' ', '')}" for u in UNITS if _fits(quantity, u))
        raise InputError(f"{name} says no unit", expected=f"one of {some}")
    if quantity == "emg":
        muscles = data if isinstance(data, Mapping) else {c: c for c in _named(data, run)}
        return {"muscles": dict(muscles), "unit": unit}
    names = _named(data, run)
    if quantity == "time":
        return {"column": names[0], "unit": unit}
    return {"columns": names, "unit": unit}


_DIMENSION: Final = {
    "position": "length",
    "commanded": "length",
    "force": "force",
    "angle": "angle",
    "joint_angles": "angle",
    "torque": "torque",
    "added_torque": "torque",
    "emg": "emg",
    "time": "time",
}


def _fits(quantity: str, unit: str) -> bool:
    return UNITS[unit].dimension == _DIMENSION[quantity]


def _named(stated: Any, run: RawRun) -> list[str]:
    """Columns of a quantity; one name may refer to all axes of an array."""
    names = [stated] if isinstance(stated, str) else list(stated)
    available = run.tables[0].columns
    columns = []
    for name in map(str, names):
        parts = [part for i in range(len(available)) if (part := _part(name, i)) in available]
        columns += parts or [name]
    return columns


def _of_trial(quantity: str, unit: str | None, name: str, data: Any) -> dict[str, Any]:
    """Column of the trial table, converted to the unit in its name there."""
    for column in NUMBER_COLUMNS:
        of_name, column_unit = split_name(column)
        if quantity == of_name and unit != column_unit:
            return {column: {"column": data, "unit": unit}}
    return {name: data}


def _with_trials(
    files: tuple[ReadFile, ...], values: dict[str, Any], trials: Any
) -> tuple[ReadFile, ...]:
    """Join the columns of a trial table to the samples, by the column ``trial``."""
    run = _run(trials, 1)
    section = values[_OF_TRIALS]
    key = section.get("column", section["columns"].get("trial", "trial"))
    for name in run.tables[0].columns:
        if name != "trial" and name not in section["columns"]:
            section["columns"] |= _of_trial(*split_name(name), name, name)
    table = JoinedTable("trials", str(key), "trial")
    return with_tables(files, (table,), lambda _path: RawFile((run,)))
