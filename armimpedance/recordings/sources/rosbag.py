"""ROS bags: ROS 1 files (.bag), ROS 2 folders and databases (.db3, .mcap)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from armimpedance.core.errors import InputError, needed
from armimpedance.recordings.mapped.raw_file import RawFile, Source, Wanted
from armimpedance.recordings.messages.ros_bags import (
    MAGIC_OF_BAG as BAG,
    MAGIC_OF_DATABASE as DATABASE,
    add_ros1_bag,
    add_ros2_database,
    decompressed,
)
from armimpedance.recordings.messages.topics import Log, Unpack, readable
from armimpedance.recordings.sources.mcap import add_mcap

METADATA: Final = "metadata.yaml"
_LARGEST_METADATA: Final = 4_000_000
_PART: Final = re.compile(
    r"""^\s*(?:-\s+path:|-|path:)\s*["']?(?P<name>[^\n"']+?\.(?:db3|mcap)(?:\.zstd)?)["']?\s*$""",
    re.MULTILINE,
)
_MODE: Final = re.compile(r"""^\s*compression_mode:\s*["']?(?P<mode>\w+)""", re.MULTILINE)
#: The largest size of a decompressed file, relative to its size and in bytes.
_GROWTH, _SMALLEST_LIMIT = 40, 64_000_000
_LARGEST_MESSAGE: Final = 64_000_000


def recognises(path: Path) -> bool:
    """True if a file is a bag or a database, or a folder is a ROS 2 bag."""
    if path.is_dir():
        return (path / METADATA).is_file() and "rosbag2_bagfile_information" in _text(path)
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(16)
    return start.startswith(BAG) or (start == DATABASE and path.suffix.lower() == ".db3")


def read(path: Path, wanted: Wanted) -> RawFile:
    """Read the topics of a bag.

    Parameters
    ----------
    path : Path
    wanted : callable
        True for a wanted column, such as "/ft.wrench.force.x".

    Returns
    -------
    RawFile
        One run; each topic is a table, since each has its own clock.

    Raises
    ------
    InputError
    """
    log = Log(path, wanted)
    with readable(path):
        if path.is_dir():
            _add_folder(log, path)
        elif path.suffix.lower() == ".db3":
            add_ros2_database(log, path)
        else:
            add_ros1_bag(log, path)
    return log.raw_file()


def _text(folder: Path) -> str:
    with (folder / METADATA).open("rb") as stream:
        return stream.read(_LARGEST_METADATA).decode(errors="replace")


def _add_folder(log: Log, folder: Path) -> None:
    text = _text(folder)
    # The folder may have been moved, so only the name after the last slash is used.
    names = dict.fromkeys(re.split(r"[/\\]", m["name"])[-1] for m in _PART.finditer(text))
    if not names:
        expected = "files .db3 or .mcap in relative_file_paths"
        raise InputError("names no files", file=folder / METADATA, expected=expected)
    mode = _MODE.search(text)
    is_compressed = mode is not None and mode["mode"].upper() == "MESSAGE"
    with ExitStack() as stack:
        for name in names:
            part = folder / name
            if not part.is_file():
                problem = f"{name[:60]!r} is not in the folder"
                raise InputError(problem, file=folder / METADATA, expected="all files of the bag")
            if part.suffix == ".zstd":
                part = _unpacked(part, stack)
            _add_part(log, part, is_compressed)


def _add_part(log: Log, part: Path, packed: bool) -> None:
    def unpack(message: bytes) -> bytes:
        return decompressed(message, "zstd", part, _LARGEST_MESSAGE)

    used: Unpack | None = unpack if packed else None
    if part.suffix == ".mcap":
        add_mcap(log, part, used)
    else:
        add_ros2_database(log, part, used)


def _unpacked(part: Path, stack: ExitStack) -> Path:
    """Decompress a whole file into a temporary folder."""
    folder = Path(stack.enter_context(TemporaryDirectory()))
    limit = max(_GROWTH * part.stat().st_size, _SMALLEST_LIMIT)
    unpacked = folder / part.stem
    with unpacked.open("wb") as out:
        for piece in _pieces(part):
            if out.tell() + len(piece) > limit:
                problem = f"unpacks to more than {limit // 1_000_000} MB"
                raise InputError(problem, file=part, expected="a whole bag")
            out.write(piece)
    return unpacked


def _pieces(part: Path) -> Iterator[bytes]:
    zstd = needed("zstandard", "ros", part)
    try:
        with part.open("rb") as stream, zstd.ZstdDecompressor().stream_reader(stream) as reader:
            while piece := reader.read(1 << 20):
                yield piece
    except zstd.ZstdError:
        raise InputError("is damaged (zstd)", file=part, expected="a whole bag") from None


SOURCE = Source("a ROS bag (.bag, a folder of ROS 2, .db3)", recognises, read)
