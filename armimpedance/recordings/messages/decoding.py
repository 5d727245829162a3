"""Many messages of one ROS type as columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.recordings.mapped.raw_file import Wanted
from armimpedance.recordings.messages.definitions import Definitions
from armimpedance.recordings.messages.layout import Encoding, Layout, layout_of

Rows = NDArray[np.intp]

#: Text beyond this is no label; a column of texts is as wide as its longest.
LONGEST_TEXT: Final = 64

_MOST_TRIES: Final = 32

#: Where a message bears a header, the time at which it was measured.
_STAMP: Final = ("header.stamp.sec", "header.stamp.nanosec")


@dataclass
class Block:
    """Columns of some messages of a topic.

    Attributes
    ----------
    rows : int
        Number of messages n.
    numbers, texts : dict
        Path -> pieces: row numbers and as many values.
    stamp_ns : (n,) int64
        Nanoseconds of the header's stamp; 0 where there is none.
    long : set of str
        Paths of arrays and texts that are too long for columns.
    rounded : set of str
        Paths of whole numbers that float64 does not hold exactly.
    """

    rows: int
    stamp_ns: NDArray[np.int64]
    numbers: dict[str, list[tuple[Rows, NDArray[np.float64]]]] = field(default_factory=dict)
    texts: dict[str, list[tuple[Rows, NDArray[np.str_]]]] = field(default_factory=dict)
    long: set[str] = field(default_factory=set)
    rounded: set[str] = field(default_factory=set)


def decode(
    messages: Sequence[bytes], name: str, known: Definitions, encoding: Encoding, wanted: Wanted
) -> Block:
    """The columns of these messages.

    Parameters
    ----------
    messages : sequence of n bytes
    name : str
        Their type.
    wanted : callable
        Whether a path is wanted.

    Raises
    ------
    DefinitionError
        A message does not fit its definition.
    """
    block = Block(len(messages), np.zeros(len(messages), np.int64))
    lengths = np.array([len(m) for m in messages])
    for length in np.unique(lengths):
        rows = np.flatnonzero(lengths == length)
        joined = b"".join([messages[int(i)] for i in rows])
        table = np.frombuffer(joined, np.uint8).reshape(len(rows), length)
        for layout, part in _alike(table, rows, name, known, encoding):
            _take(block, layout, table[part], rows[part], wanted)
    return block


def _alike(
    table: NDArray[np.uint8], rows: Rows, name: str, known: Definitions, encoding: Encoding
) -> Iterator[tuple[Layout, Rows]]:
    """Layouts, and the rows of a table of messages of one length that have them."""
    left = np.arange(len(rows))
    # Where nearly each message has a layout of its own, looking for others that have it is in vain.
    for _ in range(_MOST_TRIES):
        if not len(left):
            return
        first = table[left[0]]
        layout = layout_of(first.tobytes(), name, known, encoding)
        same = np.zeros(len(first), bool)
        for offset, count in layout.same:
            same[offset : offset + count] = True
        alike = (table[left][:, same] == first[same]).all(axis=1)
        yield layout, left[alike]
        left = left[~alike]
    for i in range(len(left)):
        yield layout_of(table[left[i]].tobytes(), name, known, encoding), left[i : i + 1]


def _take(
    block: Block, layout: Layout, table: NDArray[np.uint8], rows: Rows, wanted: Wanted
) -> None:
    block.long |= layout.long
    if all(part in layout.numbers for part in _STAMP):
        sec, nanosec = (_numbers(table, *layout.numbers[p]).astype(np.int64) for p in _STAMP)
        block.stamp_ns[rows] = sec * 1_000_000_000 + nanosec
    for path, (offset, kind) in layout.numbers.items():
        if path in _STAMP or not wanted(path):
            continue
        values = _numbers(table, offset, kind)
        if kind[1:] in ("i8", "u8") and (values > 2**53).any():
            block.rounded.add(path)
        block.numbers.setdefault(path, []).append((rows, values.astype(np.float64)))
    for path, (offset, length) in layout.texts.items():
        if length > LONGEST_TEXT:
            block.long.add(path)
        elif wanted(path):
            texts = _texts(table[:, offset : offset + length])
            block.texts.setdefault(path, []).append((rows, texts))


def _numbers(table: NDArray[np.uint8], offset: int, kind: str) -> NDArray[Any]:
    size = int(kind[2:])
    return np.ascontiguousarray(table[:, offset : offset + size]).view(kind)[:, 0]


def _texts(table: NDArray[np.uint8]) -> NDArray[np.str_]:
    """Each row of bytes as a text; most rows are one of a few."""
    if not table.shape[1]:
        return np.full(len(table), "", "U1")
    keys = np.ascontiguousarray(table).view(f"V{table.shape[1]}")[:, 0]
    different, where = np.unique(keys, return_inverse=True)
    texts = [key.tobytes().decode(errors="replace").replace("\x00", "") for key in different]
    return np.array(texts, np.str_)[where]


def joined_numbers(
    pieces: Sequence[tuple[Rows, NDArray[np.float64]]], count: int
) -> NDArray[np.float64]:
    """One column (count,) of its pieces, NaN where there is none."""
    column = np.full(count, np.nan)
    for rows, values in pieces:
        column[rows] = values
    return column


def joined_texts(pieces: Sequence[tuple[Rows, NDArray[np.str_]]], count: int) -> NDArray[np.str_]:
    """One column (count,) of its pieces, "" where there is none."""
    width = max([values.dtype.itemsize // 4 for _, values in pieces] + [1])
    column = np.zeros(count, f"U{width}")
    for rows, values in pieces:
        column[rows] = values
    return column
