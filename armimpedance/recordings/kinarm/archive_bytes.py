"""The binary members of a Kinarm archive (`.kinarm`), byte by byte.

Numbers are little-endian, int32 and float32; every member begins with an int32 version; a text is
an int32 count of UTF-16 units and twice as many bytes. The maker's own loader takes a first byte of
0 as big-endian and says that no such version ever went to a laboratory: it is refused by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d_parameters import Groups, Parameter, plain_text

#: Versions of headers, parameters and events; those of samples.
VERSIONS: Final = (2, 3)
SAMPLE_VERSIONS: Final = (1,)

#: Longer than any exam: a day at 10 kHz.
MOST_FRAMES: Final = 864_000_000

_TEXT: Final = 0
#: Types of numbers in the parameters: code -> numpy type.
_NUMBERS: Final = {1: "u1", 2: "<i4", 3: "<f4"}


@dataclass(frozen=True)
class Header:
    """What `header.bin` says of a trial.

    Attributes
    ----------
    frames : int
        Samples of every channel.
    acknowledgements : int
        Frames of the screen whose time was confirmed (`videoack.bin`).
    rate_hz : float
    channels, positions : tuple of str
        Members: `<channel>.kinematics`, `<position>.position`.
    """

    frames: int
    acknowledgements: int
    rate_hz: float
    channels: tuple[str, ...]
    positions: tuple[str, ...]


def read_header(data: bytes, name: str) -> Header:
    """The content of `header.bin`.

    Raises
    ------
    InputError
        It is damaged or of an unknown version; as of all functions here.
    """
    taken = _Member(data, name, VERSIONS)
    frames, channels, positions, _, acknowledgements = (taken.int32() for _ in range(5))
    rate_hz = float(taken.numbers("<f4", 1)[0])
    taken.text()
    if not 0 <= frames <= MOST_FRAMES:
        raise taken.broken(f"{frames} frames")
    if frames and not (np.isfinite(rate_hz) and rate_hz > 0):
        raise taken.broken(f"a rate of {rate_hz} frames/s")
    return Header(frames, acknowledgements, rate_hz, taken.texts(channels), taken.texts(positions))


def read_parameters(data: bytes, name: str) -> Groups:
    """The content of `parameters.bin`: group -> name -> texts or numbers, names in capitals."""
    taken = _Member(data, name, VERSIONS)
    groups: dict[str, dict[str, Parameter]] = {}
    group: dict[str, Parameter] | None = None
    while taken.left:
        kind = taken.int32()
        if kind == 0:
            break
        if kind not in (1, 2):
            raise taken.broken(f"a record of unknown type {kind}")
        label, _ = taken.text().upper(), taken.text()
        if kind == 1:
            group = groups.setdefault(label, {})
        elif group is None:
            raise taken.broken(f"the parameter {label} before any group")
        else:
            group[label] = _value(taken, label)
    return groups


def _value(taken: _Member, label: str) -> Parameter:
    code, count = taken.int32(), taken.int32()
    if code == _TEXT:
        return taken.texts(count)
    if code not in _NUMBERS:
        raise taken.broken(f"the parameter {label} of unknown type {code}")
    return taken.numbers(_NUMBERS[code], count).copy()


def read_events(data: bytes, name: str) -> dict[str, Parameter]:
    """The content of `examevents.bin` as the group EVENTS of a C3D file has it."""
    taken = _Member(data, name, VERSIONS)
    count = taken.count(taken.int32(), 12)
    labels, times = [], np.zeros(count, dtype=np.float32)
    for i in range(count):
        labels.append(taken.text())
        taken.text()
        times[i] = taken.numbers("<f4", 1)[0]
    return {"LABELS": tuple(labels), "TIMES": times, "USED": np.array([count])}


def read_label(data: bytes, name: str) -> str:
    """The label of a channel from the first bytes of its member."""
    return _Member(data, name, SAMPLE_VERSIONS).text()


def read_samples(data: bytes, name: str) -> tuple[str, NDArray[np.float32]]:
    """Label and samples, (n,), of a member `.kinematics`."""
    taken = _Member(data, name, SAMPLE_VERSIONS)
    label, _, _ = taken.text(), taken.text(), taken.text()
    return label, taken.numbers("<f4", taken.int32())


def read_positions(data: bytes, name: str) -> NDArray[np.float32]:
    """Places, (n, 2) in m, of a member `.position`."""
    taken = _Member(data, name, SAMPLE_VERSIONS)
    taken.text(), taken.text()
    count = taken.count(taken.int32(), 8)
    return taken.numbers("<f4", 2 * count).reshape(count, 2)


class _Member:
    """The bytes of a member; nothing is taken, and no space for it, that is not there."""

    def __init__(self, data: bytes, name: str, versions: tuple[int, ...]) -> None:
        self.data, self.name, self.at = data, name, 0
        if data[:1] == b"\x00":
            raise InputError(
                "is big-endian, as no version was that was ever given out",
                file=name,
                expected="a version number in the first byte",
            )
        version = self.int32()
        if version not in versions:
            known = " or ".join(map(str, versions))
            raise InputError(
                f"version {version} is not known",
                file=name,
                expected=f"version {known}: export the exam as C3D files, and report it",
            )

    @property
    def left(self) -> int:
        """Bytes that are not taken yet."""
        return len(self.data) - self.at

    def int32(self) -> int:
        return int.from_bytes(self._take(4), "little", signed=True)

    def count(self, claimed: int, size: int) -> int:
        """A number of things of at least so many bytes each, which must be there."""
        if not 0 <= claimed * size <= self.left:
            raise self.broken(f"{claimed} entries of {size} bytes in {self.left} bytes")
        return claimed

    def text(self) -> str:
        units = self.count(self.int32(), 2)
        if not units:
            return ""
        return plain_text(self._take(2 * units).decode("utf-16-le", errors="replace"))

    def texts(self, claimed: int) -> tuple[str, ...]:
        return tuple(self.text() for _ in range(self.count(claimed, 4)))

    def numbers(self, kind: str, claimed: int) -> NDArray[Any]:
        """So many numbers, a view of the member."""
        dtype = np.dtype(kind)
        count = self.count(claimed, dtype.itemsize)
        return np.frombuffer(self._take(count * dtype.itemsize), dtype)

    def _take(self, size: int) -> bytes:
        if size > self.left:
            raise self.broken(f"cut off after {len(self.data)} bytes")
        taken = self.data[self.at : self.at + size]
        self.at += size
        return taken

    def broken(self, problem: str) -> InputError:
        return InputError(f"damaged: {problem}", file=self.name, expected="a whole archive")
