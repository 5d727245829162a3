"""What one file of a Kinarm exam holds, whichever format it came in."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.recordings.c3d_file import C3DFile
from armimpedance.recordings.c3d_parameters import Groups, HasParameters

#: Channels of 32 bits that are no number: they stand in the files as if they were one.
STATUS_WORD: Final = re.compile(r"(Right|Left)_FS_Status")

#: Samples as they are held: single precision wherever that is exact, as it is in the files.
Samples = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class ExamFile(HasParameters):
    """A trial of an exam, or what all trials share.

    Attributes
    ----------
    name : str
        For messages.
    parameters : mapping of mapping
        Group -> name -> parameter, all names in capitals.
    rate_hz : float
        Samples per second.
    frames : int
        Number of samples F of every channel.
    hands : mapping
        Such as `Right_Hand` -> places (F, 2) in m.
    channels : mapping
        Label -> samples (F,) in the unit of the file; the channels that were asked for.
    others : tuple of str
        Labels of the channels that are there and were not read.
    acknowledgements : int
        How many frames of the screen have a time at which they were shown.
    """

    name: str
    parameters: Groups
    rate_hz: float
    frames: int
    hands: Mapping[str, Samples]
    channels: Mapping[str, Samples]
    others: tuple[str, ...] = ()
    acknowledgements: int = 0

    def samples(self, label: str) -> FloatArray:
        """One channel, (F,), in double precision; a status word as the whole number that it is."""
        values = self.channels[label]
        if STATUS_WORD.fullmatch(label) and values.dtype == np.float32:
            values = np.ascontiguousarray(values).view(np.uint32)
        return _doubled(values)

    def columns(self, labels: Iterable[str]) -> FloatArray:
        """Channels side by side, (F, number of labels), finite or not."""
        return np.column_stack([self.samples(label) for label in labels])

    def place(self, hand: str) -> FloatArray:
        """Where a hand was, (F, 2) in m."""
        return _doubled(self.hands[hand])

    def same_samples(self, other: ExamFile) -> bool:
        """Whether all channels that were read are the same, number by number."""
        same = self.channels.keys() == other.channels.keys()
        return same and all(
            np.array_equal(self.samples(label), other.samples(label)) for label in self.channels
        )


def joined(files: Sequence[ExamFile], parts: Iterable[Samples], width: int = 0) -> FloatArray:
    """Something of each file, one after another, without a second copy of the whole.

    Parameters
    ----------
    files : sequence of ExamFile
    parts : iterable of (F,) or (F, width)
        One for each file, made when it is its turn.
    width : int
        Columns of the parts; 0: they are (F,).

    Returns
    -------
    (N,) or (N, width)
    """
    frames = sum(file.frames for file in files)
    whole = np.empty((frames, width) if width else frames)
    at = 0
    for part in parts:
        whole[at : at + len(part)] = part
        at += len(part)
    return whole


def anything(values: Samples) -> bool:
    """Whether any of these is not zero; what is no number is not."""
    with np.errstate(invalid="ignore"):
        return bool(values.any())


def _doubled(values: NDArray[Any]) -> FloatArray:
    # Of what is no number, some bits are turned: the check for such comes after.
    with np.errstate(invalid="ignore"):
        return values.astype(np.float64)


def held(values: Samples) -> Samples:
    """The same numbers in as little memory as they need.

    An exam is hundreds of megabytes of single-precision numbers, and half of its channels are the
    zeros of sensors that are not there.
    """
    bits = values.view(f"u{values.itemsize}") if values.flags.c_contiguous else values
    if not bits.any():
        return np.broadcast_to(np.float32(0.0), values.shape)
    with np.errstate(over="ignore", invalid="ignore"):
        single = values.astype(np.float32)
    return single if np.array_equal(single, values, equal_nan=True) else values.copy()


def from_c3d(c3d: C3DFile) -> ExamFile:
    """A file of an exam from the C3D file that it is.

    Parameters
    ----------
    c3d : C3DFile

    Raises
    ------
    InputError
        Its channels are not sampled once per frame, as all channels of an exam are.
    """
    if c3d.frames and c3d.samples_per_frame != 1:
        problem = f"{c3d.samples_per_frame} analog samples per frame"
        raise InputError(problem, file=c3d.name, expected="1, as Dexterit-E writes it")
    # Of two channels of one name the first one counts.
    labels = {label: i for i, label in reversed(list(enumerate(c3d.analog_labels)))}
    points = {label: i for i, label in reversed(list(enumerate(c3d.point_labels)))}
    return ExamFile(
        name=c3d.name,
        parameters=c3d.parameters,
        rate_hz=c3d.rate_hz,
        frames=c3d.frames,
        hands={label: held(c3d.points[:, i, :2]) for label, i in points.items()},
        channels={n: held(_column(c3d, n, i)) for n, i in labels.items()},
        others=c3d.other_labels,
    )


def _column(c3d: C3DFile, label: str, index: int) -> Samples:
    """One channel of a C3D file, in its unit; of a status word the bits as they are stored."""
    is_word = STATUS_WORD.fullmatch(label) and c3d.stored.dtype == np.float32
    return np.ascontiguousarray((c3d.stored if is_word else c3d.analog)[:, index])
