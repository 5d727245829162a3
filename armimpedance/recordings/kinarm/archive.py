"""Kinarm archives (`.kinarm`), the newer exports of Dexterit-E.

An archive has a folder per trial and a file per channel. `raw/common/` holds data common to all
trials, `raw/BB_TT_RR/` a trial: `header.bin`, `parameters.bin`, `examevents.bin`, and the samples.
The result is the same as from a C3D file of the trial.
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
# an int32 count of UTF-16 units and twice as many bytes. For the maker's own loader a first byte of
# 0 means big-endian, with a remark that this version was never distributed: it is refused.

#: Known versions of headers, parameters and events, and of samples.
VERSIONS: Final = (2, 3)
SAMPLE_VERSIONS: Final = (1,)

#: Most samples of a trial: a day at 10 kHz, longer than any exam.
MOST_FRAMES: Final = 864_000_000

_TEXT: Final = 0
#: Types of numbers in the parameters: code -> numpy type.
_NUMBERS: Final = {1: "u1", 2: "<i4", 3: "<f4"}


@dataclass(frozen=True)
class Header:
    """Content of a trial's `header.bin`.

    `frames`: number of samples of every channel.
    `acknowledgements`: number of screen frames whose time was confirmed (`videoack.bin`).
    `channels`, `positions`: names of the members `<channel>.kinematics`, `<position>.position`.
    """

    frames: int
    acknowledgements: int
    rate_hz: float
    channels: tuple[str, ...]
    positions: tuple[str, ...]


def read_header(data: bytes, name: str) -> Header:
    """Read the content of `header.bin`.

    Raises InputError: it is damaged or of an unknown version, as for all readers in this module.
    """
    member = _Member(data, name, VERSIONS)
    frames, channels, positions, _, acknowledgements = (member.int32() for _ in range(5))
    rate_hz = float(member.numbers("<f4", 1)[0])
    member.text()
    if not 0 <= frames <= MOST_FRAMES:
        raise member.broken(f"{frames} frames")
    if frames and not (np.isfinite(rate_hz) and rate_hz > 0):
        raise member.broken(f"a rate of {rate_hz} frames/s")
    return Header(
        frames, acknowledgements, rate_hz, member.texts(channels), member.texts(positions)
    )


def read_parameters(data: bytes, name: str) -> Groups:
    """Read `parameters.bin`: group -> name -> texts or numbers, names in capitals."""
    member = _Member(data, name, VERSIONS)
    groups: dict[str, dict[str, Entry]] = {}
    group: dict[str, Entry] | None = None
    while member.left:
        kind = member.int32()
        if kind == 0:
            break
        if kind not in (1, 2):
            raise member.broken(f"a record of unknown type {kind}")
        label, _ = member.text().upper(), member.text()
        if kind == 1:
            group = groups.setdefault(label, {})
        elif group is None:
            raise member.broken(f"the parameter {label} before any group")
        else:
            group[label] = _value(member, label)
    return groups


def _value(member: _Member, label: str) -> Entry:
    code, count = member.int32(), member.int32()
    if code == _TEXT:
        return Entry((count,), member.texts(count))
    if code not in _NUMBERS:
        raise member.broken(f"the parameter {label} of unknown type {code}")
    with np.errstate(invalid="ignore"):
        numbers = member.numbers(_NUMBERS[code], count).astype(np.float64)
    return Entry((count,), numbers=numbers)


def read_events(data: bytes, name: str) -> dict[str, Entry]:
    """Read `examevents.bin` in the form of the group EVENTS of a C3D file."""
    member = _Member(data, name, VERSIONS)
    count = member.count(member.int32(), 12)
    labels, times = [], np.zeros(count)
    for i in range(count):
        labels.append(member.text())
        member.text()
        times[i] = member.numbers("<f4", 1)[0]
    return {
        "LABELS": Entry((count,), tuple(labels)),
        "TIMES": Entry((count,), numbers=times),
        "USED": Entry((), numbers=np.array([float(count)])),
    }


def read_label(data: bytes, name: str) -> str:
    """Read the label of a channel from the first bytes of its member."""
    return _Member(data, name, SAMPLE_VERSIONS).text()


def read_samples(data: bytes, name: str) -> tuple[str, NDArray[np.float32]]:
    """Read label and samples (n,) of a member `.kinematics`."""
    member = _Member(data, name, SAMPLE_VERSIONS)
    label, _, _ = member.text(), member.text(), member.text()
    return label, member.numbers("<f4", member.int32())


def read_positions(data: bytes, name: str) -> NDArray[np.float32]:
    """Read the positions (n, 2), m, of a member `.position`."""
    member = _Member(data, name, SAMPLE_VERSIONS)
    member.text(), member.text()
    count = member.count(member.int32(), 8)
    return member.numbers("<f4", 2 * count).reshape(count, 2)


class _Member:
    """Reader of a member's bytes; counts are checked before anything is read or allocated."""

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
        """Number of bytes that are not read yet."""
        return len(self.data) - self.at

    def int32(self) -> int:
        return int.from_bytes(self._take(4), "little", signed=True)

    def count(self, claimed: int, size: int) -> int:
        """Check that `claimed` entries of at least `size` bytes each are in the member."""
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
        """Read numbers, as a view of the member."""
        dtype = np.dtype(kind)
        count = self.count(claimed, dtype.itemsize)
        return np.frombuffer(self._take(count * dtype.itemsize), dtype)

    def _take(self, size: int) -> bytes:
        if size > self.left:
            raise self.broken(f"cut off after {len(self.data)} bytes")
        part = self.data[self.at : self.at + size]
        self.at += size
        return part

    def broken(self, problem: str) -> InputError:
        return InputError(f"damaged: {problem}", file=self.name, expected="a whole archive")


_SHARED: Final = re.compile(r"((?:.*/)?)common/(?:parameters|header)\.bin")
_TRIAL: Final = re.compile(r"(\d+)_(\d+)_(\d+)")

#: Bytes at the beginning of a member that hold its label.
_LABEL_BYTES: Final = 2048

#: Largest header, parameters or events, bytes; samples are in other members.
_LARGEST_BIN: Final = 2 * 1024**2


def archive_roots(files: Files) -> set[str]:
    """Folders that hold a `common/`, with a final slash, except folders of an analysis."""
    roots = {match[1] for name in files if (match := _SHARED.fullmatch(name))}
    return {
        root
        for root in roots
        if root.count("/") <= DEEPEST and "analysis" not in root.lower().split("/")
    }


@dataclass
class Archive:
    """Trials of an archive.

    `path`: path of the archive, for messages.
    `files`: see `exam_file.Files`.
    `root`: the folder of `common/` and of the trials, with a final slash.
    `wanted`: function of a channel's label: True if the channel is read.
    `store`: memory for the samples.
    """

    path: object
    files: Files
    root: str
    wanted: Callable[[str], bool]
    store: ExamStore = field(default_factory=ExamStore)
    _labels: dict[str, str] = field(default_factory=dict)

    def trials(self) -> Iterator[tuple[str, tuple[int, int, int]]]:
        """Yield the folders of the trials, sorted, each with block, protocol and repetition."""
        names = {n[len(self.root) :].split("/")[0] for n in self.files if n.startswith(self.root)}
        for name in sorted(names):
            match = _TRIAL.fullmatch(name)
            if match:
                block, protocol, repetition = (int(part) for part in match.groups())
                yield name, (block, protocol, repetition)

    def common(self) -> ExamFile:
        """Read the data common to all trials.

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
        """Read one trial, with the wanted channels.

        Raises InputError: a member that is needed is missing or damaged.
        """
        header = self._header(folder)
        parameters = self._parameters(folder)
        if f"{self.root}{folder}/examevents.bin" in self.files:
            events = read_events(*self._member(folder, "examevents.bin"))
            # the current events; a group of this name in the parameters is older
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
        """Read the bytes of a member; return them and its name for messages."""
        member_path = f"{self.root}{folder}/{name}"
        full_name = f"{self.path}:{member_path}"
        if member_path not in self.files:
            raise InputError("no such member", file=full_name, expected="a whole archive")
        is_bin = name.endswith(".bin")
        data = self.files[member_path](_LARGEST_BIN + 1 if is_bin else size)
        if is_bin and len(data) > _LARGEST_BIN:
            problem = f"is larger than {_LARGEST_BIN / 1024**2:g} MiB"
            raise InputError(problem, file=full_name, expected="a header, parameters or events")
        return data, full_name

    def _header(self, folder: str) -> Header:
        return read_header(*self._member(folder, "header.bin"))

    def _parameters(self, folder: str) -> Groups:
        return read_parameters(*self._member(folder, "parameters.bin"))

    def _label(self, folder: str, channel: str) -> str:
        """Return the label of a channel, which its member holds; read once per exam."""
        if channel not in self._labels:
            try:
                label = read_label(*self._member(folder, f"{channel}.kinematics", _LABEL_BYTES))
            except InputError:
                # a damaged member is reported when its samples are read
                return channel
            self._labels[channel] = label or channel
        return self._labels[channel]

    def _channels(
        self, folder: str, header: Header
    ) -> tuple[Mapping[str, Samples], tuple[str, ...]]:
        """Read the wanted channels; return them and the labels of the others."""
        channels: dict[str, Samples] = {}
        others = []
        for name in header.channels if header.frames else ():
            label = self._label(folder, name)
            if not self.wanted(label):
                others.append(label)
            elif label not in channels:
                stored_label, samples = read_samples(*self._member(folder, f"{name}.kinematics"))
                if self._all_there(folder, stored_label or name, len(samples), header):
                    channels[stored_label or name] = self.store.keep(stored_label or name, samples)
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
        """True if a channel was recorded completely, False if it has no samples.

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
