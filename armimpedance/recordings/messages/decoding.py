"""ROS messages read into columns from the layout of their bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from armimpedance.recordings.mapped.raw_file import Wanted
from armimpedance.recordings.messages.definitions import (
    PRIMITIVES,
    SEQUENCE,
    DefinitionError,
    Definitions,
    MessageField,
)

# The positions of numbers and texts in the bytes of a message.
#
# Messages of one topic mostly have the same layout: texts and arrays of the same lengths. One
# message is walked; the others whose lengths agree are then read as a table of bytes.

#: The encoding of messages: ROS 1's own, or CDR as in ROS 2.
Encoding = Literal["ros1", "cdr"]

#: Arrays up to this length become columns; longer ones (pictures, clouds of points) do not.
LONGEST_ARRAY: Final = 64

#: A topic with more columns than this is not a table of signals.
_MOST_COLUMNS: Final = 4096
_MOST_TEXTS: Final = 20_000
_DEEPEST: Final = 16


@dataclass
class MessageLayout:
    """The layout of messages of one length.

    `numbers`: path, such as "wrench.force.x" -> offset and numpy's type.
    `texts`: path -> offset and number of bytes.
    `same`: offset and number of bytes that are equal in all messages of this layout: lengths.
    `long`: paths of arrays that are too long for columns.
    """

    numbers: dict[str, tuple[int, str]] = field(default_factory=dict)
    texts: dict[str, tuple[int, int]] = field(default_factory=dict)
    same: list[tuple[int, int]] = field(default_factory=list)
    long: set[str] = field(default_factory=set)


def layout_of(message: bytes, name: str, known: Definitions, encoding: Encoding) -> MessageLayout:
    """Walk through one message.

    `name`: the message's type; all types in it are in `known`.
    Raises DefinitionError: the definition is incomplete, or this message does not fit it.
    """
    walker = _Walk(message, known, encoding)
    try:
        walker.message("", name, 0)
    except struct.error:
        raise DefinitionError("a message does not fit its definition") from None
    rest = len(message) - walker.place
    # CDR may be filled up to a multiple of four.
    if rest < 0 or rest > (3 if encoding == "cdr" else 0):
        raise DefinitionError("a message does not fit its definition")
    return _by_names(walker.layout, message)


class _Walk:
    """A walk through one message: the current place and the layout found so far."""

    def __init__(self, message: bytes, known: Definitions, encoding: Encoding) -> None:
        self.bytes, self.known, self.layout = message, known, MessageLayout()
        self.aligned = encoding == "cdr"
        self.start = 4 if self.aligned else 0
        self.place, self.order = self.start, "<"
        self.texts, self.steps = 0, 0
        self.sizes: dict[tuple[str, int], int] = {}
        if self.aligned:
            if len(message) < 4 or message[0] or message[1] > 1:
                raise DefinitionError("its messages are encoded in a way that is not read")
            self.order = "<" if message[1] else ">"
            self.layout.same.append((0, 2))

    def message(self, path: str, name: str, depth: int, taken: bool = True) -> None:
        """Walk through a message or a nested message."""
        self.steps += 1
        if depth > _DEEPEST or self.steps > 1000 + 10 * len(self.bytes):
            raise DefinitionError("messages lie in each other too deeply")
        if name not in self.known:
            raise DefinitionError(f"the message {name} has no definition")
        fields = self.known[name]
        if not fields and self.aligned:
            self.move("u1")
        for part in fields:
            self.field(f"{path}.{part.name}" if path else part.name, part, depth, taken)

    def field(self, path: str, part: MessageField, depth: int, taken: bool) -> None:
        if part.length is None:
            self.value(path, part.type, depth, taken)
            return
        count = self.count() if part.length == SEQUENCE else part.length
        kind = PRIMITIVES.get(part.type)
        if count > LONGEST_ARRAY:
            self.layout.long.add(path)
            taken = False
        if kind is not None and not taken:
            self.move(kind, count)
        elif taken:
            for i in range(count):
                self.value(f"{path}[{i}]", part.type, depth, taken)
        else:
            self.pass_over(part.type, count, depth)

    def value(self, path: str, name: str, depth: int, taken: bool) -> None:
        kind = PRIMITIVES.get(name)
        if kind is not None:
            offset = self.move(kind)
            if taken:
                self.layout.numbers[path] = (offset, self.order + kind)
                if len(self.layout.numbers) > _MOST_COLUMNS:
                    raise DefinitionError(f"more than {_MOST_COLUMNS} numbers in a message")
        elif name == "string":
            self.text(path, taken)
        elif name in ("wstring", "fixed", "float128", "wchar"):
            raise DefinitionError(f"a {name} is not read")
        else:
            self.message(path, name, depth + 1, taken)

    def move(self, kind: str, count: int = 1) -> int:
        """Move past numbers of a type and return the offset at which they begin."""
        size = int(kind[1:])
        if self.aligned and count:
            self.place += -(self.place - self.start) % size
        offset = self.place
        self.place += size * count
        if self.place > len(self.bytes):
            raise DefinitionError("a message does not fit its definition")
        return offset

    def count(self) -> int:
        offset = self.move("u4")
        self.layout.same.append((offset, 4))
        (count,) = struct.unpack_from(self.order + "I", self.bytes, offset)
        if count > len(self.bytes):
            raise DefinitionError("a message does not fit its definition")
        return int(count)

    def text(self, path: str, taken: bool) -> None:
        self.texts += 1
        if self.texts > _MOST_TEXTS:
            raise DefinitionError(f"more than {_MOST_TEXTS} texts in a message")
        length = self.count()
        offset = self.move("u1", length)
        if taken:
            # CDR counts the zero byte behind the text.
            end = 1 if self.aligned and length else 0
            self.layout.texts[path] = (offset, length - end)

    def pass_over(self, name: str, count: int, depth: int) -> None:
        """Move past an array of texts or messages that are not taken."""
        for _ in range(count):
            if self.place > len(self.bytes):
                break
            key = (name, (self.place - self.start) % 8)
            if key in self.sizes:
                self.place += self.sizes[key]
                continue
            before, marks = self.place, len(self.layout.same)
            self.value("", name, depth, taken=False)
            if len(self.layout.same) == marks:
                # It holds nothing of variable length, so all others are as long.
                self.sizes[key] = max(self.place - before, 1)
        if self.place > len(self.bytes):
            raise DefinitionError("a message does not fit its definition")


def _by_names(layout: MessageLayout, message: bytes) -> MessageLayout:
    """Name joints' numbers by the joints, where a message lists names beside its arrays."""
    names = list(_names(layout, message))
    if not names or len(set(names)) < len(names):
        return layout
    arrays: dict[str, list[str]] = {}
    for path in layout.numbers:
        if path.endswith("]"):
            arrays.setdefault(path.rpartition("[")[0], []).append(path)
    renamed = {
        path: f"{array}.{name}"
        for array, paths in arrays.items()
        if "." not in array and len(paths) == len(names)
        for path, name in zip(paths, names, strict=True)
    }
    if not renamed:
        return layout
    layout.numbers = {
        renamed.get(path, path): location for path, location in layout.numbers.items()
    }
    for path in [p for p in layout.texts if p.startswith("name[")]:
        layout.same.append(layout.texts.pop(path))
    return layout


def _names(layout: MessageLayout, message: bytes) -> Iterator[str]:
    for path, (offset, length) in layout.texts.items():
        if path.startswith("name["):
            yield message[offset : offset + length].decode(errors="replace")


Rows = NDArray[np.intp]

#: A longer text is not a label; a column of texts is as wide as its longest.
LONGEST_TEXT: Final = 64

_MOST_TRIES: Final = 32

#: The time of measurement in a message's header.
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
    """Decode these messages into columns.

    `name`: their type.
    `wanted`: whether a path is wanted.
    Raises DefinitionError: a message does not fit its definition.
    """
    block = Block(len(messages), np.zeros(len(messages), np.int64))
    lengths = np.array([len(m) for m in messages])
    for length in np.unique(lengths):
        rows = np.flatnonzero(lengths == length)
        joined = b"".join([messages[int(i)] for i in rows])
        table = np.frombuffer(joined, np.uint8).reshape(len(rows), length)
        for layout, part in _layout_groups(table, rows, name, known, encoding):
            _take(block, layout, table[part], rows[part], wanted)
    return block


def _layout_groups(
    table: NDArray[np.uint8], rows: Rows, name: str, known: Definitions, encoding: Encoding
) -> Iterator[tuple[MessageLayout, Rows]]:
    """The layouts in a table of messages of one length, each with its rows."""
    remaining = np.arange(len(rows))
    # Where nearly every message has its own layout, searching for others like it is useless.
    for _ in range(_MOST_TRIES):
        if not len(remaining):
            return
        first = table[remaining[0]]
        layout = layout_of(first.tobytes(), name, known, encoding)
        same = np.zeros(len(first), bool)
        for offset, count in layout.same:
            same[offset : offset + count] = True
        equal = (table[remaining][:, same] == first[same]).all(axis=1)
        yield layout, remaining[equal]
        remaining = remaining[~equal]
    for i in range(len(remaining)):
        yield layout_of(table[remaining[i]].tobytes(), name, known, encoding), remaining[i : i + 1]


def _take(
    block: Block, layout: MessageLayout, table: NDArray[np.uint8], rows: Rows, wanted: Wanted
) -> None:
    block.long |= layout.long
    if all(stamp_path in layout.numbers for stamp_path in _STAMP):
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
    """Each row of bytes as a text; only distinct rows are decoded, as most repeat."""
    if not table.shape[1]:
        return np.full(len(table), "", "U1")
    keys = np.ascontiguousarray(table).view(f"V{table.shape[1]}")[:, 0]
    different, inverse = np.unique(keys, return_inverse=True)
    texts = [key.tobytes().decode(errors="replace").replace("\x00", "") for key in different]
    return np.array(texts, np.str_)[inverse]


def joined_numbers(
    pieces: Sequence[tuple[Rows, NDArray[np.float64]]], count: int
) -> NDArray[np.float64]:
    """One column (count,) made of pieces, NaN where no piece has a value."""
    column = np.full(count, np.nan)
    for rows, values in pieces:
        column[rows] = values
    return column


def joined_texts(pieces: Sequence[tuple[Rows, NDArray[np.str_]]], count: int) -> NDArray[np.str_]:
    """One column (count,) made of pieces, "" where no piece has a text."""
    width = max([values.dtype.itemsize // 4 for _, values in pieces] + [1])
    column = np.zeros(count, f"U{width}")
    for rows, values in pieces:
        column[rows] = values
    return column
