"""One C3D file of motion capture: what is in it, decoded as far as it is asked for."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d_file import check_c3d
from armimpedance.recordings.capture.layout import BLOCK, Layout, layout_of
from armimpedance.recordings.capture.parameters import Parameters, read_parameters


@dataclass(frozen=True)
class Capture:
    """The content of one file; samples are decoded when they are asked for.

    Attributes
    ----------
    name : str
        For messages.
    header : bytes
        The first block.
    parameters : Parameters
    layout : Layout
    words : (F, W)
        As stored: of each frame x, y, z, residual of each point, then the analog samples.
    point_labels, analog_labels : tuple of str
        A label that stands twice is replaced by its description where that tells the two apart.
    """

    name: str
    header: bytes
    parameters: Parameters
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
        """The unit of points, corners and origins; mm where the file does not say."""
        return self.parameters.text("POINT", "UNITS") or "mm"

    def places(self, index: Sequence[int]) -> FloatArray:
        """Points (F, n, 3) in the file's unit and axes."""
        columns = 4 * np.asarray(index, np.intp)[:, None] + np.arange(3)
        words = self.words[:, columns.ravel()].reshape(len(self.words), len(index), 3)
        with np.errstate(over="ignore", invalid="ignore"):
            return self._decoded(words) * self.layout.point_scale

    def residuals(self, index: Sequence[int]) -> FloatArray:
        """The fourth word (F, n) of points; where it is negative, the point was not seen."""
        return self._decoded(self.words[:, 4 * np.asarray(index, np.intp) + 3])

    def unseen(self, index: Sequence[int]) -> BoolArray:
        """Where the residual (F, n) of points is negative."""
        return self.residuals(index) < 0

    def analog(self, index: Sequence[int]) -> FloatArray:
        """Analog channels (F * samples a frame, n) in the file's units.

        Raises
        ------
        InputError
            A channel lacks its scale or offset.
        """
        layout, chosen = self.layout, np.asarray(index, np.intp)
        columns = (
            4 * layout.points
            + np.arange(layout.samples_per_frame)[:, None] * layout.channels
            + chosen[None, :]
        )
        count = len(self.words) * layout.samples_per_frame
        words = self.words[:, columns.ravel()].reshape(count, len(chosen))
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
            # Counts beyond a signed word's were unsigned, whatever FORMAT says.
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


def read_capture(path: str | os.PathLike[str]) -> Capture:
    """Read a C3D file of motion capture from the disk; see `parse_capture`."""
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from None
    return parse_capture(data, str(path))


def parse_capture(data: bytes, name: str) -> Capture:
    """The content of a C3D file from its bytes.

    Parameters
    ----------
    data : bytes
    name : str
        The file's name, for messages.

    Raises
    ------
    InputError
        It is no C3D file, is cut off, or its header claims what it does not hold.
    """
    check_c3d(data, name)
    parameters = read_parameters(data, name, (data[0] - 1) * BLOCK)
    layout = layout_of(data, name, parameters)
    word = parameters.processor.dtype("f4" if layout.real else "i2")
    count = layout.frames * layout.words_per_frame
    words = np.frombuffer(data, word, count, layout.start)
    return Capture(
        name=name,
        header=data[:BLOCK],
        parameters=parameters,
        layout=layout,
        words=words.reshape(layout.frames, layout.words_per_frame),
        point_labels=_labels(parameters, "POINT", layout.points),
        analog_labels=_labels(parameters, "ANALOG", layout.channels),
    )


def _labels(parameters: Parameters, group: str, count: int) -> tuple[str, ...]:
    """Labels of points or channels; those without one get a number."""
    given = list(parameters.texts(group, "LABELS")[:count])
    # Some programs write four letters as the label and the marker's name as the description.
    described = parameters.texts(group, "DESCRIPTIONS")[: len(given)]
    times, longer = Counter(given), Counter(described)
    for i, text in enumerate(described):
        if given[i] and times[given[i]] > 1 and text and longer[text] == 1 and text not in times:
            given[i] = text
    unnamed = [f"{group}_{i}" for i in range(len(given) + 1, count + 1)]
    return (*given, *unnamed)
