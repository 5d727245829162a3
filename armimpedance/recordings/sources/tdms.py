"""TDMS files of LabVIEW and similar programs, read with npTDMS: groups of channels."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError, needed
from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.raw_file import (
    RawColumn,
    RawFile,
    RawRun,
    RawTable,
    Source,
    Wanted,
)
from armimpedance.recordings.reading import can_be_shown, shown_name, some_names

MAGIC: Final = b"TDSm"
_EXPECTED: Final = "a whole TDMS file"
_MOST_NUMBERS: Final = 62_500_000
_LONGEST_TEXT: Final = 64
_SECONDS: Final = ("", "s", "sec", "second", "seconds")
_UNITS: Final = ("unit_string", "NI_UnitDescription", "Unit", "unit")


def recognises(path: Path) -> bool:
    """True if a file begins like a TDMS file."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(MAGIC)) == MAGIC


def read(path: Path, wanted: Wanted) -> RawFile:
    """Read the channels of a TDMS file.

    Parameters
    ----------
    path : Path
    wanted : callable
        True for a wanted column: a channel's name, or "group/channel" where groups differ.

    Returns
    -------
    RawFile
        Several groups with the same channels are runs (one group per trial); otherwise all groups
        are one run. Channels of a group with the same number of samples and times are one table.

    Raises
    ------
    InputError
    """
    with _opened(path) as (file, warnings):
        left_out: dict[str, list[str]] = {}
        groups = [_Group(str(g.name), g, _channels(g, left_out)) for g in file.groups()]
        groups = [group for group in groups if group.channels]
        _check_size(path, groups, wanted, _are_runs(groups))
        if _are_runs(groups):
            facts = _facts(file.properties)
            runs = [_run(path, [group], wanted, left_out, facts) for group in groups]
        else:
            runs = [_run(path, groups, wanted, left_out, _facts(file.properties))]
    sentences = [
        s for reason, names in left_out.items() for s in not_taken(some_names(names), reason)
    ]
    sentences += [f"npTDMS says: {shown_name(warning)}." for warning in dict.fromkeys(warnings[:5])]
    return RawFile(tuple(runs), tuple(sentences))


@contextmanager
def _opened(path: Path) -> Iterator[tuple[Any, list[str]]]:
    """The open file and npTDMS's warnings, which are not printed."""
    nptdms = needed("nptdms", "tdms", path)
    console = needed("nptdms.log", "tdms", path).log_manager.console_handler
    level, collector = console.level, _WarningCollector()
    logger = logging.getLogger("nptdms")
    console.setLevel(logging.CRITICAL + 1)
    logger.addHandler(collector)
    try:
        # An index file beside it is not read, as it may belong to another file.
        with (
            np.errstate(all="ignore"),
            path.open("rb") as stream,
            nptdms.TdmsFile(stream, keep_open=True, read_metadata_only=True) as file,
        ):
            yield file, collector.texts
    except InputError:
        raise
    except Exception as error:
        # npTDMS raises ValueError, struct.error, KeyError, TypeError, ... for damaged files.
        problem = f"is damaged: {shown_name(' '.join(str(error).split()))[:80]}"
        raise InputError(problem, file=path, expected=_EXPECTED) from None
    finally:
        logger.removeHandler(collector)
        console.setLevel(level)


class _WarningCollector(logging.Handler):
    """A logging handler that stores warnings as texts."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        if len(self.texts) < 1000:
            self.texts.append(record.getMessage())


@dataclass(frozen=True)
class _Group:
    name: str
    group: Any
    channels: dict[str, Any]


def _channels(group: Any, left_out: dict[str, list[str]]) -> dict[str, Any]:
    """The channels of a group with numbers or texts."""
    channels = {}
    for channel in group.channels():
        name = str(channel.name)
        full = f"{group.name}/{name}"
        if not can_be_shown(full):
            left_out.setdefault("names that cannot be shown", []).append(full)
        elif len(channel) == 0:
            left_out.setdefault("no samples", []).append(full)
        elif channel.dtype.kind not in "iufbMOU":
            left_out.setdefault("no numbers or texts", []).append(full)
        else:
            channels[name] = channel
    return channels


def _are_runs(groups: Sequence[_Group]) -> bool:
    """True if groups are trials: all have the same channels at the same rates.

    Copies with other rates, as SignalExpress stores them, are not trials.
    """
    return len(groups) > 1 and len({frozenset(_rates(group)) for group in groups}) == 1


def _rates(group: _Group) -> Iterator[tuple[str, float | None]]:
    for name, channel in group.channels.items():
        step = _step(channel)
        yield name, None if step is None else _rate(step)


def _step(channel: Any) -> float | None:
    """The time between samples in s; None if the file states none or its unit is not time."""
    step = channel.properties.get("wf_increment")
    unit = str(channel.properties.get("wf_xunit_string", "")).strip().lower()
    if isinstance(step, float | int) and 1e-12 < step < 1e6 and unit in _SECONDS:
        return float(step)
    return None


def _check_size(path: Path, groups: Sequence[_Group], wanted: Wanted, are_runs: bool) -> None:
    """Check that the file is as large as its channels claim, as nothing is compressed."""
    size, total = path.stat().st_size, 0
    for group in groups:
        for name, channel in group.channels.items():
            width = channel.data_type.size if channel.data_type is not None else None
            # A text uses four bytes for its end.
            if len(channel) * (width or (1 if channel.scaler_data_types else 4)) > size:
                problem = f"{group.name}/{name} claims {len(channel)} samples"
                raise InputError(problem, file=path, expected=_EXPECTED)
            if wanted(_label(group, name, len(groups) == 1 or are_runs)):
                total += len(channel)
    if total > _MOST_NUMBERS:
        expected = "fewer channels or a shorter record"
        raise InputError(f"more than {_MOST_NUMBERS} samples", file=path, expected=expected)


def _label(group: _Group, channel: str, alone: bool) -> str:
    return channel if alone else f"{group.name}/{channel}"


def _run(
    path: Path,
    groups: Sequence[_Group],
    wanted: Wanted,
    left_out: dict[str, list[str]],
    facts: dict[str, float | str],
) -> RawRun:
    """One run made of these groups: one group if groups are trials, else all."""
    alone = len(groups) == 1
    starts = [_start(c) for group in groups for c in group.channels.values()]
    first = min((start for start in starts if start is not None), default=None)
    tables: dict[object, dict[str, RawColumn]] = {}
    for group in groups:
        for name, channel in group.channels.items():
            label = _label(group, name, alone)
            if not wanted(label):
                left_out.setdefault("the mapping gives them no meaning", []).append(label)
                continue
            column = _column(channel)
            if column is None:
                left_out.setdefault("texts too long for columns", []).append(label)
                continue
            tables.setdefault(_clock(group, channel, first), {})[label] = column
    all_facts = dict(facts)
    for group in groups:
        all_facts |= _facts(group.group.properties, "" if alone else f"{group.name}/")
    if alone:
        all_facts["group"] = groups[0].name
    if first is not None:
        all_facts["start"] = str(first)
    raw_tables = tuple(_table(columns, clock) for clock, columns in tables.items())
    return RawRun(groups[0].name if alone and groups else str(path), raw_tables, all_facts)


def _start(channel: Any) -> np.datetime64 | None:
    start = channel.properties.get("wf_start_time")
    if not isinstance(start, np.datetime64) or np.isnat(start):
        return None
    return start


def _clock(group: _Group, channel: Any, first: np.datetime64 | None) -> object:
    """The clock's key: group, samples, and a channel's rate and start in s, where stated."""
    step = _step(channel)
    if step is None:
        return (group.name, len(channel), None, None)
    start = _start(channel)
    delay = 0.0
    if start is not None and first is not None:
        delay = float((start - first) / np.timedelta64(1, "ns")) / 1e9
    offset = channel.properties.get("wf_start_offset", 0.0)
    delay += float(offset) if isinstance(offset, float | int) and abs(offset) < 1e9 else 0.0
    return (group.name, len(channel), _rate(step), delay)


def _rate(step: float) -> float:
    """The rate of a step in s: 1000 Hz for the double nearest to a millisecond."""
    rate = 1.0 / step
    integer = round(rate)
    return float(integer) if integer and abs(rate - integer) <= 1e-12 * rate else rate


def _table(columns: dict[str, RawColumn], clock: Any) -> RawTable:
    _, rows, rate, late = clock
    if rate is None:
        return RawTable(columns)
    time = np.arange(rows) / rate
    return RawTable(columns, time if late == 0.0 else late + time, rate)


def _column(channel: Any) -> RawColumn | None:
    """A channel, scaled by npTDMS; None if its texts are too long for columns."""
    unit = next((u for n in _UNITS if isinstance(u := channel.properties.get(n), str) and u), None)
    values: NDArray[Any] = channel[:]
    if values.dtype.kind == "M":
        seconds = (values - values[0]) / np.timedelta64(1, "ns") / 1e9
        return RawColumn(np.asarray(seconds, np.float64), "s")
    if values.dtype.kind in "OU":
        texts = [str(value).replace("\x00", "") for value in values]
        if max(map(len, texts), default=0) > _LONGEST_TEXT:
            return None
        return RawColumn(np.array(texts, np.str_), unit)
    return RawColumn(values.astype(np.float64), None if unit is None else shown_name(unit))


def _facts(properties: Any, prefix: str = "") -> dict[str, float | str]:
    """Numbers and short texts stored as properties of the file or a group."""
    facts: dict[str, float | str] = {}
    for name, value in properties.items():
        full = prefix + str(name)
        plain = float(value) if isinstance(value, int | float | np.number) else str(value)
        long = isinstance(plain, str) and (len(plain) > _LONGEST_TEXT or not plain.isprintable())
        if not long and can_be_shown(full):
            facts[full] = plain
    return facts


SOURCE = Source("a TDMS file (.tdms)", recognises, read)
