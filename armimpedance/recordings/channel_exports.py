"""MATLAB files that LabChart (ADInstruments) and Spike2 (CED) export.

LabChart puts all samples into one vector, ``data``; ``datastart`` and ``dataend`` (channels,
blocks) are the positions of each channel's samples, and a block is a run. Spike2 writes a struct
for each channel with its ``values``, ``interval`` and ``start``. Source: the makers' public
descriptions of these exports.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import not_taken
from armimpedance.recordings.mapped.raw_file import RawColumn, RawFile, RawRun, RawTable, Wanted
from armimpedance.recordings.mapped.text_clocks import distinct_names
from armimpedance.recordings.matlab_tree import Leaf, Node

_LABCHART: Final = ("data", "datastart", "dataend", "titles", "samplerate")
_SPIKE2: Final = ("values", "interval", "start")


def exported_channels(tree: Mapping[str, Node], wanted: Wanted) -> RawFile | None:
    """Read the runs of a file of one of these programs; None if it is of another kind.

    `tree`: name of a variable -> its content.
    Raises InputError: the descriptions of the channels do not fit the samples.
    """
    others: list[str] = []
    if all(name in tree for name in _LABCHART):
        runs = tuple(_blocks(tree))
    elif structs := _structs(tree):
        runs = (RawRun("", _tables(_waveforms(structs))),)
        waveforms = set(map(id, structs))
        others = [name for name, node in tree.items() if id(node) not in waveforms]
    else:
        return None
    names = dict.fromkeys(name for run in runs for table in run.tables for name in table.columns)
    unused = [name for name in names if not wanted(name)]
    used = tuple(
        RawRun(run.name, tuple(_wanted_of(table, wanted) for table in run.tables)) for run in runs
    )
    notes = not_taken(unused, "the mapping gives them no meaning")
    return RawFile(used, (*notes, *not_taken(others, "no waveforms")))


def _wanted_of(table: RawTable, wanted: Wanted) -> RawTable:
    columns = {name: column for name, column in table.columns.items() if wanted(name)}
    return RawTable(columns, table.time_s)


@dataclass(frozen=True, eq=False)
class _Channel:
    """Name, unit, samples and clock of a channel."""

    name: str
    unit: str | None
    values: FloatArray
    start_s: float
    step_s: float


def _tables(channels: list[_Channel]) -> tuple[RawTable, ...]:
    """Group channels of the same clock and length; repeated names are numbered."""
    names, _ = distinct_names([channel.name for channel in channels])
    clocks: dict[tuple[float, float, int], dict[str, RawColumn]] = {}
    for name, channel in zip(names, channels, strict=True):
        clock = (channel.start_s, channel.step_s, len(channel.values))
        clocks.setdefault(clock, {})[name] = RawColumn(channel.values, channel.unit)
    return tuple(
        RawTable(columns, np.asarray(start + step * np.arange(rows), dtype=np.float64))
        for (start, step, rows), columns in clocks.items()
    )


def _blocks(tree: Mapping[str, Node]) -> Iterator[RawRun]:
    """Yield the blocks of LabChart as runs."""
    data = _numbers(tree["data"], "data").ravel()
    titles = _texts(tree["titles"])
    first, last, rates = (
        _per_channel(tree[name], name, len(titles))
        for name in ("datastart", "dataend", "samplerate")
    )
    units = _texts(tree.get("unittext", []))
    number = (
        _per_channel(tree["unittextmap"], "unittextmap", len(titles))
        if "unittextmap" in tree
        else np.zeros_like(first)
    )
    if not first.shape == last.shape == rates.shape == number.shape:
        raise _wrong("datastart", f"of shape {first.shape} beside dataend's {last.shape}")
    for block in range(first.shape[1]):
        channels = []
        for c, title in enumerate(titles):
            begin, end, rate = (float(array[c, block]) for array in (first, last, rates))
            if begin < 1:  # a channel that was off
                continue
            if not (begin <= end <= len(data) and 0 < rate < np.inf):
                raise _wrong(title, f"samples {begin:g} to {end:g} of {len(data)} at {rate:g} Hz")
            unit_number = float(number[c, block])
            unit = units[int(unit_number) - 1] if 1 <= unit_number <= len(units) else None
            values = data[int(begin) - 1 : int(end)]
            channels.append(_Channel(title, unit, values, 0.0, 1.0 / rate))
        yield RawRun(f"block {block + 1}", _tables(channels))


def _structs(tree: Mapping[str, Node]) -> list[dict[str, Node]]:
    """Structs of Spike2's waveform channels; empty if the file has other variables too."""
    structs = [node for node in tree.values() if isinstance(node, dict) and "title" in node]
    if not all(isinstance(node, dict) for node in tree.values()):
        return []
    return [
        struct for struct in structs if all(isinstance(struct.get(name), Leaf) for name in _SPIKE2)
    ]


def _waveforms(structs: list[dict[str, Node]]) -> list[_Channel]:
    """Read Spike2's waveform channels."""
    channels = []
    for i, struct in enumerate(structs, start=1):
        name = next(iter(_texts(struct.get("title", []))), "") or f"channel {i}"
        unit = next(iter(_texts(struct.get("units", []))), None)
        values = _numbers(struct["values"], name).ravel()
        step, start = (_numbers(struct[n], name).ravel() for n in ("interval", "start"))
        if len(step) != 1 or len(start) != 1 or not 0 < step[0] < np.inf > abs(start[0]):
            raise _wrong(name, f"an interval of {step[:1]} s from {start[:1]} s on")
        channels.append(_Channel(name, unit, values, float(start[0]), float(step[0])))
    return channels


def _per_channel(node: Node, name: str, channels: int) -> FloatArray:
    """Return a variable as a matrix (channels, blocks)."""
    values = _numbers(node, name)
    if values.size % max(channels, 1) or not values.size:
        raise _wrong(name, f"{values.size} values of {channels} channels")
    return values.reshape(channels, -1)


def _numbers(node: Node, name: str) -> FloatArray:
    values = node.read() if isinstance(node, Leaf) else np.empty(0)
    if values.dtype.kind not in "fiub" or not values.size:
        raise _wrong(name, "no numbers")
    return np.asarray(values, dtype=np.float64)


def _texts(node: Node) -> list[str]:
    """Texts of a variable: rows of a matrix of letters, or one text."""
    if isinstance(node, str):
        return [node.strip()]
    values = node.read().ravel().tolist() if isinstance(node, Leaf) else node
    return [str(text).strip() for text in values] if isinstance(values, list) else []


def _wrong(name: str, problem: str) -> InputError:
    return InputError(problem, column=name, expected="channels as LabChart or Spike2 export them")
