"""HDF5 files by somebody else: read without being led out of the file or of memory."""

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

MAGIC: Final = b"\x89HDF\r\n\x1a\n"

#: Deflate does not pack tighter than this; what claims more has no data behind it.
_TIGHTEST: Final = 1100
_SMALL_BYTES: Final = 4_000_000
#: Numbers of one dataset; 500 MB of them.
MOST_NUMBERS: Final = 62_500_000
_LONGEST_TEXT: Final = 10_000
_LONGEST_NAME: Final = 80
#: How a heap begins, with its version.
_HEAP: Final = b"GCOL\x01"
_LARGEST_CHECKED: Final = 4_000_000_000
#: Bytes that are looked through at once.
_BLOCK: Final = 8_000_000


class Hdf5Error(Exception):
    """A dataset cannot be read; why, in a few words."""


@contextmanager
def opened_hdf5(path: Path, extra: str, expected: str) -> Iterator[Any]:
    """An HDF5 file, open for reading.

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
        # h5py raises OSError, RuntimeError, KeyError, ValueError, TypeError, ... for damage.
        problem = f"is damaged: {' '.join(str(error).split())[:80]}"
        raise InputError(problem, file=path, expected=expected) from None


def check_heaps(path: Path, expected: str) -> None:
    """Whether the heaps in which a file keeps its texts can be walked: HDF5 would walk for ever.

    `expected`: for the message.
    Raises InputError: a heap has a part of no length. HDF5 does not look, and no signal ends its
    loop.
    """
    size = path.stat().st_size
    if not size or size > _LARGEST_CHECKED:
        return
    # Not mapped into memory: a file that is cut short meanwhile would end the process.
    with path.open("rb") as stream, path.open("rb") as walked:
        for place in _heaps(stream):
            if _has_empty_part(walked, place, size):
                problem = f"is damaged: a heap at byte {place} has a part of no length"
                raise InputError(problem, file=path, expected=expected)


def _heaps(stream: BinaryIO) -> Iterator[int]:
    """Where the heaps of a file begin, in bytes."""
    start, kept = 0, b""
    while block := stream.read(_BLOCK):
        data = kept + block
        place = data.find(_HEAP)
        while place >= 0:
            yield start + place
            place = data.find(_HEAP, place + len(_HEAP))
        # The next block may hold the rest of a heap's beginning.
        kept = data[len(data) - len(_HEAP) + 1 :]
        start += len(data) - len(kept)


def _has_empty_part(stream: BinaryIO, place: int, size: int) -> bool:
    """Walk through a heap: parts with a header of 16 bytes, their lengths multiples of 8."""
    if place + 16 > size:
        return False
    stream.seek(place + 8)
    (length,) = unpack("<Q", stream.read(8).ljust(8, b"\0"))
    end = min(place + length, size)
    place += 16
    while place + 16 <= end:
        stream.seek(place)
        number, _, part = unpack("<HHxxxxQ", stream.read(16).ljust(16, b"\xff"))
        step = 16 + (part + 7) // 8 * 8 if number else part
        if not step:
            return True
        place += step
    return False


def inner(group: Any) -> Iterator[tuple[str, Any]]:
    """What lies directly in a group: names and groups or datasets; None for what cannot be taken.

    Links to other files are not followed, nor links to nothing; a name must be one that a line of
    text can show.
    """
    for name in map(str, group):
        shown = name.isprintable() and len(name) <= _LONGEST_NAME
        yield name, member(group, name) if shown else None


def member(group: Any, path: str) -> Any:
    """What lies in a group under a path; None where there is nothing in this file."""
    h5py = needed("h5py", "nwb", path)
    home, thing = h5py.h5f.get_name(group.id), group
    for part in path.split("/"):
        if is_dataset(thing):
            return None
        link = thing.get(part, getlink=True)
        if link is None or isinstance(link, h5py.ExternalLink):
            return None
        try:
            thing = thing[part]
        except (KeyError, OSError, RuntimeError):
            return None
        # A soft link may lead over another link into another file.
        if h5py.h5f.get_name(thing.id) != home:
            return None
    return thing


def is_dataset(thing: Any) -> bool:
    """Whether this is a dataset and no group."""
    return hasattr(thing, "shape")


def numbers(dataset: Any) -> FloatArray:
    """All numbers of a dataset, float64, in its shape.

    Raises Hdf5Error: it holds no numbers, too many, fewer than it claims, or cannot be unpacked.
    """
    check_numbers(dataset)
    try:
        # Read as it is stored: HDF5's own conversion of types is not needed.
        return np.asarray(dataset[()]).astype(np.float64, copy=False)
    except (OSError, ValueError, TypeError, RuntimeError, MemoryError):
        raise Hdf5Error("it cannot be unpacked") from None


def check_numbers(dataset: Any) -> None:
    """Whether a dataset's numbers can be read, before any memory is taken."""
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
    """All texts of a dataset with one axis."""
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
    """A text of an attribute or a scalar dataset; "" for what is none."""
    if isinstance(value, bytes):
        value = value.decode(errors="replace")
    if not isinstance(value, str):
        return ""
    return value[:_LONGEST_TEXT].replace("\x00", "")


def attribute_text(thing: Any, name: str) -> str:
    """An attribute's text; "" where there is none."""
    try:
        return plain_text(thing.attrs.get(name))
    except (OSError, ValueError, TypeError, RuntimeError, KeyError, MemoryError):
        return ""


def attribute_number(thing: Any, name: str, default: float) -> float:
    """An attribute's number.

    Raises Hdf5Error: it is there and no finite number.
    """
    try:
        value = thing.attrs.get(name)
        number = default if value is None else float(np.asarray(value).reshape(-1)[0])
    except (OSError, ValueError, TypeError, RuntimeError, KeyError, IndexError, MemoryError):
        raise Hdf5Error(f"its {name} is no number") from None
    if not math.isfinite(number):
        raise Hdf5Error(f"its {name} is not finite")
    return number
