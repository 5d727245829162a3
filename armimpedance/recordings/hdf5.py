"""Safe reading of foreign HDF5 files: no links to other files, no unlimited memory."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from struct import unpack
from typing import Any, BinaryIO, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, needed
from armimpedance.core.inputs import check_claim
from armimpedance.recordings.matlab_tree import Leaf, Node, Refused

MAGIC: Final = b"\x89HDF\r\n\x1a\n"

#: Largest ratio of compression by deflate; a dataset that claims more is damaged.
_TIGHTEST: Final = 1100
_SMALL_BYTES: Final = 4_000_000
#: Most numbers of one dataset, 500 MB.
MOST_NUMBERS: Final = 62_500_000
_LONGEST_TEXT: Final = 10_000
#: Largest attribute, bytes.
_LARGEST_ATTRIBUTE: Final = 1_000_000
_LONGEST_NAME: Final = 80
#: Beginning of a heap, with its version.
_HEAP: Final = b"GCOL\x01"
_LARGEST_CHECKED: Final = 4_000_000_000
#: Bytes that are searched at once.
_BLOCK: Final = 8_000_000


class Hdf5Error(Exception):
    """A dataset cannot be read; the message is a short reason."""


@contextmanager
def opened_hdf5(path: Path, extra: str, expected: str) -> Iterator[Any]:
    """Open an HDF5 file for reading.

    `extra`: the extra of the installation that brings h5py.
    `expected`: for the message, such as "an NWB file".
    Raises InputError: h5py is not installed, or the file is damaged.
    """
    h5py = needed("h5py", extra, path)
    check_heaps(path, expected)
    try:
        with h5py.File(path, "r") as file:
            yield file
    except (InputError, Hdf5Error):
        raise
    except Exception as error:
        # for damage h5py raises OSError, RuntimeError, KeyError, ValueError, TypeError, ...
        problem = f"is damaged: {' '.join(str(error).split())[:80]}"
        raise InputError(problem, file=path, expected=expected) from None


def check_heaps(path: Path, expected: str) -> None:
    """Refuse a file whose heaps of texts have a part of length 0: HDF5 would loop for ever.

    `expected`: for the message.
    Raises InputError: a heap has a part of length 0. HDF5 does not check this, and no signal ends
    its loop.
    """
    size = path.stat().st_size
    if not size or size > _LARGEST_CHECKED:
        return
    # not mapped into memory: a file that is truncated meanwhile would end the process
    with path.open("rb") as stream, path.open("rb") as walked:
        for offset in _heaps(stream):
            if _has_empty_part(walked, offset, size):
                problem = f"is damaged: a heap at byte {offset} has a part of no length"
                raise InputError(problem, file=path, expected=expected)


def _heaps(stream: BinaryIO) -> Iterator[int]:
    """Yield the positions of the heaps of a file, in bytes."""
    start, tail = 0, b""
    while block := stream.read(_BLOCK):
        data = tail + block
        offset = data.find(_HEAP)
        while offset >= 0:
            yield start + offset
            offset = data.find(_HEAP, offset + len(_HEAP))
        # the next block may hold the rest of a heap's beginning
        tail = data[len(data) - len(_HEAP) + 1 :]
        start += len(data) - len(tail)


def _has_empty_part(stream: BinaryIO, offset: int, size: int) -> bool:
    """True if a heap has a part of length 0; parts have a header of 16 bytes, lengths of 8 n."""
    if offset + 16 > size:
        return False
    stream.seek(offset + 8)
    (length,) = unpack("<Q", stream.read(8).ljust(8, b"\0"))
    end = min(offset + length, size)
    offset += 16
    while offset + 16 <= end:
        stream.seek(offset)
        number, _, part = unpack("<HHxxxxQ", stream.read(16).ljust(16, b"\xff"))
        step = 16 + (part + 7) // 8 * 8 if number else part
        if not step:
            return True
        offset += step
    return False


def inner(group: Any) -> Iterator[tuple[str, Any]]:
    """Yield names and members of a group; None for a member that is not read.

    Links to other files and broken links are not followed; a name must be printable and short.
    """
    for name in map(str, group):
        shown = name.isprintable() and len(name) <= _LONGEST_NAME
        yield name, member(group, name) if shown else None


def member(group: Any, path: str) -> Any:
    """Return the member of a group under a path; None if there is nothing in this file."""
    h5py = needed("h5py", "nwb", path)
    home, content = h5py.h5f.get_name(group.id), group
    for part in path.split("/"):
        if is_dataset(content):
            return None
        link = content.get(part, getlink=True)
        if link is None or isinstance(link, h5py.ExternalLink):
            return None
        try:
            content = content[part]
        except (KeyError, OSError, RuntimeError):
            return None
        # a soft link may lead through another link into another file
        if h5py.h5f.get_name(content.id) != home:
            return None
    return content


def is_dataset(content: Any) -> bool:
    """Return True for a dataset, False for a group."""
    return hasattr(content, "shape")


def numbers(dataset: Any) -> FloatArray:
    """Read all numbers of a dataset, float64, in its shape.

    Raises Hdf5Error: it holds no numbers, too many, fewer than it claims, or cannot be unpacked.
    """
    check_numbers(dataset)
    try:
        # read as stored: HDF5's own conversion of types is not needed
        return np.asarray(dataset[()]).astype(np.float64, copy=False)
    except (OSError, ValueError, TypeError, RuntimeError, MemoryError):
        raise Hdf5Error("it cannot be unpacked") from None


def check_numbers(dataset: Any) -> None:
    """Refuse a dataset whose numbers cannot be read, before memory is allocated."""
    kind = dataset.dtype
    if kind.kind not in "iufb":
        raise Hdf5Error("it holds no numbers")
    if dataset.external or dataset.is_virtual:
        raise Hdf5Error("its data lie in another file")
    count = math.prod(dataset.shape)
    if count > MOST_NUMBERS:
        raise Hdf5Error(f"more than {MOST_NUMBERS} numbers")
    stored = dataset.id.get_storage_size()
    if count * kind.itemsize > _TIGHTEST * stored + (_SMALL_BYTES if stored else 0):
        raise Hdf5Error("it claims more than the file holds")
    chunk = math.prod(dataset.chunks) if dataset.chunks else 0
    if chunk * kind.itemsize > 2 * MOST_NUMBERS:
        raise Hdf5Error("its parts claim more than the file holds")


def texts(dataset: Any) -> list[str]:
    """Read all texts of a dataset with one axis."""
    if dataset.dtype.kind not in "OS" or len(dataset.shape) != 1:
        raise Hdf5Error("it holds no texts")
    if dataset.external or dataset.is_virtual or dataset.shape[0] > 1_000_000:
        raise Hdf5Error("it claims more than the file holds")
    if dataset.dtype.itemsize * dataset.shape[0] > _TIGHTEST * dataset.id.get_storage_size():
        raise Hdf5Error("it claims more than the file holds")
    try:
        return [plain_text(value) for value in dataset[()]]
    except (OSError, ValueError, TypeError, RuntimeError, MemoryError):
        raise Hdf5Error("it cannot be unpacked") from None


def plain_text(value: Any) -> str:
    """Return an attribute or scalar dataset as text; an empty string if it holds no text."""
    if isinstance(value, bytes):
        value = value.decode(errors="replace")
    if not isinstance(value, str):
        return ""
    return value[:_LONGEST_TEXT].replace("\x00", "")


def attribute(content: Any, name: str) -> Any:
    """Return an attribute as stored; None if there is none.

    Raises ValueError: it claims to be larger than any attribute.
    """
    if name not in content.attrs:
        return None
    stored = content.attrs.get_id(name)
    if stored.dtype.itemsize * math.prod(stored.shape or ()) > _LARGEST_ATTRIBUTE:
        raise ValueError(f"{name} claims more than {_LARGEST_ATTRIBUTE} bytes")
    return content.attrs[name]


def attribute_text(content: Any, name: str) -> str:
    """Return the text of an attribute; "" if there is none."""
    try:
        return plain_text(attribute(content, name))
    except (OSError, ValueError, TypeError, RuntimeError, KeyError, MemoryError):
        return ""


def attribute_number(content: Any, name: str, default: float) -> float:
    """Return the number in an attribute, or the default if there is no such attribute.

    Raises Hdf5Error: it is not a finite number.
    """
    try:
        value = attribute(content, name)
        number = default if value is None else float(np.asarray(value).reshape(-1)[0])
    except (OSError, ValueError, TypeError, RuntimeError, KeyError, IndexError, MemoryError):
        raise Hdf5Error(f"its {name} is no number") from None
    if not math.isfinite(number):
        raise Hdf5Error(f"its {name} is not finite")
    return number


# MATLAB files of version 7.3, which are HDF5: variables as a tree, references followed.

_DEEPEST: Final = 30
#: Most parts of a file that are read; a session of 10,000 trials with 20 fields has fewer.
_MOST_PARTS: Final = 300_000
_MOST_LETTERS: Final = 1_000_000
#: Groups in which MATLAB keeps referenced data.
_HIDDEN: Final = ("#refs#", "#subsystem#")
#: Errors that the library raises for a damaged file.
_ERRORS: Final = (
    *(OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError),
    *(OverflowError, MemoryError, UnicodeError, NotImplementedError, SystemError),
)


class Mat73:
    """An open MATLAB file; its leaves can be read while it is open.

    Raises InputError: h5py is not installed, or the file cannot be opened.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        self.h5py = needed("h5py", "matlab", file)
        self.parts = 0
        check_heaps(file, "a file as MATLAB saves it")
        try:
            self.root = self.h5py.File(file, "r")
        except _ERRORS as error:
            raise self.damaged(error) from None

    def close(self) -> None:
        """Close the file."""
        self.root.close()

    def damaged(self, error: BaseException) -> InputError:
        """Return the error for a damaged file, with the library's reason on one line."""
        reason = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        problem = f"is a damaged MATLAB 7.3 file: {reason}"
        return InputError(problem, file=self.file, expected="a file as MATLAB saves it")

    def tree(self) -> dict[str, Node]:
        """Variables of the file, by name."""
        try:
            return {name: self._member(self.root, name, 0) for name in self._names(self.root)}
        except InputError:
            raise
        except _ERRORS as error:
            raise self.damaged(error) from None

    def _names(self, group: Any) -> list[str]:
        # links to other files are not followed
        hard = self.h5py.HardLink
        names = [n for n in group if isinstance(n, str) and n not in _HIDDEN]
        return [n for n in names if isinstance(group.get(n, getlink=True), hard)]

    def _member(self, group: Any, name: str, depth: int) -> Node:
        return self._node(group[name], depth, name)

    def _node(self, content: Any, depth: int, name: str) -> Node:
        self.parts += 1
        if depth > _DEEPEST or self.parts > _MOST_PARTS:
            problem = f"more than {_DEEPEST} levels or {_MOST_PARTS} parts"
            raise InputError(problem, file=self.file, column=name, expected="plain structs")
        kind = _text(attribute(content, "MATLAB_class"))
        if "MATLAB_object_decode" in content.attrs or kind == "function_handle":
            return Refused(f"an object of MATLAB class {kind or 'unknown'}")
        if isinstance(content, self.h5py.Group):
            return self._struct(content, depth)
        if not isinstance(content, self.h5py.Dataset):
            return Refused("no data")
        return self._dataset(content, kind, depth, name)

    def _struct(self, group: Any, depth: int) -> Node:
        names = self._names(group)
        members = {name: group[name] for name in names}
        arrays = [m for m in members.values() if self._is_array_of_structs(m)]
        if not arrays or len(arrays) < len(members):
            return {name: self._member(group, name, depth + 1) for name in names}
        fields = {name: self._referred(m, depth + 1, name) for name, m in members.items()}
        count = min(len(entries) for entries in fields.values())
        return [{name: entries[i] for name, entries in fields.items()} for i in range(count)]

    def _is_array_of_structs(self, member: Any) -> bool:
        """True for a field of an array of structs: references without a class of their own."""
        is_data = isinstance(member, self.h5py.Dataset)
        return is_data and self._holds_references(member) and "MATLAB_class" not in member.attrs

    def _holds_references(self, data: Any) -> bool:
        return bool(self.h5py.check_ref_dtype(data.dtype) == self.h5py.Reference)

    def _referred(self, data: Any, depth: int, name: str) -> list[Node]:
        self._check(data, name)
        if data.size > _MOST_PARTS:
            raise InputError(f"{data.size} parts", file=self.file, column=name, expected="fewer")
        nodes: list[Node] = []
        # HDF5's order is C, MATLAB's is Fortran: axes are reversed in the file
        for reference in np.asarray(data[()]).ravel():
            nodes.append(self._node(self.root[reference], depth + 1, name) if reference else "")
        return nodes

    def _dataset(self, data: Any, kind: str, depth: int, name: str) -> Node:
        if data.shape is None or attribute(data, "MATLAB_empty"):
            return "" if kind == "char" else Leaf((0, 0), lambda: np.zeros((0, 0)))
        if self._holds_references(data):
            return self._referred(data, depth, name)
        if data.is_virtual or data.external:
            return Refused("data in another file")
        self._check(data, name)
        if kind == "char" and data.size > _MOST_LETTERS:
            return Refused(f"a text of {data.size} letters")
        if kind == "char":
            return _letters(np.asarray(data[()]).T)
        if self.h5py.check_string_dtype(data.dtype) is not None or data.dtype.kind not in "fiub":
            return Refused(f"{data.dtype}")
        reversed_axes = bool(kind)
        shape = data.shape[::-1] if reversed_axes else data.shape

        def read() -> np.ndarray[Any, Any]:
            try:
                values = np.asarray(data[()])
            except _ERRORS as error:
                raise self.damaged(error) from None
            return values.T if reversed_axes else values

        return Leaf(shape, read)

    def _check(self, data: Any, name: str) -> None:
        check_claim(math.prod(data.shape or (0,)) * max(data.dtype.itemsize, 8), self.file, name)


def _letters(codes: np.ndarray[Any, Any]) -> Node:
    """Texts from the codes of their letters, one per row; a single row gives a single text."""
    rows = codes.reshape(1, -1) if codes.ndim < 2 else codes.reshape(codes.shape[0], -1)
    texts = ["".join(map(chr, row.tolist())).rstrip() for row in rows.astype(np.uint16)]
    return texts[0] if len(texts) == 1 else [*texts]


def _text(value: object) -> str:
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value or "")
