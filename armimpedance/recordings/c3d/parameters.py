"""Parameter section of a C3D file of any processor: texts and numbers with their sizes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, shown

# Number formats of the three processors that wrote C3D files: Intel, DEC (VAX), MIPS (SGI).

#: A VAX exponent has offset 128 and a mantissa of 1/2 to 1: read as IEEE, a number is 4 times too
#: large.
_VAX_FACTOR: Final = 0.25


@dataclass(frozen=True)
class Processor:
    """Byte order and format of real numbers.

    `order`: byte order of integers, and of reals in IEEE format.
    `vax`: True if reals are in DEC's F_floating.
    """

    name: str
    order: Literal["<", ">"]
    vax: bool = False

    def dtype(self, kind: Literal["i2", "u2", "f4"]) -> np.dtype:
        """Numpy type of stored words; DEC's reals must be decoded."""
        return np.dtype(f"{self.order}{'u4' if self.vax and kind == 'f4' else kind}")

    def decoded(self, words: NDArray[np.generic]) -> FloatArray:
        """Decode stored words of `dtype` to numbers."""
        if not (self.vax and words.dtype.kind == "u" and words.dtype.itemsize == 4):
            with np.errstate(invalid="ignore"):
                return words.astype(np.float64)
        # the halves of a VAX number are swapped
        stored = words.view(np.uint32)
        bits = (stored << np.uint32(16)) | (stored >> np.uint32(16))
        exponent = (bits >> np.uint32(23)) & np.uint32(0xFF)
        largest = exponent == 0xFF
        # this exponent is a number on a VAX but not in IEEE: one less, and twice the value
        safe = np.where(largest, bits - np.uint32(1 << 23), bits).astype(np.uint32)
        values = safe.view(np.float32).astype(np.float64) * _VAX_FACTOR
        values[largest] *= 2.0
        values[exponent == 0] = 0.0
        # a sign with exponent 0 is the VAX's "reserved operand", not a number
        values[(exponent == 0) & (bits >> np.uint32(31) == 1)] = np.nan
        return values


#: The code in the parameter section's fourth byte -> processor.
INTEL: Final = Processor("Intel", "<")
PROCESSORS: Final = {
    84: INTEL,
    85: Processor("DEC", "<", vax=True),
    86: Processor("MIPS", ">"),
}

#: Bytes per value of each type: text, byte, integer, real.
_BYTES: Final = {-1: 1, 1: 1, 2: 2, 4: 4}
_DIMENSIONS: Final = 7
_ENTRIES: Final = 20_000


@dataclass(frozen=True)
class Entry:
    """One parameter: texts or numbers.

    `sizes`: its dimensions; for texts without the first one, their length.
    `numbers` (n,): in the order of the file: the first dimension varies fastest.
    """

    sizes: tuple[int, ...]
    texts: tuple[str, ...] = ()
    numbers: FloatArray = field(default_factory=lambda: np.zeros(0))


#: Group -> name -> parameter, all names in capitals.
Groups = Mapping[str, Mapping[str, Entry]]


@dataclass(frozen=True)
class C3dParameters:
    """All parameters of a file, by group and name in capitals.

    A Kinarm archive, which is not a C3D file, has the same groups.
    """

    groups: Groups
    processor: Processor = INTEL

    def entry(self, group: str, name: str) -> Entry | None:
        """Return a parameter, or None."""
        return self.groups.get(group, {}).get(name)

    def texts(self, group: str, name: str) -> tuple[str, ...]:
        """Texts of a parameter and of its continuations: `LABELS`, `LABELS2`, …"""
        texts: list[str] = []
        for number in range(1, 100):
            entry = self.entry(group, name if number == 1 else f"{name}{number}")
            if entry is None:
                break
            texts += entry.texts
        return tuple(texts)

    def numbers(self, group: str, name: str) -> FloatArray:
        """Numbers of a parameter and of its continuations; empty if there is none."""
        parts = [np.zeros(0)]
        for number in range(1, 100):
            entry = self.entry(group, name if number == 1 else f"{name}{number}")
            if entry is None:
                break
            parts.append(entry.numbers)
        return np.concatenate(parts)

    def first(self, group: str, name: str, default: float) -> float:
        """First number of a parameter, or the default if there is none."""
        entry = self.entry(group, name)
        return default if entry is None or not len(entry.numbers) else float(entry.numbers[0])

    def number(self, group: str, name: str) -> float | None:
        """First number of a parameter; None if there is none, or it is not finite."""
        value = self.first(group, name, math.nan)
        return value if math.isfinite(value) else None

    def text(self, group: str, name: str) -> str:
        """First text of a parameter; empty if there is none."""
        return next(iter(self.texts(group, name)), "")


def read_parameters(data: bytes, name: str, start: int) -> C3dParameters:
    """Read the parameter section of a C3D file.

    Parameters
    ----------
    data : bytes
        The whole file.
    name : str
        The file's name, for messages.
    start : int
        Position at which the section begins.

    Raises InputError: the section is broken, or names no processor.
    """
    return _Section(data, name, start).parse()


class _Section:
    """Reader of the section; every read is checked against the end of the file."""

    def __init__(self, data: bytes, name: str, start: int) -> None:
        self.data, self.name, self.at = data, name, start

    def parse(self) -> C3dParameters:
        code = self._take(4)[3]
        if code not in PROCESSORS:
            expected = "84 (Intel), 85 (DEC) or 86 (MIPS)"
            raise InputError(f"processor type {code}", file=self.name, expected=expected)
        self.processor = PROCESSORS[code]
        # the section's own count of blocks may be wrong; the data come after the section
        data_block = int(np.frombuffer(self.data, self.processor.dtype("u2"), 9)[8])
        self.end = max(self.at - 4 + 512 * self.data[self.at - 2], 512 * (data_block - 1))
        groups: dict[int, str] = {}
        entries: list[tuple[int, str, Entry]] = []
        for _ in range(_ENTRIES):
            if self.at + 2 > len(self.data) or not self._entry(groups, entries):
                break
        named: dict[str, dict[str, Entry]] = {label: {} for label in groups.values()}
        for group, label, entry in entries:
            named.setdefault(groups.get(group, f"GROUP{group}"), {})[label] = entry
        return C3dParameters(named, self.processor)

    def _entry(self, groups: dict[int, str], entries: list[tuple[int, str, Entry]]) -> bool:
        """Read a group or parameter; return whether another one may follow."""
        length, group = np.frombuffer(self._take(2), np.int8).tolist()
        if length == 0:
            return False
        # a negative length locks the entry against editing, which does not matter here
        label = _decoded(self._take(abs(length))).upper()
        step = int(self._numbers("u2", self._peek(2))[0])
        following = self.at + step
        self.at += 2
        if group < 0:
            groups[-group] = label
            self._take(self._take(1)[0])
        else:
            entries.append((group, label, self._value()))
        if step and following < self.at:
            # a wrong pointer: the end follows from the entry's own content
            following = self._described()
        # some programs leave an arbitrary last pointer, with only zeros after it
        stays = following < self.end or any(self.data[self._described() : self.end])
        self.at = following
        return bool(step) and stays

    def _described(self) -> int:
        """Position after the description of the entry whose content was read."""
        return self.at + 1 + self.data[self.at] if self.at < len(self.data) else self.at

    def _value(self) -> Entry:
        code, dimensions = self._take(2)
        kind = code - 256 if code > 127 else code
        if kind not in _BYTES:
            raise self._broken(f"a parameter of unknown type {kind}")
        if dimensions > _DIMENSIONS:
            raise self._broken(f"a parameter of {dimensions} dimensions")
        sizes = tuple(self._take(dimensions))
        raw = self._take(math.prod(sizes) * _BYTES[kind])
        if kind == -1:
            # without a second dimension there is one text
            width = sizes[0] if sizes else 1
            starts = range(0, len(raw), width) if width else ()
            texts = tuple(_decoded(raw[i : i + width]) for i in starts)
            return Entry(sizes[1:], texts)
        if kind == 1:
            return Entry(sizes, (), np.frombuffer(raw, np.uint8).astype(np.float64))
        return Entry(sizes, (), self._numbers("i2" if kind == 2 else "f4", raw))

    def _numbers(self, kind: str, raw: bytes) -> FloatArray:
        words: NDArray[np.generic] = np.frombuffer(raw, self.processor.dtype(kind))  # type: ignore[arg-type]
        return self.processor.decoded(words)

    def _peek(self, size: int) -> bytes:
        if self.at + size > len(self.data):
            raise self._broken("the parameters run past the end of the file")
        return self.data[self.at : self.at + size]

    def _take(self, size: int) -> bytes:
        raw = self._peek(size)
        self.at += size
        return raw

    def _broken(self, problem: str) -> InputError:
        return InputError(f"broken parameter section: {problem}", file=self.name)


def _decoded(raw: bytes) -> str:
    return plain_text(raw.decode("utf-8", errors="replace"))


def plain_text(text: str) -> str:
    """Return a text without its padding, on one printable line, as labels appear in messages."""
    return shown(text.rstrip("\x00 ").lstrip())
