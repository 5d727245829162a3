"""MATLAB files of version 7.3, which are HDF5: variables as a tree, references followed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.errors import InputError, needed
from armimpedance.recordings.hdf5 import check_heaps
from armimpedance.recordings.mapped.raw_file import check_claim
from armimpedance.recordings.matlab_tree import Leaf, Node, Refused

_DEEPEST: Final = 30
#: Parts of a file that are followed; a session of 10,000 trials with 20 fields has fewer.
_MOST_PARTS: Final = 300_000
_MOST_LETTERS: Final = 1_000_000
#: Groups in which MATLAB keeps what others refer to.
_HIDDEN: Final = ("#refs#", "#subsystem#")
#: Whatever the library raises on a damaged file.
_ERRORS: Final = (
    *(OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError),
    *(OverflowError, MemoryError, UnicodeError, NotImplementedError, SystemError),
)


class Mat73:
    """An open file; its leaves can be read while it is open.

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
        """What the library says of a damaged file, on one line."""
        told = str(error).splitlines()[0][:120] if str(error) else type(error).__name__
        problem = f"is a damaged MATLAB 7.3 file: {told}"
        return InputError(problem, file=self.file, expected="a file as MATLAB saves it")

    def tree(self) -> dict[str, Node]:
        """The variables by name."""
        try:
            return {name: self._member(self.root, name, 0) for name in self._names(self.root)}
        except InputError:
            raise
        except _ERRORS as error:
            raise self.damaged(error) from None

    def _names(self, group: Any) -> list[str]:
        # A link to another file is not followed: it is no part of this one.
        hard = self.h5py.HardLink
        names = [n for n in group if isinstance(n, str) and n not in _HIDDEN]
        return [n for n in names if isinstance(group.get(n, getlink=True), hard)]

    def _member(self, group: Any, name: str, depth: int) -> Node:
        return self._node(group[name], depth, name)

    def _node(self, thing: Any, depth: int, name: str) -> Node:
        self.parts += 1
        if depth > _DEEPEST or self.parts > _MOST_PARTS:
            problem = f"more than {_DEEPEST} levels or {_MOST_PARTS} parts"
            raise InputError(problem, file=self.file, column=name, expected="plain structs")
        kind = _text(thing.attrs.get("MATLAB_class"))
        if "MATLAB_object_decode" in thing.attrs or kind == "function_handle":
            return Refused(f"an object of MATLAB class {kind or 'unknown'}")
        if isinstance(thing, self.h5py.Group):
            return self._struct(thing, depth)
        if not isinstance(thing, self.h5py.Dataset):
            return Refused("no data")
        return self._dataset(thing, kind, depth, name)

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
        """Fields of an array of structs are references that say no class of their own."""
        is_data = isinstance(member, self.h5py.Dataset)
        return is_data and self._holds_references(member) and "MATLAB_class" not in member.attrs

    def _holds_references(self, data: Any) -> bool:
        return bool(self.h5py.check_ref_dtype(data.dtype) == self.h5py.Reference)

    def _referred(self, data: Any, depth: int, name: str) -> list[Node]:
        self._check(data, name)
        if data.size > _MOST_PARTS:
            raise InputError(f"{data.size} parts", file=self.file, column=name, expected="fewer")
        found: list[Node] = []
        # HDF5's order is C, MATLAB's is Fortran: in the file the axes are turned around.
        for reference in np.asarray(data[()]).ravel():
            found.append(self._node(self.root[reference], depth + 1, name) if reference else "")
        return found

    def _dataset(self, data: Any, kind: str, depth: int, name: str) -> Node:
        if data.shape is None or data.attrs.get("MATLAB_empty", 0):
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
        turned = bool(kind)
        shape = data.shape[::-1] if turned else data.shape

        def read() -> np.ndarray[Any, Any]:
            try:
                values = np.asarray(data[()])
            except _ERRORS as error:
                raise self.damaged(error) from None
            return values.T if turned else values

        return Leaf(shape, read)

    def _check(self, data: Any, name: str) -> None:
        check_claim(math.prod(data.shape or (0,)) * max(data.dtype.itemsize, 8), self.file, name)


def _letters(codes: np.ndarray[Any, Any]) -> Node:
    """Texts from their letters' codes, one a row."""
    rows = codes.reshape(1, -1) if codes.ndim < 2 else codes.reshape(codes.shape[0], -1)
    texts = ["".join(map(chr, row.tolist())).rstrip() for row in rows.astype(np.uint16)]
    return texts[0] if len(texts) == 1 else [*texts]


def _text(value: object) -> str:
    return value.decode("ascii", "replace") if isinstance(value, bytes) else str(value or "")
