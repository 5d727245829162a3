"""Reading C3D files byte by byte, those included that other readers refuse.

After the C3D user guide (Motion Lab Systems): blocks of 512 bytes; a header, a section of
parameters in groups, then per frame the points (x, y, z, residual) and the analog samples, as
float32 or as scaled int16. Little-endian files only (processor 84, nearly all there are). Kinarm's
Dexterit-E departs from the guide: `ANALOG:OFFSET` is float32, `POINT:DATA_START` is 0, texts stand
without a count dimension, and longer trials overflow 16 bits of frames.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d_parameters import (
    Groups,
    HasParameters,
    first_of,
    numbers_of,
    read_groups,
    texts_of,
)

BLOCK: Final = 512
_KEY: Final = 0x50


@dataclass(frozen=True)
class C3DFile(HasParameters):
    """The content of one C3D file.

    Attributes
    ----------
    name : str
        For messages.
    parameters : mapping of mapping
        Group -> name -> parameter, all names in capitals.
    rate_hz : float
        Frames per second.
    points : (F, P, 3)
        In the file's own unit; where `residual` is negative, the point was not seen.
    residual : (F, P)
        The fourth word of each point.
    analog : (F * samples_per_frame, A)
        In the file's own units: offset and scale are applied.
    stored : (F * samples_per_frame, A)
        The same as it stands in the file, bit by bit.
    other_labels : tuple of str
        Labels of analog channels that were not asked for.
    """

    name: str
    parameters: Groups
    rate_hz: float
    samples_per_frame: int
    point_labels: tuple[str, ...]
    points: FloatArray
    residual: FloatArray
    analog_labels: tuple[str, ...]
    analog: FloatArray
    stored: NDArray[Any]
    other_labels: tuple[str, ...] = ()

    @property
    def frames(self) -> int:
        """Number of frames F."""
        return len(self.points)


def is_c3d(data: bytes) -> bool:
    """Whether these bytes begin as a C3D file does."""
    return len(data) >= BLOCK and data[1] == _KEY and data[0] >= 2


def check_c3d(data: bytes, name: str) -> None:
    """Refuse bytes that do not begin as a C3D file does.

    Parameters
    ----------
    data : bytes
    name : str
        The file's name, for messages.

    Raises
    ------
    InputError
    """
    if len(data) < BLOCK:
        problem = "is empty" if not data else f"is cut off after {len(data)} bytes"
        raise InputError(problem, file=name, expected="a C3D file with a header of 512 bytes")
    if not is_c3d(data):
        raise InputError("is not a C3D file", file=name, expected="80 as the second byte")


def parse_c3d(data: bytes, name: str, wanted: Callable[[str], bool] | None = None) -> C3DFile:
    """The content of a C3D file from its bytes.

    Parameters
    ----------
    data : bytes
    name : str
        The file's name, for messages.
    wanted : callable, optional
        Which analog channels are read, by their labels; None: all.

    Raises
    ------
    InputError
        It is no C3D file, is cut off, or its header claims what it does not hold.
    """
    check_c3d(data, name)
    header = _Header.parse(data)
    parameters = read_groups(data, name, (data[0] - 1) * BLOCK)
    layout = _Layout.of(data, name, header, parameters)
    words = np.frombuffer(
        data, layout.word, layout.frames * layout.words_per_frame, layout.start
    ).reshape(layout.frames, layout.words_per_frame)
    points = words[:, : 4 * header.points].reshape(layout.frames, header.points, 4)
    # What is no number, or is beyond all numbers, is told by those who need it.
    with np.errstate(invalid="ignore", over="ignore"):
        places = points[:, :, :3] * layout.point_scale
        residual = points[:, :, 3].astype(np.float64)
    per_frame = header.analog_samples_per_frame
    channels = header.analog_per_frame // per_frame if per_frame else 0
    stored = words[:, 4 * header.points :].reshape(layout.frames * max(per_frame, 1), channels)
    labels = _labels(parameters, "ANALOG", channels)
    kept = [i for i, label in enumerate(labels) if wanted is None or wanted(label)]
    return C3DFile(
        name=name,
        parameters=parameters,
        rate_hz=_rate(name, header, parameters, layout.frames),
        samples_per_frame=per_frame,
        point_labels=_labels(parameters, "POINT", header.points),
        points=places,
        residual=residual,
        analog_labels=tuple(labels[i] for i in kept),
        analog=_scaled_analog(name, stored, parameters, kept),
        stored=stored[:, kept],
        other_labels=tuple(label for i, label in enumerate(labels) if i not in kept),
    )


def muscles_of(emg_channels: Mapping[str, str] | None) -> dict[str, str]:
    """Analog channel -> muscle, each muscle once.

    Raises
    ------
    InputError
        Two channels are given to one muscle.
    """
    muscles = dict(emg_channels or {})
    if len(set(muscles.values())) < len(muscles):
        raise InputError("two EMG channels of one muscle", expected="a muscle for each channel")
    return muscles


@dataclass(frozen=True)
class _Header:
    """The first block. Numbers of words are those of the guide, from 1."""

    points: int
    analog_per_frame: int
    first_frame: int
    last_frame: int
    scale: float
    data_start_block: int
    analog_samples_per_frame: int
    rate_hz: float

    @staticmethod
    def parse(data: bytes) -> _Header:
        # Words 2-12; word 6, the longest gap that was filled, is not needed.
        points, analog, first, last, _, scale, start, per_frame, rate = struct.unpack_from(
            "<5HfHHf", data, 2
        )
        return _Header(points, analog, first, last, scale, start, per_frame, rate)

    @property
    def frames(self) -> int:
        """Frames that the header claims; they are counted from 1, a last frame 0 is none."""
        return max(self.last_frame - self.first_frame + 1, 0) if self.last_frame else 0


@dataclass(frozen=True)
class _Layout:
    """Where the data lie and in which form."""

    start: int
    frames: int
    words_per_frame: int
    word: np.dtype
    point_scale: float

    @staticmethod
    def of(data: bytes, name: str, header: _Header, parameters: Groups) -> _Layout:
        words = 4 * header.points + header.analog_per_frame
        per_frame = header.analog_samples_per_frame
        if header.analog_per_frame and (not per_frame or header.analog_per_frame % per_frame):
            problem = f"{header.analog_per_frame} analog values in {per_frame} samples per frame"
            raise InputError(problem, file=name, expected="a multiple")
        scale = first_of(parameters, "POINT", "SCALE", header.scale)
        word = np.dtype("<f4" if scale < 0 else "<i2")
        if not words:
            return _Layout(0, 0, words, word, 1.0)
        block = header.data_start_block or first_of(parameters, "POINT", "DATA_START", 0.0)
        if not header.frames and block in (0.0, 1.0):
            return _Layout(0, 0, words, word, 1.0 if scale < 0 else scale)
        if not 1 < block <= len(data) / BLOCK + 1:
            problem = f"the data are said to start at block {block:g}"
            raise InputError(problem, file=name, expected="a block of the file, after the header")
        start = (int(block) - 1) * BLOCK
        frames = _frames(name, header.frames, data[start:], words * word.itemsize)
        return _Layout(start, frames, words, word, 1.0 if scale < 0 else scale)


def _frames(name: str, claimed: int, frame_data: bytes, frame_bytes: int) -> int:
    """How many frames there are, where 16 bits may not have sufficed to say so.

    A longer recording wraps round at 65536 frames or stays at 65535: the length of the file tells.
    It is filled to a whole block, with fewer than `BLOCK` bytes.
    """
    held = len(frame_data) // frame_bytes
    if claimed > held:
        raise InputError(
            f"the header claims {claimed} frames, the file holds {held}",
            file=name,
            expected="a file that is not cut off",
        )
    if claimed == 65535:
        while held > claimed and not any(frame_data[(held - 1) * frame_bytes : held * frame_bytes]):
            held -= 1
        return held
    filling = (BLOCK - 1) // frame_bytes
    wrapped = claimed + (held - claimed) // 65536 * 65536
    return wrapped if held - wrapped <= filling else claimed


def _rate(name: str, header: _Header, parameters: Groups, frames: int) -> float:
    rate = header.rate_hz
    if not (np.isfinite(rate) and rate > 0):
        rate = first_of(parameters, "POINT", "RATE", 0.0)
    if frames and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"a rate of {rate} frames/s", file=name, expected="a positive number")
    return float(rate)


def _scaled_analog(
    name: str, raw: NDArray[Any], parameters: Groups, kept: Sequence[int]
) -> FloatArray:
    """Some channels' samples in their units: (raw - offset) * scale * general scale."""
    channels = raw.shape[1]
    unsigned = texts_of(parameters, "ANALOG", "FORMAT")[:1] == ("UNSIGNED",)
    if unsigned and raw.dtype.kind == "i":
        raw = raw.view("<u2")

    def per_channel(parameter: str, default: float) -> FloatArray:
        parts = [numbers_of(parameters, "ANALOG", p) for p in (parameter, parameter + "2")]
        values = np.concatenate([p for p in parts if p is not None] or [np.zeros(0)])
        if unsigned and parameter == "OFFSET":
            values = np.mod(values, 65536.0)
        if len(values) == 0:
            return np.full(channels, default)
        if len(values) < channels:
            raise InputError(
                f"ANALOG:{parameter} has {len(values)} values",
                file=name,
                expected=f"one per channel: {channels}",
            )
        return values[:channels]

    if channels == 0 or len(raw) == 0:
        return np.zeros((len(raw), len(kept)))
    scale = per_channel("SCALE", 1.0)[kept] * first_of(parameters, "ANALOG", "GEN_SCALE", 1.0)
    with np.errstate(invalid="ignore", over="ignore"):
        return (raw[:, kept].astype(np.float64) - per_channel("OFFSET", 0.0)[kept]) * scale


def _labels(parameters: Groups, group: str, count: int) -> tuple[str, ...]:
    """Labels of points or channels; those beyond 255 are in LABELS2, unnamed ones get a number."""
    given = [
        label
        for parameter in ("LABELS", "LABELS2", "LABELS3")
        for label in texts_of(parameters, group, parameter)
    ]
    unnamed = [f"{group}_{i}" for i in range(len(given) + 1, count + 1)]
    return tuple((given + unnamed)[:count])
