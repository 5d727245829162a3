"""MATLAB files of versions 4 to 7, checked byte by byte before SciPy allocates memory.

SciPy's reader trusts the sizes and types in a file: a damaged file could request any amount of
memory. Here every element is checked first, so that the file holds what it claims.
"""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import MOST_PACKED, PLENTY, check_claim, check_regular
from armimpedance.recordings.matlab_tree import Leaf, Node, Refused

_MATRIX, _COMPRESSED = 14, 15
#: Data types of elements -> bytes of one value.
_SIZES: Final = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_DEEPEST: Final = 40
#: Most parts of one variable; a session of 10,000 trials with 20 fields has fewer.
_MOST_PARTS: Final = 300_000
_MOST_AXES: Final = 8
_SIZES_4: Final = (8, 4, 4, 2, 2, 1)


class _DamagedError(Exception):
    """The bytes are damaged; converted to an `InputError`."""


def read_mat5(file: Path) -> dict[str, Node]:
    """Read the variables of a MATLAB file before version 7.3, by name.

    Raises InputError: the file is damaged, or claims more than it can hold.
    """
    check_regular(file)
    try:
        data = file.read_bytes()
        objects: dict[str, Node] = {}
        safe = _checked4(data) if _is_version4(data) else _checked5(data, file, objects)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    except (_DamagedError, struct.error, zlib.error) as error:
        problem = f"is a damaged MATLAB file: {error}"
        raise InputError(problem, file=file, expected="a file as MATLAB saves it") from None
    return {**_loaded(safe, file), **objects}


def _loaded(data: bytes, file: Path) -> dict[str, Node]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            variables = loadmat(cast(Any, io.BytesIO(data)), mat_dtype=False)
    except (
        *(MatReadError, ValueError, TypeError, KeyError, IndexError, OSError, AttributeError),
        *(UnicodeError, OverflowError, MemoryError, NotImplementedError, zlib.error),
    ) as error:
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        problem = f"is a damaged MATLAB file: {reason}"
        raise InputError(problem, file=file, expected="a file as MATLAB saves it") from None
    return {
        str(n): _node(v) for n, v in variables.items() if not (n.startswith("__") or n == "None")
    }


def _node(value: Any) -> Node:
    """Convert a value from SciPy to a node of the tree."""
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque

    if isinstance(value, MatlabOpaque | MatlabObject):
        return Refused(f"an object of MATLAB class {_class_of(value)}")
    if isinstance(value, MatlabFunction):
        return Refused("a function")
    if not isinstance(value, np.ndarray):
        return Refused("a sparse matrix")
    if value.dtype.names is not None:
        entries = value.ravel(order="F")
        records: list[Node] = [{str(n): _node(e[n]) for n in value.dtype.names} for e in entries]
        return records[0] if len(records) == 1 else records
    if value.dtype == object:
        return [_node(entry) for entry in value.ravel(order="F")]
    if value.dtype.kind in "US":
        texts = [str(text) for text in value.ravel()]
        return texts[0] if len(texts) == 1 else [*texts]
    if value.dtype.kind not in "fiub":
        return Refused("complex numbers")
    return Leaf(value.shape, lambda: value)


def _class_of(value: Any) -> str:
    name = getattr(value, "classname", None)
    if name is None and value.dtype.names and value.size:
        name = value.ravel()[0]["s2"] if "s2" in value.dtype.names else None
    if isinstance(name, bytes):
        return name.decode("ascii", "replace")
    return str(name) if name else "unknown"


def _is_version4(data: bytes) -> bool:
    return len(data) >= 4 and 0 in data[:4] and data[126:128] not in (b"IM", b"MI")


def _checked4(data: bytes) -> bytes:
    """Check that all matrices of a version 4 file lie within it; return the bytes unchanged."""
    at = 0
    while at < len(data):
        if len(data) - at < 20:
            raise _DamagedError(f"a header ends at byte {len(data)}")
        order = "<" if struct.unpack_from("<i", data, at)[0] in range(5000) else ">"
        kind, rows, columns, imaginary, name = struct.unpack_from(f"{order}5i", data, at)
        places = (kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10)
        if places[0] not in (0, 1) or places[1] or places[2] > 5 or places[3] > 2:
            raise _DamagedError(f"matrix type {kind} at byte {at}")
        if min(rows, columns) < 0 or imaginary not in (0, 1) or not 0 < name <= 256:
            raise _DamagedError(f"a matrix of {rows} x {columns} at byte {at}")
        size = rows * columns * _SIZES_4[places[2]] * (1 + imaginary)
        if at + 20 + name + size > len(data):
            raise _DamagedError(
                f"the matrix at byte {at} claims {size} bytes, beyond the file's end"
            )
        at += 20 + name + size
    return data


def _checked5(data: bytes, file: Path, objects: dict[str, Node]) -> bytes:
    """Check and unpack the elements of a file; return it without objects, which are listed."""
    if len(data) < 128:
        raise _DamagedError("it ends within its header")
    marks = {b"IM": "<", b"MI": ">"}
    if data[126:128] not in marks:
        raise _DamagedError("no mark of its byte order")
    order = marks[data[126:128]]
    out = [data[:128]]
    at, room = 128, max(PLENTY, MOST_PACKED * len(data))
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}2I", data, at)
        if at + 8 + size > len(data):
            raise _DamagedError(
                f"the element at byte {at} claims {size} bytes, beyond the file's end"
            )
        body = data[at + 8 : at + 8 + size]
        if kind == _COMPRESSED:
            body = _unpacked(body, room, order, file)
            at += 8 + size
        elif kind == _MATRIX:
            at += 8 + size + (-size % 8)
        else:
            raise _DamagedError(f"element type {kind} at byte {at}")
        room -= len(body)
        walker = _Walker(body, order)
        walker.matrix(0, len(body), 0)
        if walker.name is None:
            continue  # MATLAB's storage of the objects' content
        if walker.class_name is not None:
            objects[walker.name] = Refused(f"an object of MATLAB class {walker.class_name}")
            continue
        body += b"\0" * (-len(body) % 8)
        out.append(struct.pack(f"{order}2I", _MATRIX, len(body)) + body)
    return b"".join(out)


def _unpacked(body: bytes, room: int, order: str, file: Path) -> bytes:
    """Unpack the matrix in a packed element."""
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(body, room)
    if unpacker.unconsumed_tail:
        check_claim(max(len(data) + 1, room + 1), file)
    if not unpacker.eof:
        raise _DamagedError("a packed element is cut off")
    kind, size = struct.unpack_from(f"{order}2I", data, 0)
    if kind != _MATRIX or 8 + size > len(data):
        raise _DamagedError("a packed element is no matrix")
    return data[8 : 8 + size]


@dataclass(frozen=True)
class _Element:
    """Position and type of the data of a sub-element, in bytes."""

    kind: int
    start: int
    size: int
    after: int


class _Walker:
    """Check of a matrix and everything in it; it raises `_DamagedError` for a fault.

    `name` is that of the outermost matrix, None if it has none; `class_name` is set for an object.
    """

    def __init__(self, data: bytes, order: str) -> None:
        self.data, self.order = data, order
        self.parts = 0
        self.name: str | None = None
        self.class_name: str | None = None

    def element(self, at: int, end: int) -> _Element:
        """Return type and position of the sub-element at a byte."""
        if at + 8 > end:
            raise _DamagedError("an element beyond the end of its matrix")
        first, second = struct.unpack_from(f"{self.order}2I", self.data, at)
        if first >> 16:
            kind, size, start, after = first & 0xFFFF, first >> 16, at + 4, at + 8
            if size > 4:
                raise _DamagedError(f"a small element of {size} bytes")
        else:
            kind, size, start = first, second, at + 8
            after = start + size + (-size % 8)
        if start + size > end or after > end + 7:
            raise _DamagedError(f"an element of {size} bytes beyond the end of its matrix")
        return _Element(kind, start, size, min(after, end))

    def data_of(self, at: int, end: int, kinds: tuple[int, ...] = tuple(_SIZES)) -> _Element:
        """Return an element of numbers, with a check of its type."""
        element = self.element(at, end)
        if element.kind not in kinds or element.size % _SIZES[element.kind]:
            raise _DamagedError(f"data of type {element.kind} in {element.size} bytes")
        return element

    def matrix(self, at: int, end: int, depth: int) -> None:
        """Check a matrix between two bytes."""
        if depth > _DEEPEST:
            raise _DamagedError(f"more than {_DEEPEST} levels")
        if at == end:
            return
        flags = self.data_of(at, end, (6,))
        if flags.size != 8:
            raise _DamagedError("array flags of another size")
        (word,) = struct.unpack_from(f"{self.order}I", self.data, flags.start)
        kind, is_complex = word & 0xFF, bool(word & 0x800)
        if kind == _OPAQUE:
            self._opaque(flags.after, end, depth)
            return
        if not _CELL <= kind <= _FUNCTION:
            raise _DamagedError(f"array class {kind}")
        # some programs write sizes as unsigned integers
        dims = self.data_of(flags.after, end, (5, 6))
        axes = dims.size // 4
        if not 2 <= axes <= _MOST_AXES:
            raise _DamagedError(f"a matrix of {axes} axes")
        shape = struct.unpack_from(f"{self.order}{axes}i", self.data, dims.start)
        if min(shape) < 0:
            raise _DamagedError("a negative size")
        name = self.data_of(dims.after, end, (1, 2, 16))
        if depth == 0:
            self.name = self.text(name) or None
        self._content(kind, is_complex, math.prod(shape), name.after, end, depth)

    def _content(
        self, kind: int, is_complex: bool, count: int, at: int, end: int, depth: int
    ) -> None:
        if kind == _CELL:
            self._matrices(count, at, end, depth)
        elif kind in (_STRUCT, _OBJECT):
            if kind == _OBJECT:
                at = self.data_of(at, end, (1, 2, 16)).after
            self._struct(count, at, end, depth)
        elif kind == _FUNCTION:
            self._matrices(1, at, end, depth)
        elif kind == _SPARSE:
            for _ in range(3 + is_complex):
                element = self.element(at, end)
                if element.kind not in _SIZES:
                    raise _DamagedError(f"data of type {element.kind}")
                at = element.after
        else:
            for _ in range(1 + is_complex):
                element = self.data_of(at, end)
                values = element.size // _SIZES[element.kind]
                # text in UTF-8 may have several bytes per letter; everything else one value each
                enough = (
                    values >= count if kind == _CHAR and element.kind == 16 else values == count
                )
                if not enough:
                    raise _DamagedError(f"{values} values in a matrix of {count}")
                at = element.after

    def _struct(self, count: int, at: int, end: int, depth: int) -> None:
        length = self.data_of(at, end, (5,))
        if length.size != 4:
            raise _DamagedError("no length of field names")
        (letters,) = struct.unpack_from(f"{self.order}i", self.data, length.start)
        names = self.data_of(length.after, end, (1, 2))
        if letters <= 0 or names.size % letters:
            raise _DamagedError(f"field names of {letters} letters in {names.size} bytes")
        fields = [
            self.data[i : i + letters].split(b"\0")[0]
            for i in range(names.start, names.start + names.size, letters)
        ]
        if len(set(fields)) < len(fields) or b"" in fields:
            raise _DamagedError("a field name is empty or appears twice")
        if not fields and count > _MOST_PARTS:
            raise _DamagedError(f"{count} structs without a field")
        self._matrices(count * len(fields), names.after, end, depth)

    def _opaque(self, at: int, end: int, depth: int) -> None:
        texts = []
        for _ in range(3):
            element = self.data_of(at, end, (1, 2, 16))
            texts.append(self.text(element))
            at = element.after
        if depth == 0:
            self.name, self.class_name = texts[0] or None, texts[2]
        self._matrices(1, at, end, depth)

    def text(self, element: _Element) -> str:
        """Return the printable letters of an element."""
        data = self.data[element.start : element.start + element.size]
        return "".join(c for c in data.decode("ascii", "replace") if c.isprintable())[:100]

    def _matrices(self, count: int, at: int, end: int, depth: int) -> None:
        if count > (end - at) // 8:
            raise _DamagedError(f"{count} parts in {end - at} bytes")
        self.parts += count
        if self.parts > _MOST_PARTS:
            raise _DamagedError(f"more than {_MOST_PARTS} parts in one variable")
        for _ in range(count):
            element = self.element(at, end)
            if element.kind != _MATRIX:
                raise _DamagedError(f"a part of type {element.kind}")
            self.matrix(element.start, element.start + element.size, depth + 1)
            at = element.after
