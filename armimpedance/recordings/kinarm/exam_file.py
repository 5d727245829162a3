"""What one file of a Kinarm exam holds, whichever format it came in."""

from __future__ import annotations

import mmap
import re
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.recordings.c3d_file import C3DFile
from armimpedance.recordings.c3d_parameters import Groups, HasParameters

#: Channels of 32 bits that are no number: they stand in the files as if they were one.
STATUS_WORD: Final = re.compile(r"(Right|Left)_FS_Status")

#: What is mapped for a channel at once: 17 minutes at 1 kHz.
ROOM_BYTES: Final = 4 * 1024**2

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

    def without(self, labels: Container[str]) -> ExamFile:
        """The same without these channels and hands."""
        channels, hands = (
            {name: samples for name, samples in each.items() if name not in labels}
            for each in (self.channels, self.hands)
        )
        return replace(self, channels=channels, hands=hands)

    def same_samples(self, other: ExamFile) -> bool:
        """Whether all channels that were read are the same, number by number."""
        same = self.channels.keys() == other.channels.keys()
        return same and all(
            np.array_equal(self.samples(label), other.samples(label)) for label in self.channels
        )


def joined(frames: Sequence[int], parts: Iterable[Samples], width: int = 0) -> FloatArray:
    """Something of each trial, one after another, without a second copy of the whole.

    Parameters
    ----------
    frames : sequence of int
        Number of samples F of each trial.
    parts : iterable of (F,) or (F, width)
        One of each trial, made when it is its turn.
    width : int
        Columns of the parts; 0: they are (F,).

    Returns
    -------
    (N,) or (N, width)
    """
    whole = np.empty((sum(frames), width) if width else sum(frames))
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


class Store:
    """Room for the samples of an exam, a hundred thousand short arrays: single precision where that
    is exact, nothing for the zeros of sensors that are not there.

    Each channel has rooms of its own, mapped from the system one by one: a channel that nobody
    holds any more gives its memory back, which the pieces of a heap would not.
    """

    def __init__(self) -> None:
        self._rooms: dict[str, NDArray[np.float32]] = {}

    def keep(self, label: str, values: Samples) -> Samples:
        """The same numbers, (F, ...), where they need little memory.

        Parameters
        ----------
        label : str
            The channel.
        values : (F, ...)
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
        taken, self._rooms[label] = room[: single.size], room[single.size :]
        taken[:] = single.ravel()
        return taken.reshape(values.shape)


def from_c3d(c3d: C3DFile, store: Store) -> ExamFile:
    """A file of an exam from the C3D file that it is.

    Parameters
    ----------
    c3d : C3DFile
    store : Store
        Where the samples are kept.

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
        hands={n: store.keep(n, c3d.points[:, i, :2]) for n, i in points.items()},
        channels={n: store.keep(n, _column(c3d, n, i)) for n, i in labels.items()},
        others=c3d.other_labels,
    )


def _column(c3d: C3DFile, label: str, index: int) -> Samples:
    """One channel of a C3D file, in its unit; of a status word the bits as they are stored."""
    is_word = STATUS_WORD.fullmatch(label) and c3d.stored.dtype == np.float32
    return np.ascontiguousarray((c3d.stored if is_word else c3d.analog)[:, index])
