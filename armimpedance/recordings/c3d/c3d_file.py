"""One C3D file, of motion capture or of a Kinarm: position and meaning of its samples.

After the C3D user guide (Motion Lab Systems): blocks of 512 bytes; a header, a section of
parameters in groups, then per frame the points (x, y, z, residual) and the analog samples, as
reals or as scaled 16-bit integers. Kinarm's Dexterit-E departs from the guide: `ANALOG:OFFSET` is a
real, `POINT:DATA_START` is 0, texts have no count dimension, and longer trials overflow the 16 bits
of the count of frames.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular
from armimpedance.recordings.c3d.parameters import C3dParameters, Processor, read_parameters

# Position and form of the samples of a C3D file, checked against the file's length.

BLOCK: Final = 512
_KEY: Final = 0x50
#: Counts of frames in the header have 16 bits.
_WRAP: Final = 65536


@dataclass(frozen=True)
class Layout:
    """The form of the samples.

    `start`: position of the first frame, in bytes.
    `real`: True if words are reals, False for 16-bit integers.
    `point_scale`: file's unit of length per count; 1 for reals.
    `first_frame`: number of the first frame, from 1.
    `remarks`: sentences on wrong statements in the header.
    """

    start: int
    frames: int
    points: int
    channels: int
    samples_per_frame: int
    real: bool
    point_scale: float
    first_frame: int
    rate_hz: float
    remarks: tuple[str, ...] = ()

    @property
    def words_per_frame(self) -> int:
        """Number of words per frame: four per point, then the analog samples."""
        return 4 * self.points + self.channels * self.samples_per_frame

    @property
    def word_bytes(self) -> int:
        """Bytes per word."""
        return 4 if self.real else 2


@dataclass(frozen=True)
class _Header:
    """The first block: words 2 to 5 and 7 to 12 of the C3D guide."""

    points: int
    analog: int
    first: int
    last: int
    scale: float
    block: int
    per_frame: int
    rate_hz: float

    @staticmethod
    def parse(data: bytes, processor: Processor) -> _Header:
        words = np.frombuffer(data, processor.dtype("u2"), 12)
        counts = [int(n) for n in words]
        reals = np.frombuffer(data[12:16] + data[20:24], processor.dtype("f4"))
        scale, rate = (float(x) for x in processor.decoded(reals))
        return _Header(
            counts[1], counts[2], counts[3], counts[4], scale, counts[8], counts[9], rate
        )

    @property
    def frames(self) -> int:
        """Number of frames in the header; 0 if the last frame is 0."""
        return (self.last - self.first + 1) % _WRAP if self.last else 0


def layout_of(data: bytes, name: str, parameters: C3dParameters) -> Layout:
    """Determine the layout of a C3D file's samples.

    `data`: the whole file.
    `name`: the file's name, for messages.
    Raises InputError: the header contradicts itself, or claims what the file does not hold.
    """
    header = _Header.parse(data, parameters.processor)
    if not (header.points or header.analog):
        # a file of parameters only: the rest of the header has no meaning
        first = max(header.first, 1)
        return Layout(len(data), 0, 0, 0, 1, True, 1.0, first, header.rate_hz)
    scale = _scale(header, parameters)
    if not np.isfinite(scale) or scale == 0:
        problem = f"a scale of the points of {scale:g}"
        raise InputError(problem, file=name, expected="negative for reals, else mm a count")
    start = _start(data, name, header, parameters)
    channels, per_frame, remarks = _analog(data, name, header, parameters, start)
    real = scale < 0
    bytes_per_frame = (4 * header.points + channels * per_frame) * (4 if real else 2)
    frames = _frames(data, name, header, parameters, start, bytes_per_frame)
    return Layout(
        start=start,
        frames=frames,
        points=header.points,
        channels=channels,
        samples_per_frame=per_frame,
        real=real,
        point_scale=1.0 if real else scale,
        first_frame=max(header.first, 1),
        rate_hz=_rate(name, header, parameters) if frames else header.rate_hz,
        remarks=remarks,
    )


def _analog(
    data: bytes, name: str, header: _Header, parameters: C3dParameters, start: int
) -> tuple[int, int, tuple[str, ...]]:
    """Number of channels, samples per frame, and a remark if the header is wrong."""
    per_frame = header.per_frame
    if not header.analog:
        return 0, max(per_frame, 1), ()
    whole = per_frame > 0 and header.analog % per_frame == 0
    # some programs write the number of channels instead of the samples of all channels: assumed if
    # there are as many channels and the file is long enough
    if per_frame > 1 and parameters.first("ANALOG", "USED", -1.0) == header.analog:
        words = header.frames * (4 * header.points + header.analog * per_frame)
        if not whole or len(data) - start >= words * (4 if _scale(header, parameters) < 0 else 2):
            remark = f"The header has {header.analog} analog values a frame: taken as the channels."
            return header.analog, per_frame, (remark,)
    if whole:
        return header.analog // per_frame, per_frame, ()
    problem = f"{header.analog} analog values in {per_frame} samples per frame"
    raise InputError(problem, file=name, expected="a multiple")


def _scale(header: _Header, parameters: C3dParameters) -> float:
    return parameters.first("POINT", "SCALE", header.scale)


def _start(data: bytes, name: str, header: _Header, parameters: C3dParameters) -> int:
    block = header.block or parameters.first("POINT", "DATA_START", 0.0)
    if not header.frames and block in (0.0, 1.0):
        return len(data)
    if not 1 < block <= len(data) / BLOCK + 1:
        problem = f"the data are said to start at block {block:g}"
        raise InputError(problem, file=name, expected="a block of the file, after the header")
    return (int(block) - 1) * BLOCK


def _frames(
    data: bytes, name: str, header: _Header, parameters: C3dParameters, start: int, size: int
) -> int:
    """Number of frames, which may be more than the header's 16 bits can state.

    For a longer recording the count wraps round at 65536 or stays at 65535; the length of the file
    gives the true count. Files are filled up to a whole block, with fewer than `BLOCK` bytes.
    """
    claimed, stored = header.frames, (len(data) - start) // size
    for exact in _long_counts(parameters):
        # the header has the lower 16 bits of this count, or the largest number that fits
        same = exact % _WRAP == claimed or claimed == _WRAP - 1
        if claimed < exact <= stored and same:
            return exact
    if claimed > stored:
        problem = f"the header claims {claimed} frames, the file holds {stored}"
        raise InputError(problem, file=name, expected="a file that is not cut off")
    if "ROTATION" in parameters.groups:
        return claimed
    if claimed == _WRAP - 1:
        while stored > claimed and not any(
            data[start + (stored - 1) * size : start + stored * size]
        ):
            stored -= 1
        return stored
    wrapped = claimed + (stored - claimed) // _WRAP * _WRAP
    return wrapped if stored - wrapped <= (BLOCK - 1) // size else claimed


def _long_counts(parameters: C3dParameters) -> list[int]:
    """Counts of frames that programs write in parameters, without the limit of 16 bits."""
    counts = []
    ends = [
        parameters.numbers("TRIAL", f"ACTUAL_{end}_FIELD")[:2] % _WRAP for end in ("START", "END")
    ]
    if all(len(e) == 2 and np.isfinite(e).all() for e in ends):
        first, last = (int(e[0] + _WRAP * e[1]) for e in ends)
        counts.append(last - first + 1)
    for parameter in ("LONG_FRAMES", "FRAMES"):
        value = parameters.first("POINT", parameter, 0.0)
        if np.isfinite(value) and value > 0:
            counts.append(int(value))
    return counts


def _rate(name: str, header: _Header, parameters: C3dParameters) -> float:
    rate = header.rate_hz
    if not (np.isfinite(rate) and rate > 0):
        rate = parameters.first("POINT", "RATE", 0.0)
    if not (np.isfinite(rate) and 0 < rate < 1e6):
        raise InputError(f"a rate of {rate} frames/s", file=name, expected="a positive number")
    return float(rate)


@dataclass(frozen=True)
class C3dFile:
    """The content of one file; samples are decoded when they are requested.

    `name`: the file's name, for messages.
    `header`: the first block.
    `words` (F, W): as stored: in each frame x, y, z, residual of each point, then the analog
    samples.
    `point_labels`, `analog_labels`: a label that appears twice is replaced by its description if
    that is unique.
    """

    name: str
    header: bytes
    parameters: C3dParameters
    layout: Layout
    words: NDArray[np.generic]
    point_labels: tuple[str, ...]
    analog_labels: tuple[str, ...]

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self.layout.rate_hz

    @property
    def analog_rate_hz(self) -> float:
        """Analog samples per second."""
        return self.layout.rate_hz * self.layout.samples_per_frame

    @property
    def length_unit(self) -> str:
        """Unit of points, corners and origins; mm if the file does not state it."""
        return self.parameters.text("POINT", "UNITS") or "mm"

    def places(self, index: Sequence[int]) -> FloatArray:
        """Points (F, n, 3) in the file's unit and axes."""
        columns = 4 * np.asarray(index, np.intp)[:, None] + np.arange(3)
        words = self.words[:, columns.ravel()].reshape(len(self.words), len(index), 3)
        with np.errstate(over="ignore", invalid="ignore"):
            return self._decoded(words) * self.layout.point_scale

    def residuals(self, index: Sequence[int]) -> FloatArray:
        """Residuals (F, n) of points, their fourth words; negative if the point was not seen."""
        return self._decoded(self.words[:, 4 * np.asarray(index, np.intp) + 3])

    def unseen(self, index: Sequence[int]) -> BoolArray:
        """True where a point was not seen, (F, n): its residual is negative."""
        return self.residuals(index) < 0

    def stored(self, index: Sequence[int]) -> NDArray[np.generic]:
        """Analog channels (F * samples a frame, n) exactly as stored in the file."""
        layout, chosen = self.layout, np.asarray(index, np.intp)
        columns = (
            4 * layout.points
            + np.arange(layout.samples_per_frame)[:, None] * layout.channels
            + chosen[None, :]
        )
        count = len(self.words) * layout.samples_per_frame
        return self.words[:, columns.ravel()].reshape(count, len(chosen))

    def analog(self, index: Sequence[int]) -> FloatArray:
        """Analog channels (F * samples a frame, n) in the file's units.

        Raises InputError: a channel lacks its scale or offset.
        """
        layout, chosen, words = self.layout, np.asarray(index, np.intp), self.stored(index)
        unsigned = self.parameters.text("ANALOG", "FORMAT").upper() == "UNSIGNED"
        if unsigned and not layout.real:
            words = words.view(words.dtype.str.replace("i", "u"))
        offset = self._per_channel("OFFSET", 0.0)[chosen]
        if unsigned:
            offset = np.mod(offset, 65536.0)
        general = self.parameters.first("ANALOG", "GEN_SCALE", 1.0)
        scale = self._per_channel("SCALE", 1.0)[chosen] * general
        values = self._decoded(words)
        if layout.real and not unsigned:
            # counts above the signed range are unsigned, whatever FORMAT says
            beyond = (offset < 0) & (values.max(axis=0, initial=0.0) > 32767)
            offset = np.where(beyond, offset + 65536.0, offset)
        with np.errstate(invalid="ignore", over="ignore"):
            values -= offset
            values *= scale
        return values

    def _decoded(self, words: NDArray[np.generic]) -> FloatArray:
        return self.parameters.processor.decoded(words)

    def _per_channel(self, parameter: str, default: float) -> FloatArray:
        values, channels = self.parameters.numbers("ANALOG", parameter), self.layout.channels
        if not len(values):
            return np.full(channels, default)
        if len(values) < channels:
            problem = f"ANALOG:{parameter} has {len(values)} values"
            raise InputError(problem, file=self.name, expected=f"one per channel: {channels}")
        return values[:channels]


def muscles_of(emg_channels: Mapping[str, str] | None) -> dict[str, str]:
    """Map of analog channels to muscles; refuse two channels of one muscle."""
    muscles = dict(emg_channels or {})
    if len(set(muscles.values())) < len(muscles):
        raise InputError("two EMG channels of one muscle", expected="a muscle for each channel")
    return muscles


def _check(data: bytes, name: str) -> None:
    """Refuse bytes that do not begin like a C3D file."""
    if len(data) < BLOCK:
        problem = "is empty" if not data else f"is cut off after {len(data)} bytes"
        raise InputError(problem, file=name, expected="a C3D file with a header of 512 bytes")
    if data[1] != _KEY or data[0] < 2:
        raise InputError("is not a C3D file", file=name, expected="80 as the second byte")


def parameters_of(data: bytes, name: str) -> C3dParameters:
    """Read the parameters of a C3D file, without its samples; errors as in `parse_c3d`."""
    _check(data, name)
    return read_parameters(data, name, (data[0] - 1) * BLOCK)


def read_c3d(path: str | os.PathLike[str]) -> C3dFile:
    """Read a C3D file from the disk; see `parse_c3d`."""
    check_regular(Path(path))
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    return parse_c3d(data, str(path))


def parse_c3d(data: bytes, name: str) -> C3dFile:
    """Read a C3D file from its bytes.

    `name`: the file's name, for messages.
    Raises InputError: it is no C3D file, is cut off, or does not hold what its header claims.
    """
    parameters = parameters_of(data, name)
    layout = layout_of(data, name, parameters)
    word = parameters.processor.dtype("f4" if layout.real else "i2")
    count = layout.frames * layout.words_per_frame
    words = np.frombuffer(data, word, count, layout.start)
    return C3dFile(
        name=name,
        header=data[:BLOCK],
        parameters=parameters,
        layout=layout,
        words=words.reshape(layout.frames, layout.words_per_frame),
        point_labels=_labels(parameters, "POINT", layout.points),
        analog_labels=_labels(parameters, "ANALOG", layout.channels),
    )


def _labels(parameters: C3dParameters, group: str, count: int) -> tuple[str, ...]:
    """Labels of points or channels; numbers for those without a label."""
    labels = list(parameters.texts(group, "LABELS")[:count])
    # some programs write four letters as the label and the marker's name as the description
    described = parameters.texts(group, "DESCRIPTIONS")[: len(labels)]
    times, described_times = Counter(labels), Counter(described)
    for i, text in enumerate(described):
        if (
            labels[i]
            and times[labels[i]] > 1
            and text
            and described_times[text] == 1
            and text not in times
        ):
            labels[i] = text
    unnamed = [f"{group}_{i}" for i in range(len(labels) + 1, count + 1)]
    return (*labels, *unnamed)
