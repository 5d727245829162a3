"""NWB files (Neurodata Without Borders): time series and trials, read with h5py.

The package pynwb builds classes from a file's own specification and follows links to other files.
Plain HDF5 is sufficient here: a series is a group with data and a clock.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.hdf5 import (
    MAGIC,
    Hdf5Error,
    is_dataset,
    member,
    opened_hdf5,
    plain_text,
)
from armimpedance.recordings.mapped.raw_file import RawFile, RawRun, RawTable, Source, Wanted
from armimpedance.recordings.nwb_series import (
    FileSeries,
    NwbSeries,
    Trial,
    cut,
    series_of,
    trials_of,
)
from armimpedance.recordings.reading import some_names

_EXPECTED: Final = "an NWB file"
#: The facts that are read about the subject; the identity is not read.
_OF_SUBJECT: Final = ("age", "sex", "species", "weight")


def recognises(path: Path) -> bool:
    """True if a file is HDF5 and named .nwb."""
    if not path.is_file() or path.suffix.lower() != ".nwb":
        return False
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def read(path: Path, wanted: Wanted) -> RawFile:
    """Read the time series of an NWB file.

    Parameters
    ----------
    path : Path
    wanted : callable
        True for a wanted column, such as "acquisition/force[0]".

    Returns
    -------
    RawFile
        One run per trial with the facts in the table of trials; one run if there is no such
        table. Series with exactly the same times are one table.

    Raises
    ------
    InputError
    """
    with opened_hdf5(path, "nwb", _EXPECTED) as file:
        try:
            content = series_of(file, wanted)
            trials = trials_of(file, content.left)
            facts = _subject(file)
            others = [f"intervals/{name}" for name in _names(file, "intervals") if name != "trials"]
            others += [name for name in ("units",) if name in file]
        except Hdf5Error as error:
            raise InputError(str(error), file=path, expected=_EXPECTED) from None
    runs = (
        tuple(_trial_runs(path, content, trials, facts))
        if trials
        else (_run(path, content, facts),)
    )
    content.left["they are no time series"] = others
    if trials:
        outside = _outside(content, trials)
        content.left["outside of the trials"] = [f"{outside} samples"] if outside else []
    sentences = tuple(
        s for reason, names in content.left.items() for s in not_taken(some_names(names), reason)
    )
    return RawFile(runs=runs, not_taken=sentences)


def _run(path: Path, content: FileSeries, facts: dict[str, float | str]) -> RawRun:
    return RawRun(str(path), tuple(map(_whole, content.series)), facts)


def _whole(series: NwbSeries) -> RawTable:
    return RawTable(series.columns, series.clock.time_s, series.clock.rate_hz)


def _trial_runs(
    path: Path, content: FileSeries, trials: list[Trial], facts: dict[str, float | str]
) -> list[RawRun]:
    return [
        RawRun(
            name=f"{path.name} trial {number}",
            tables=tuple(cut(series, trial) for series in content.series),
            facts={**facts, **trial.facts, "start_time": trial.start_s, "stop_time": trial.stop_s},
        )
        for number, trial in enumerate(trials, start=1)
    ]


def _outside(content: FileSeries, trials: list[Trial]) -> int:
    """The number of rows of the longest series that are in no trial."""
    if not content.series:
        return 0
    longest = max(content.series, key=lambda series: len(series.clock.time_s))
    inside = sum(cut(NwbSeries(longest.clock), trial).rows for trial in trials)
    return max(len(longest.clock.time_s) - inside, 0)


def _subject(file: Any) -> dict[str, float | str]:
    """Facts about the subject's body."""
    group = member(file, "general/subject")
    if group is None or is_dataset(group):
        return {}
    facts: dict[str, float | str] = {}
    for name in _OF_SUBJECT:
        content = member(group, name)
        if content is not None and is_dataset(content) and content.shape == ():
            text = plain_text(content[()])
            if text and text.isprintable() and len(text) <= 64:
                facts[f"subject.{name}"] = text
    return facts


def _names(file: Any, group_path: str) -> list[str]:
    group = member(file, group_path)
    return [] if group is None or is_dataset(group) else [str(name) for name in group]


SOURCE = Source("an NWB file (.nwb)", recognises, read)
