"""Names that come again in a header, and the clocks of such a table: one beside each channel."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.recordings.mapped.mapping import known_unit
from armimpedance.recordings.mapped.raw_file import RawColumn, RawTable

#: A column of this name, again and again, is the time of the channels that stand right of it.
_TIME: Final = re.compile(
    r"(?:x|t|time|zeit|temps|time ?stamps?)\s*(?:[\[(].*[\])])?(?:_m?s)?", re.I
)


def distinct_names(names: Sequence[str]) -> tuple[list[str], dict[str, list[str]]]:
    """Different names for all columns, and column of time -> its channels, where it comes again.

    ``X[s], EMG [V], X[s], Fx [N]`` are two clocks, "X[s] of EMG [V]" and "X[s] of Fx [N]". Any
    other name that comes again has a number from its second time on: "Fx (2)".
    """
    counts, seen = Counter(names), Counter[str]()
    several = any(counts[name] > 1 and _TIME.fullmatch(name) for name in counts)
    different: list[str] = []
    clocks: dict[str, list[str]] = {}
    clock = ""
    for i, name in enumerate(names):
        seen[name] += 1
        if several and counts[name] > 1 and _TIME.fullmatch(name):
            beside = names[i + 1] if i + 1 < len(names) else str(seen[name])
            clock = _unused(f"{name} of {beside}", different)
            clocks[clock] = []
        elif clock:
            clocks[clock].append(_unused(name, different))
        different.append(clock if clock and not clocks[clock] else _unused(name, different))
    return different, clocks


def _unused(name: str, taken: Sequence[str]) -> str:
    if name not in taken:
        return name
    return next(new for i in range(2, len(taken) + 3) if (new := f"{name} ({i})") not in taken)


def tables_of_clocks(
    columns: Mapping[str, RawColumn],
    clocks: Mapping[str, Sequence[str]],
    first_row: int,
    rate_hz: float | None,
) -> tuple[RawTable, ...]:
    """The columns as tables, one a clock; channels whose clocks are the same share one.

    `clocks`: see `distinct_names`.
    """
    own = {name for channels in clocks.values() for name in channels} | set(clocks)
    rest = {name: column for name, column in columns.items() if name not in own}
    tables = [RawTable(rest, rate_hz=rate_hz, first_row=first_row)] if rest or not clocks else []
    for clock, channels in clocks.items():
        there = {name: columns[name] for name in channels if name in columns}
        if there and clock in columns:
            tables.append(_on(columns[clock], there, first_row))
    merged: list[RawTable] = []
    for table in tables:
        alike = next((i for i, other in enumerate(merged) if _same(other, table)), None)
        if alike is None:
            merged.append(table)
        else:
            both = {**merged[alike].columns, **table.columns}
            merged[alike] = RawTable(both, merged[alike].time_s, first_row=first_row)
    return tuple(merged)


def _same(one: RawTable, other: RawTable) -> bool:
    if one.time_s is None or other.time_s is None:
        return False
    return np.array_equal(one.time_s, other.time_s)


def _on(clock: RawColumn, channels: Mapping[str, RawColumn], first_row: int) -> RawTable:
    """Channels on their clock, to where it ends."""
    time = np.asarray(clock.values, dtype=np.float64)
    full = np.flatnonzero(~np.isnan(time))
    rows = int(full[-1]) + 1 if len(full) else 0
    unit = known_unit(clock.unit or "s")
    seconds: FloatArray = time[:rows] if unit is None else unit.to_si(time[:rows])
    cut = {name: RawColumn(c.values[:rows], c.unit) for name, c in channels.items()}
    return RawTable(cut, seconds, first_row=first_row)
