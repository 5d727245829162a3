"""Compressed parts of logs, undone up to a size that is set before."""

from __future__ import annotations

import bz2
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.extras import needed

#: A part of a log that is larger is no part of a log.
LARGEST_PART: Final = 256_000_000


def decompressed(data: bytes, method: str, file: Path, limit: int = LARGEST_PART) -> bytes:
    """What a part of a file holds.

    Parameters
    ----------
    data : bytes
    method : {"", "none", "zstd", "lz4", "bz2"}
    file : Path
        For messages.
    limit : int
        More bytes than this are refused.

    Raises
    ------
    InputError
        The part is damaged or too large, or its compression is not known or not installed.
    """
    if method in ("", "none"):
        return data
    try:
        found = _undone(data, method, file, limit)
    except InputError:
        raise
    except Exception:
        # zstandard, lz4 and bz2 have errors of their own, which they do not share.
        raise InputError(
            f"a part compressed with {method} is damaged", file=file, expected="a whole file"
        ) from None
    if len(found) > limit:
        problem = f"a compressed part holds more than {limit} bytes"
        raise InputError(problem, file=file, expected="what it says, in smaller parts")
    return found


def _undone(data: bytes, method: str, file: Path, limit: int) -> bytes:
    if method == "bz2":
        return bz2.BZ2Decompressor().decompress(data, limit + 1)
    if method == "lz4":
        frame = needed("lz4.frame", "ros", file).LZ4FrameDecompressor()
        return bytes(frame.decompress(data, limit + 1))
    if method == "zstd":
        zstd = needed("zstandard", "ros", file)
        # A stream is read up to the limit, whatever size its header claims.
        with zstd.ZstdDecompressor(max_window_size=2**27).stream_reader(data) as stream:
            return bytes(stream.read(limit + 1))
    raise InputError(
        f"unknown compression {method[:20]!r}", file=file, expected="zstd, lz4, bz2 or none"
    )
