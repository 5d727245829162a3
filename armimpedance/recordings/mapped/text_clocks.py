"""Repeated names in a header, and tables with a column of time for each channel."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.raw_file import RawColumn, RawTable

#: A repeated column of this name is the time of the channels to its right.
_TIME: Final = re.compile(
    r"(?:x|t|time|zeit|temps|time ?stamps?)\s*(?:[\[(].*[\])])?(?:_m?s)?", re.I
)


def distinct_names(names: Sequence[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Make names unique; return them and, if time is repeated, the channels of each time column.

    ``X[s], EMG [V], X[s], Fx [N]`` are two clocks, "X[s] of EMG [V]" and "X[s] of Fx [N]". Any
    other repeated name gets a number from its second occurrence on: "Fx (2)".
    """
    counts, seen = Counter(names), Counter[str]()
    several = any(counts[name] > 1 and _TIME.fullmatch(name) for name in counts)
    different: list[str] = []
    clocks: dict[str, list[str]] = {}
    clock = ""
    for i, name in enumerate(names):
        seen[name] += 1
        if several and counts[name] > 1 and _TIME.fullmatch(name):
            channel = names[i + 1] if i + 1 < len(names) else str(seen[name])
            clock = _unused(f"{name} of {channel}", different)
            clocks[clock] = []
        elif clock:
            clocks[clock].append(_unused(name, different))
        different.append(clock if clock and not clocks[clock] else _unused(name, different))
    return different, clocks


def _unused(name: str, used: Sequence[str]) -> str:
    if name not in used:
        return name
    return next(
        candidate for i in range(2, len(used) + 3) if (candidate := f"{name} ({i})") not in used
    )


def tables_of_clocks(
    columns: Mapping[str, RawColumn],
    clocks: Mapping[str, Sequence[str]],
    first_row: int,
    rate_hz: float | None,
) -> tuple[RawTable, ...]:
    """Group columns into tables, one per clock; channels with equal clocks share a table.

    `clocks`: see `distinct_names`.
    """
    clocked = {name for channels in clocks.values() for name in channels} | set(clocks)
    others = {name: column for name, column in columns.items() if name not in clocked}
    tables = (
        [RawTable(others, rate_hz=rate_hz, first_row=first_row)] if others or not clocks else []
    )
    for clock, channels in clocks.items():
        present = {name: columns[name] for name in channels if name in columns}
        if present and clock in columns:
            tables.append(_on(columns[clock], present, first_row))
    merged: list[RawTable] = []
    for table in tables:
        index = next((i for i, earlier in enumerate(merged) if _same(earlier, table)), None)
        if index is None:
            merged.append(table)
        else:
            columns_of_both = {**merged[index].columns, **table.columns}
            merged[index] = RawTable(columns_of_both, merged[index].time_s, first_row=first_row)
    return tuple(merged)


def _same(first: RawTable, second: RawTable) -> bool:
    if first.time_s is None or second.time_s is None:
        return False
    return np.array_equal(first.time_s, second.time_s)


def _on(clock: RawColumn, channels: Mapping[str, RawColumn], first_row: int) -> RawTable:
    """Table of channels on their clock, cut at the clock's end."""
    time = np.asarray(clock.values, dtype=np.float64)
    full = np.flatnonzero(~np.isnan(time))
    rows = int(full[-1]) + 1 if len(full) else 0
    unit = known_unit(clock.unit or "s")
    seconds: FloatArray = time[:rows] if unit is None else unit.to_si(time[:rows])
    cut = {name: RawColumn(c.values[:rows], c.unit) for name, c in channels.items()}
    return RawTable(cut, seconds, first_row=first_row)
