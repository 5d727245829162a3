"""The parameter section of a C3D file: named texts and numbers in groups."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError

_LITTLE_ENDIAN: Final = 84

#: Types of parameters in a C3D file: code -> numpy type.
_TYPES: Final = {-1: "S1", 1: "u1", 2: "<i2", 4: "<f4"}

#: A parameter: texts, or numbers in the order of the file.
Parameter = tuple[str, ...] | NDArray[np.generic]

#: Group -> name -> parameter, all names in capitals.
Groups = Mapping[str, Mapping[str, Parameter]]


def read_groups(data: bytes, name: str, start: int) -> Groups:
    """The parameters of a C3D file.

    Parameters
    ----------
    data : bytes
        The whole file.
    name : str
        The file's name, for messages.
    start : int
        Position at which the section begins.

    Raises
    ------
    InputError
        The section is broken, or is not of a little-endian file.
    """
    return _Section(data, name, start).parse()


class _Section:
    """The parameter section; every read is checked against the end of the file."""

    def __init__(self, data: bytes, name: str, start: int) -> None:
        self.data, self.name, self.at = data, name, start

    def parse(self) -> Groups:
        processor = self._take(4)[3]
        if processor != _LITTLE_ENDIAN:
            expected = f"{_LITTLE_ENDIAN}, little-endian"
            raise InputError(f"processor type {processor}", file=self.name, expected=expected)
        groups: dict[int, str] = {}
        entries: list[tuple[int, str, Parameter]] = []
        while self.at + 2 <= len(self.data):
            length, group = struct.unpack("<bb", self._take(2))
            if length == 0:
                break
            # A negative length locks the entry against editing: of no meaning to a reader.
            label = _decoded(self._take(abs(length))).upper()
            next_entry = self.at + struct.unpack("<H", self._peek(2))[0]
            is_last = next_entry == self.at
            self.at += 2
            if group < 0:
                groups[-group] = label
                self._take(self._take(1)[0])
            else:
                entries.append((group, label, self._value()))
            if is_last:
                break
            if next_entry < self.at:
                raise self._broken(f"the entry {label} points back into itself")
            self.at = next_entry
        parameters: dict[str, dict[str, Parameter]] = {label: {} for label in groups.values()}
        for group, label, value in entries:
            parameters.setdefault(groups.get(group, f"GROUP{group}"), {})[label] = value
        return parameters

    def _value(self) -> Parameter:
        code, dimensions = struct.unpack("<bB", self._take(2))
        if code not in _TYPES:
            raise self._broken(f"a parameter of unknown type {code}")
        sizes = tuple(self._take(dimensions))
        kind = np.dtype(_TYPES[code])
        count = int(np.prod(sizes, dtype=np.int64))
        raw = self._take(count * kind.itemsize)
        if code != -1:
            return np.frombuffer(raw, kind).copy()
        # The first dimension is a text's length; without a second one there is one text.
        width = sizes[0] if sizes else 1
        starts = range(0, count, width) if width else ()
        return tuple(_decoded(raw[i : i + width]) for i in starts)

    def _peek(self, size: int) -> bytes:
        if self.at + size > len(self.data):
            raise self._broken("the parameters run past the end of the file")
        return self.data[self.at : self.at + size]

    def _take(self, size: int) -> bytes:
        taken = self._peek(size)
        self.at += size
        return taken

    def _broken(self, problem: str) -> InputError:
        return InputError(f"broken parameter section: {problem}", file=self.name)


class HasParameters:
    """Reading from the parameters that a file holds, in its field `parameters`."""

    parameters: Groups

    def text(self, group: str, name: str) -> str | None:
        """A parameter that is one text, or None."""
        texts = self.texts(group, name)
        return texts[0] if texts else None

    def texts(self, group: str, name: str) -> tuple[str, ...]:
        """A parameter that holds texts; empty where there is none."""
        return texts_of(self.parameters, group, name)

    def numbers(self, group: str, name: str) -> FloatArray | None:
        """A parameter that holds numbers, as a flat array; None where there is none."""
        return numbers_of(self.parameters, group, name)

    def number(self, group: str, name: str) -> float | None:
        """A parameter's first number; None where there is none, or it is not finite."""
        values = self.numbers(group, name)
        if values is None or not len(values) or not np.isfinite(values[0]):
            return None
        return float(values[0])


def texts_of(parameters: Groups, group: str, name: str) -> tuple[str, ...]:
    """A parameter that holds texts; empty where there is none."""
    value = parameters.get(group, {}).get(name)
    return value if isinstance(value, tuple) else ()


def numbers_of(parameters: Groups, group: str, name: str) -> FloatArray | None:
    """A parameter that holds numbers, as a flat array; None where there is none."""
    value = parameters.get(group, {}).get(name)
    # A damaged file may hold numbers that are none; whoever needs them says so.
    with np.errstate(invalid="ignore"):
        return value.astype(np.float64) if isinstance(value, np.ndarray) else None


def first_of(parameters: Groups, group: str, name: str, default: float) -> float:
    """A parameter's first number, or the default where there is none."""
    values = numbers_of(parameters, group, name)
    return default if values is None or not len(values) else float(values[0])


def _decoded(raw: bytes) -> str:
    return plain_text(raw.decode("utf-8", errors="replace"))


def plain_text(text: str) -> str:
    """A text of a file without its filling, on one line: labels stand in messages."""
    return "".join(m if m.isprintable() else "?" for m in text.rstrip("\x00 ").lstrip())
