"""A session as one text file a trial, as programs of a laboratory's own robot write it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.trial_columns import TrialColumns, trials_of

Units = Literal["SI", "small"]
_UNITS: Final = ("s", "m", "N", "Nm", "rad", "V")
#: Unit of the simulator -> the unit of many robots' programs, and its factor.
_SMALL: Final = {"s": ("ms", 1e3), "m": ("mm", 1e3), "N": ("N", 1.0), "rad": ("deg", 180 / np.pi)}


def write_trial_files(
    recording: Recording,
    folder: Path,
    *,
    units: Units = "SI",
    by: Literal["limb", "device"] = "limb",
    facts: Iterable[str] = (),
) -> None:
    """Write each trial to a file ``<condition>_<trial>.csv``, the units in brackets.

    Parameters
    ----------
    recording : Recording
    folder : Path
        It is made.
    units : {"SI", "small"}
        In "small" ones, ms, mm and degrees, numbers lose their last bits.
    by : {"limb", "device"}
        Whose force on the other the columns hold.
    facts : iterable of str
        Columns of the trial table that are written beside the samples, the same in each row.
    """
    folder.mkdir()
    for trial in trials_of(recording):
        columns = _with_facts(_in_units(trial, units, by), trial, facts)
        text = "\n".join([",".join(columns), *_rows(list(columns.values()))])
        name = f"{trial.condition}_{trial.number:03d}.csv"
        (folder / name).write_text(text + "\n", encoding="utf-8")


def column_name(name: str, units: Units = "SI") -> str:
    """The simulator's name of a column as such a file has it: ``x_m`` is ``x [m]`` or ``x [mm]``.

    Parameters
    ----------
    name : str
    units : {"SI", "small"}

    Returns
    -------
    str
    """
    stem, _, unit = name.rpartition("_")
    if name.startswith("emg_"):
        stem, unit = name, "V"
    if unit not in _UNITS:
        return name
    return f"{stem} [{_SMALL[unit][0] if units == 'small' and unit in _SMALL else unit}]"


def _in_units(trial: TrialColumns, units: Units, by: str) -> dict[str, FloatArray]:
    """The columns under the names of the file, in its units."""
    written = {}
    for name, values in trial.columns.items():
        unit = "V" if name.startswith("emg_") else name.rpartition("_")[2]
        if by == "device" and unit in ("N", "Nm"):
            values = -values
        if units == "small" and unit in _SMALL:
            values = values * _SMALL[unit][1]
        written[column_name(name, units)] = values
    return written


def _with_facts(
    columns: dict[str, FloatArray], trial: TrialColumns, facts: Iterable[str]
) -> Mapping[str, FloatArray]:
    rows = len(next(iter(columns.values())))
    known = {name: float(trial.facts[name]) for name in facts if name in trial.facts}
    return columns | {name: np.full(rows, value) for name, value in known.items()}


def _rows(columns: list[FloatArray]) -> Iterable[str]:
    """The rows of a table; every number reads back as the same."""
    return (",".join(map(repr, row)) for row in np.column_stack(columns).tolist())
