"""Files of a Kinarm exam in a folder, a zip or an archive, and the content of one file."""

from __future__ import annotations

import mmap
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d.c3d_file import C3dFile
from armimpedance.recordings.c3d.parameters import C3dParameters

#: Channels of status bits (32), which the files store as if they were numbers.
STATUS_WORD: Final = re.compile(r"(Right|Left)_FS_Status")

#: Memory that is mapped for a channel at once: 17 minutes at 1 kHz.
ROOM_BYTES: Final = 4 * 1024**2

#: Samples in memory: single precision if that is exact, as for the numbers in the files.
Samples = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class ExamFile:
    """A trial of an exam, or the data common to all trials.

    `name`: the file's name, for messages.
    `rate_hz`: samples per second.
    `frames`: number of samples F of every channel.
    `hands`: such as `Right_Hand` -> places (F, 2) in m.
    `channels`: label -> samples (F,) in the unit of the file, for the requested channels.
    `others`: labels of the channels that were not read.
    `acknowledgements`: number of screen frames with a time at which they were shown.
    """

    name: str
    parameters: C3dParameters
    rate_hz: float
    frames: int
    hands: Mapping[str, Samples]
    channels: Mapping[str, Samples]
    others: tuple[str, ...] = ()
    acknowledgements: int = 0

    def samples(self, label: str) -> FloatArray:
        """Return one channel (F,) in double precision; a status word as an integer value."""
        values = self.channels[label]
        if STATUS_WORD.fullmatch(label) and values.dtype == np.float32:
            values = np.ascontiguousarray(values).view(np.uint32)
        return _doubled(values)

    def columns(self, labels: Iterable[str]) -> FloatArray:
        """Return channels as columns (F, number of labels), finite or not."""
        return np.column_stack([self.samples(label) for label in labels])

    def place(self, hand: str) -> FloatArray:
        """Return the position of a hand (F, 2), m."""
        return _doubled(self.hands[hand])

    def without(self, labels: Container[str]) -> ExamFile:
        """Return a copy without these channels and hands."""
        channels, hands = (
            {name: samples for name, samples in group.items() if name not in labels}
            for group in (self.channels, self.hands)
        )
        return replace(self, channels=channels, hands=hands)

    def same_samples(self, other: ExamFile) -> bool:
        """Return True if all channels that were read hold the same numbers."""
        same = self.channels.keys() == other.channels.keys()
        return same and all(
            np.array_equal(self.samples(label), other.samples(label)) for label in self.channels
        )


def joined(frames: Sequence[int], parts: Iterable[Samples], width: int = 0) -> FloatArray:
    """Join arrays of all trials, one after another, without a second copy in memory.

    `frames`: number of samples F of each trial.
    `parts` iterable of (F,) or (F, width): the array of each trial, computed when it is needed.
    `width`: columns of the parts; 0: they are (F,).
    Returns: (N,) or (N, width).
    """
    array = np.empty((sum(frames), width) if width else sum(frames))
    at = 0
    for part in parts:
        array[at : at + len(part)] = part
        at += len(part)
    return array


def anything(values: Samples) -> bool:
    """Return True if any value is not zero; NaN counts as not zero."""
    with np.errstate(invalid="ignore"):
        return bool(values.any())


def _doubled(values: NDArray[Any]) -> FloatArray:
    # some bits of a NaN may change; NaN is checked later
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


class ExamStore:
    """Memory for the samples of an exam, which has up to a hundred thousand short arrays.

    Single precision is used if that is exact, and no memory for the zeros of absent sensors. Each
    channel has its own blocks, mapped from the system: when a channel is deleted, its memory is
    returned at once, unlike pieces of a heap.
    """

    def __init__(self) -> None:
        self._rooms: dict[str, NDArray[np.float32]] = {}

    def keep(self, label: str, values: Samples) -> Samples:
        """Return the same numbers (F, ...) in a form that needs little memory.

        `values` (F, ...): samples.
        `label`: their channel.
        """
        bits = values.view(f"u{values.itemsize}") if values.flags.c_contiguous else values
        if not bits.any():
            return np.broadcast_to(np.float32(0.0), values.shape)
        with np.errstate(over="ignore", invalid="ignore"):
            single = values.astype(np.float32, copy=False)
            if not np.array_equal(single, values, equal_nan=True):
                return values.copy()
        room = self._rooms.get(label)
        if room is None or len(room) < single.size:
            size = max(ROOM_BYTES, single.nbytes)
            room = np.frombuffer(mmap.mmap(-1, size), dtype=np.float32)
        stored, self._rooms[label] = room[: single.size], room[single.size :]
        stored[:] = single.ravel()
        return stored.reshape(values.shape)


def from_c3d(c3d: C3dFile, wanted: Callable[[str], bool], store: ExamStore) -> ExamFile:
    """Convert a C3D file to a file of an exam, with the wanted channels.

    Raises InputError: its channels are not sampled once per frame, as all channels of an exam are.
    """
    layout = c3d.layout
    if layout.frames and layout.samples_per_frame != 1:
        problem = f"{layout.samples_per_frame} analog samples per frame"
        raise InputError(problem, file=c3d.name, expected="1, as Dexterit-E writes it")
    # of two channels of the same name the first is used
    labels = {label: i for i, label in reversed(list(enumerate(c3d.analog_labels)))}
    labels = {label: i for label, i in labels.items() if wanted(label)}
    points = {label: i for i, label in reversed(list(enumerate(c3d.point_labels)))}
    values = c3d.analog(list(labels.values()))
    channels = {n: _column(c3d, n, i, values[:, k]) for k, (n, i) in enumerate(labels.items())}
    return ExamFile(
        name=c3d.name,
        parameters=c3d.parameters,
        rate_hz=layout.rate_hz,
        frames=layout.frames,
        hands={n: store.keep(n, c3d.places([i])[:, 0, :2]) for n, i in points.items()},
        channels={n: store.keep(n, samples) for n, samples in channels.items()},
        others=tuple(label for label in c3d.analog_labels if not wanted(label)),
    )


def _column(c3d: C3dFile, label: str, index: int, values: FloatArray) -> Samples:
    """One channel of a C3D file, in its unit; for a status word the bits as stored."""
    is_word = STATUS_WORD.fullmatch(label) and c3d.layout.real
    return np.ascontiguousarray(c3d.stored([index])[:, 0] if is_word else values)


# Containers of a Kinarm exam: a folder, a zip, or one trial beside `common.c3d`.
#
# Nothing is unpacked to the disk. A zip is read only after a check of its claims: number, size and
# compression of its members, and that none of them lies outside of its folder.

#: Largest unpacked exam, bytes: an hour at 1 kHz with 100 channels is 1.4 GB.
LARGEST_EXAM_BYTES: Final = 4 * 1024**3
#: Most members of a zip: a thousand trials with a hundred channels each are 100,000 members.
MOST_MEMBERS: Final = 200_000
#: Largest ratio of compression. Zeros of absent sensors, up to half of an exam, are compressed a
#: thousandfold, measured samples hardly at all.
LARGEST_RATIO: Final = 100
#: Unpacked size up to which any ratio of compression is accepted, bytes.
SMALL_BYTES: Final = 64 * 1024**2
#: Largest member, bytes; one channel of a day at 1 kHz is 346 MB.
LARGEST_MEMBER_BYTES: Final = 1024**3

#: Most folders above an exam within its container: `raw/`, or `name/raw/`.
DEEPEST: Final = 2

COMMON_NAME: Final = "common.c3d"

#: Name of a file -> function that reads its first bytes (their number), or (None) all.
Files = Mapping[str, Callable[[int | None], bytes]]


@contextmanager
def files_of(path: Path) -> Iterator[Files]:
    """Open the files of an exam, by their names relative to `path`.

    `path`: a folder, a zip (`.zip` or `.kinarm`), or a trial's `.c3d` with `common.c3d` beside it.
    Yields: name -> function that reads the file.
    Raises InputError: there is nothing to read, or the zip is broken, too large, packed too
    densely, or has paths outside of its folder.
    """
    if path.is_dir():
        yield {name: _reading(path / name) for name in folder_files(path)}
        return
    if not path.is_file():
        raise InputError("no such file or folder", file=path, expected="a Kinarm exam")
    if path.suffix.lower() == ".c3d":
        yield _single_trial(path)
        return
    with _opened(path) as archive:
        yield _zip_files(path, archive)


def is_common(name: str) -> bool:
    """Return True if a file holds the data common to the trials of a C3D exam."""
    return name.rsplit("/", 1)[-1] == COMMON_NAME and name.count("/") <= DEEPEST


def folder_files(path: Path) -> list[str]:
    """C3D files at most `DEEPEST` folders below `path`, and the members of an unpacked archive."""
    patterns = ["*/" * depth for depth in range(DEEPEST + 1)]
    files = [
        file
        for pattern in patterns
        for file in path.glob(pattern + "*")
        if file.suffix.lower() == ".c3d" and file.is_file()
    ]
    for pattern in patterns:
        for shared in path.glob(pattern + "common/parameters.bin"):
            files += [file for file in shared.parent.parent.glob("*/*") if file.is_file()]
    return [file.relative_to(path).as_posix() for file in files]


def _single_trial(path: Path) -> Files:
    """One trial, and the exam's `common.c3d` in the same folder or one above."""
    if is_common(path.name):
        problem = "is what the trials of an exam share, and no trial"
        raise InputError(problem, file=path, expected="a trial beside it, or their folder")
    places = [path.parent / COMMON_NAME, path.absolute().parent.parent / COMMON_NAME]
    shared = next((place for place in places if place.is_file()), None)
    if shared is None:
        raise InputError(
            "is one trial of a Kinarm exam, and the exam's common.c3d, which holds the robot's "
            "links and calibration and the trial protocols, is not beside it",
            file=path,
            expected="common.c3d of the same exam beside it; or give the exam's zip or folder",
        )
    return {path.name: _reading(path), COMMON_NAME: _reading(shared)}


def _reading(file: Path) -> Callable[[int | None], bytes]:
    def read(size: int | None) -> bytes:
        try:
            if file.stat().st_size > LARGEST_EXAM_BYTES:
                raise _too_large(file, file.stat().st_size)
            with file.open("rb") as opened:
                return opened.read(-1 if size is None else size)
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}", file=file) from None

    return read


@contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    try:
        if _claimed_members(path) > MOST_MEMBERS:
            raise InputError(
                f"holds more than {MOST_MEMBERS} files", file=path, expected="a Kinarm exam"
            )
        archive = zipfile.ZipFile(path)
    # for a damaged directory the library also raises some of Python's own errors
    except (zipfile.BadZipFile, OSError, ValueError, struct.error, NotImplementedError) as error:
        raise InputError(f"not a readable zip: {error}", file=path) from None
    with archive:
        yield archive


def _claimed_members(path: Path) -> int:
    """Number of members that the directory of a zip claims or has room for, before it is read."""
    file_size = path.stat().st_size
    with path.open("rb") as file:
        file.seek(max(file_size - 65_557, 0))
        tail = file.read()
    at = tail.rfind(b"PK\x05\x06")
    if at < 0 or at + 22 > len(tail):
        return 0
    count, size = struct.unpack_from("<HI", tail, at + 10)
    further = tail.rfind(b"PK\x06\x06", 0, at)
    if 0 <= further <= at - 56:
        # the record for more than 65,535 members
        count, size = struct.unpack_from("<QQ", tail, further + 32)
    # the library uses the size, whatever the count is; names have about forty letters
    return max(int(count), min(int(size), file_size) // 100)


def _zip_files(path: Path, archive: zipfile.ZipFile) -> Files:
    members = [info for info in archive.infolist() if not info.is_dir()]
    total = sum(info.file_size for info in members)
    if total > LARGEST_EXAM_BYTES:
        raise _too_large(path, total)
    ratio = total / max(path.stat().st_size, 1)
    if total > SMALL_BYTES and ratio > LARGEST_RATIO:
        problem = f"would unpack to {ratio:.0f} times its size"
        raise InputError(problem, file=path, expected=f"at most {LARGEST_RATIO} times")
    files: dict[str, Callable[[int | None], bytes]] = {}
    for info in members:
        # the name as stored: the library cuts it at a NUL and replaces separators
        name = info.orig_filename.replace("\\", "/")
        parts = PurePosixPath(name).parts
        outside = name.startswith("/") or ".." in parts or re.match(r"[A-Za-z]:", name)
        if outside or not name.isprintable():
            raise InputError(
                f"holds a path outside of its folder: {name[:80]!r}",
                file=path,
                expected="a zip as Dexterit-E writes it",
            )
        if name in files:
            raise InputError(f"holds {name} twice", file=path, expected="every trial once")
        files[name] = _unpacking(path, archive, info)
    return files


def _too_large(path: Path, total: int) -> InputError:
    limit = LARGEST_EXAM_BYTES / 1024**3
    problem = f"would unpack to {total / 1024**3:.0f} GiB"
    return InputError(problem, file=path, expected=f"at most {limit:g}")


def _unpacking(
    path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo
) -> Callable[[int | None], bytes]:
    def read(size: int | None) -> bytes:
        try:
            if info.file_size > LARGEST_MEMBER_BYTES:
                raise _too_large(Path(f"{path}:{info.filename}"), info.file_size)
            if size is None:
                # reads at most the size that was checked; a longer member fails its CRC
                return archive.read(info)
            with archive.open(info) as member:
                return member.read(size)
        except (zipfile.BadZipFile, zlib.error, EOFError, OSError, MemoryError, struct.error):
            problem = "cannot be unpacked"
        except (RuntimeError, NotImplementedError):
            problem = "is encrypted or packed in an unknown way"
        place = f"{path}:{info.filename}"
        raise InputError(problem, file=place, expected="a zip that is whole and not encrypted")

    return read
