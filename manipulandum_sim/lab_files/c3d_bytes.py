"""The bytes of a C3D file, after the user guide, with the quirks of Dexterit-E where they matter.

Blocks of 512 bytes: a header, the groups of parameters, then per frame the points (x, y, z,
residual) and the analog samples in single precision, little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray

BLOCK: Final = 512

#: A parameter: a text, several of one width, or numbers of any shape.
Value = str | tuple[str, ...] | float | NDArray[np.generic]
Groups = Mapping[str, Mapping[str, Value]]


def c3d_bytes(points: FloatArray, analog: FloatArray, groups: Groups, *, rate_hz: float) -> bytes:
    """A whole file.

    Parameters
    ----------
    points : (F, P, 4)
        x, y, z and residual.
    analog : (F * samples per frame, A)
    groups : mapping of mapping
        Group -> name -> value; labels, units, scales and rates of both belong there.
    rate_hz : float
        Frames per second.

    Returns
    -------
    bytes
    """
    frames, n_points = points.shape[:2]
    per_frame = len(analog) // frames if frames else 1
    section = _section(groups)
    # A count of more than 16 bits wraps round, as it does in the files of laboratories.
    header = struct.pack(
        "<2B5HfHHf",
        2, 0x50, n_points, analog.shape[1] * per_frame, 1, frames & 0xFFFF, 0,
        -1.0, 2 + len(section) // BLOCK, per_frame, rate_hz,
    )  # fmt: skip
    samples = analog.reshape(frames, analog.shape[1] * per_frame) if frames else np.zeros((0, 0))
    words = np.concatenate([points.reshape(frames, 4 * n_points), samples], axis=1)
    return _filled(header) + section + _filled(words.astype("<f4").tobytes())


def _section(groups: Groups) -> bytes:
    entries = []
    for number, (group, parameters) in enumerate(groups.items(), start=1):
        entries.append((_named(group, -number), b"\0"))
        for name, value in parameters.items():
            entries.append((_named(name, number), _value(value) + b"\0"))
    written = b"".join(name + struct.pack("<H", 2 + len(body)) + body for name, body in entries)
    blocks = -(-(len(written) + 6) // BLOCK)
    # Readers that trust the number of blocks, which is one byte, find the data by the header.
    return _filled(bytes([1, 0x50, blocks & 0xFF, 84]) + written + b"\0\0")


def _named(name: str, number: int) -> bytes:
    return struct.pack("<bb", len(name), number) + name.encode("ascii")


def _value(value: Value) -> bytes:
    """Type code, dimensions and data of a parameter."""
    if isinstance(value, str):
        # Without a count, as Dexterit-E writes it.
        data = value.encode()
        return struct.pack("<bBB", -1, 1, len(data)) + data
    if isinstance(value, tuple):
        texts = [text.encode() for text in value]
        width = max(map(len, texts), default=0)
        filled = b"".join(text.ljust(width) for text in texts)
        return struct.pack("<bBBB", -1, 2, width, len(texts)) + filled
    numbers = np.asarray(value)
    whole = numbers.dtype.kind in "iu" and (np.abs(numbers.astype(np.int64)) < 2**15).all()
    code, kind = (2, "<i2") if whole else (4, "<f4")
    # The first dimension runs fastest.
    sizes = struct.pack(f"<{numbers.ndim}B", *numbers.shape[::-1])
    return struct.pack("<bB", code, numbers.ndim) + sizes + numbers.astype(kind).tobytes()


def _filled(data: bytes) -> bytes:
    return data.ljust(-(-len(data) // BLOCK) * BLOCK, b"\0")
