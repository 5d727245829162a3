"""Kinarm archives (`.kinarm`), the newer exports of Dexterit-E: a folder a trial, a file a channel.

`raw/common/` holds what all trials share, `raw/BB_TT_RR/` a trial: `header.bin`, `parameters.bin`,
`examevents.bin`, and the samples. What comes out is what a C3D file of the same trial gives.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.parameters import (
    C3dParameters,
    Entry,
    Groups,
    plain_text,
)
from armimpedance.recordings.kinarm.exam_file import DEEPEST, ExamFile, ExamStore, Files, Samples

# The binary members of a Kinarm archive (`.kinarm`), byte by byte.
#
# Numbers are little-endian, int32 and float32; every member begins with an int32 version; a text is
# an int32 count of UTF-16 units and twice as many bytes. The maker's own loader takes a first byte
# of 0 as big-endian and says that no such version ever went to a laboratory: it is refused by name.

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

    `frames`: samples of every channel.
    `acknowledgements`: frames of the screen whose time was confirmed (`videoack.bin`).
    `channels`, `positions`: members: `<channel>.kinematics`, `<position>.position`.
    """

    frames: int
    acknowledgements: int
    rate_hz: float
    channels: tuple[str, ...]
    positions: tuple[str, ...]


def read_header(data: bytes, name: str) -> Header:
    """The content of `header.bin`.

    Raises InputError: it is damaged or of an unknown version; as of all functions here.
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
    groups: dict[str, dict[str, Entry]] = {}
    group: dict[str, Entry] | None = None
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


def _value(taken: _Member, label: str) -> Entry:
    code, count = taken.int32(), taken.int32()
    if code == _TEXT:
        return Entry((count,), taken.texts(count))
    if code not in _NUMBERS:
        raise taken.broken(f"the parameter {label} of unknown type {code}")
    with np.errstate(invalid="ignore"):
        numbers = taken.numbers(_NUMBERS[code], count).astype(np.float64)
    return Entry((count,), numbers=numbers)


def read_events(data: bytes, name: str) -> dict[str, Entry]:
    """The content of `examevents.bin` as the group EVENTS of a C3D file has it."""
    taken = _Member(data, name, VERSIONS)
    count = taken.count(taken.int32(), 12)
    labels, times = [], np.zeros(count)
    for i in range(count):
        labels.append(taken.text())
        taken.text()
        times[i] = taken.numbers("<f4", 1)[0]
    return {
        "LABELS": Entry((count,), tuple(labels)),
        "TIMES": Entry((count,), numbers=times),
        "USED": Entry((), numbers=np.array([float(count)])),
    }


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


_SHARED: Final = re.compile(r"((?:.*/)?)common/(?:parameters|header)\.bin")
_TRIAL: Final = re.compile(r"(\d+)_(\d+)_(\d+)")

#: Labels stand at the beginning of a member.
_LABEL_BYTES: Final = 2048

#: Larger than what any exam says of itself; its samples are in other members.
_LARGEST_BIN: Final = 2 * 1024**2


def archive_roots(files: Files) -> set[str]:
    """The folders that hold a `common/`, with their slashes, those of an analysis aside."""
    found = {match[1] for name in files if (match := _SHARED.fullmatch(name))}
    return {
        root
        for root in found
        if root.count("/") <= DEEPEST and "analysis" not in root.lower().split("/")
    }


@dataclass
class Archive:
    """The folders of an archive's trials.

    `path`: for messages.
    `files`: see `packing`.
    `root`: the folder of `common/` and of the trials, with its slash.
    `wanted`: which channels are read, by their labels.
    `store`: where the samples are kept.
    """

    path: object
    files: Files
    root: str
    wanted: Callable[[str], bool]
    store: ExamStore = field(default_factory=ExamStore)
    _labels: dict[str, str] = field(default_factory=dict)

    def trials(self) -> Iterator[tuple[str, tuple[int, int, int]]]:
        """The folders of the trials, sorted, each with block, protocol and repetition."""
        names = {n[len(self.root) :].split("/")[0] for n in self.files if n.startswith(self.root)}
        for name in sorted(names):
            match = _TRIAL.fullmatch(name)
            if match:
                block, protocol, repetition = (int(part) for part in match.groups())
                yield name, (block, protocol, repetition)

    def common(self) -> ExamFile:
        """What all trials share.

        Raises InputError: it is missing or damaged.
        """
        if f"{self.root}common/header.bin" in self.files:
            self._header("common")
        return ExamFile(
            f"{self.path}:{self.root}common",
            C3dParameters(self._parameters("common")),
            *(0.0, 0, {}, {}),
        )

    def trial(self, folder: str) -> ExamFile:
        """One trial, with those of its channels that are wanted.

        Raises InputError: one of the members that are needed is missing or damaged.
        """
        header = self._header(folder)
        parameters = self._parameters(folder)
        if f"{self.root}{folder}/examevents.bin" in self.files:
            events = read_events(*self._member(folder, "examevents.bin"))
            # The events stand here; a group of that name in the parameters is an older one.
            parameters = {**parameters, "EVENTS": events}
        channels, others = self._channels(folder, header)
        return ExamFile(
            name=f"{self.path}:{self.root}{folder}",
            parameters=C3dParameters(parameters),
            rate_hz=header.rate_hz,
            frames=header.frames,
            hands=self._hands(folder, header),
            channels=channels,
            others=others,
            acknowledgements=header.acknowledgements,
        )

    def _member(self, folder: str, name: str, size: int | None = None) -> tuple[bytes, str]:
        """The bytes of a member, and its place for messages."""
        place = f"{self.root}{folder}/{name}"
        told = f"{self.path}:{place}"
        if place not in self.files:
            raise InputError("no such member", file=told, expected="a whole archive")
        is_bin = name.endswith(".bin")
        data = self.files[place](_LARGEST_BIN + 1 if is_bin else size)
        if is_bin and len(data) > _LARGEST_BIN:
            problem = f"is larger than {_LARGEST_BIN / 1024**2:g} MiB"
            raise InputError(problem, file=told, expected="a header, parameters or events")
        return data, told

    def _header(self, folder: str) -> Header:
        return read_header(*self._member(folder, "header.bin"))

    def _parameters(self, folder: str) -> Groups:
        return read_parameters(*self._member(folder, "parameters.bin"))

    def _label(self, folder: str, channel: str) -> str:
        """The label of a channel, which stands in its member; looked up once in an exam."""
        if channel not in self._labels:
            try:
                label = read_label(*self._member(folder, f"{channel}.kinematics", _LABEL_BYTES))
            except InputError:
                # Whether it is damaged is seen where it is read, if it is.
                return channel
            self._labels[channel] = label or channel
        return self._labels[channel]

    def _channels(
        self, folder: str, header: Header
    ) -> tuple[Mapping[str, Samples], tuple[str, ...]]:
        """The channels that are wanted, and the labels of the others."""
        channels: dict[str, Samples] = {}
        others = []
        for name in header.channels if header.frames else ():
            label = self._label(folder, name)
            if not self.wanted(label):
                others.append(label)
            elif label not in channels:
                own, samples = read_samples(*self._member(folder, f"{name}.kinematics"))
                if self._all_there(folder, own or name, len(samples), header):
                    channels[own or name] = self.store.keep(own or name, samples)
        return channels, tuple(others)

    def _hands(self, folder: str, header: Header) -> Mapping[str, Samples]:
        hands: dict[str, Samples] = {}
        for name in header.positions if header.frames else ():
            side = next((s for s in ("Right", "Left") if name.startswith(s)), None)
            if side is not None and f"{side}_Hand" not in hands:
                places = read_positions(*self._member(folder, f"{name}.position"))
                if self._all_there(folder, name, len(places), header):
                    hands[f"{side}_Hand"] = self.store.keep(name, places)
        return hands

    def _all_there(self, folder: str, label: str, count: int, header: Header) -> bool:
        """Whether a channel was recorded: all of it, or (False) nothing.

        Raises InputError: a part of it is missing.
        """
        if count not in (0, header.frames):
            raise InputError(
                f"{count} samples, where the header says {header.frames}",
                file=f"{self.path}:{self.root}{folder}",
                column=label,
                expected="as many as the trial has frames",
            )
        return count > 0
