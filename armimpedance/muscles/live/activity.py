"""Activation of the muscles as the samples bring it: a lost channel is held and doubted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError

# Time stamps of a stream that nobody can trust: late, repeated, ahead, begun anew.

#: A stamp further ahead is refused, unless the ones after it agree (s): one wrong packet would
#: otherwise make all that follow late.
LONGEST_GAP_S: Final = 10.0
#: So many stamps in a row that follow each other, away from the others, begin the stream anew.
AGREEING: Final = 20


@dataclass(frozen=True, slots=True)
class Tick:
    """When a sample is.

    `step_s`: since the sample before; the nominal step at the first one.
    `gap`: samples are missing before it.
    `anew`: the first one, or the sender has begun anew.
    """

    time_s: float
    step_s: float
    gap: bool
    anew: bool


class StreamClock:
    """Gives each sample its time, or refuses it.

    `rate_hz`: nominal rate of the samples.
    """

    def __init__(self, rate_hz: float) -> None:
        self._step = 1 / rate_hz
        self._last: float | None = None
        self._elsewhere: float | None = None
        self._agreeing = 0

    def next(self, stamp_s: float | None) -> Tick:
        """The time of the next sample.

        `stamp_s`: None where samples bear no time: they are then a nominal step apart from 0 on.
        Raises InputError: a stamp that is not finite, repeated, earlier than the last, or far
        ahead.
        """
        last = self._last
        if stamp_s is None:
            stamp_s = 0.0 if last is None else last + self._step
        if not abs(stamp_s) < 1 / np.finfo(float).eps:
            raise InputError(f"a time stamp of {stamp_s:g}", expected="seconds")
        if last is None:
            return self._take(stamp_s, self._step, gap=False, anew=True)
        ahead = stamp_s - last
        if 0 < ahead <= LONGEST_GAP_S:
            return self._take(stamp_s, ahead, gap=ahead > 1.5 * self._step, anew=False)
        return self._astray(stamp_s, last)

    def _take(self, stamp_s: float, step_s: float, *, gap: bool, anew: bool) -> Tick:
        self._last, self._elsewhere, self._agreeing = stamp_s, None, 0
        return Tick(stamp_s, step_s, gap, anew)

    def _astray(self, stamp_s: float, last: float) -> Tick:
        before, self._elsewhere = self._elsewhere, stamp_s
        follows = before is not None and 0 < stamp_s - before <= LONGEST_GAP_S
        self._agreeing = self._agreeing + 1 if follows else 1
        if self._agreeing >= AGREEING:
            return self._take(stamp_s, self._step, gap=True, anew=True)
        where = "ahead of" if stamp_s > last else "not after"
        raise InputError(
            f"a time stamp of {stamp_s:.9g} s, {where} the last at {last:.9g} s",
            expected="one that follows it",
        )


#: A muscle that nobody sees may be anywhere in its range after this time (s).
FORGOTTEN_S: Final = 0.25
#: Standard error of such an activation, as a part of the range that the model was fitted to.
UNKNOWN: Final = 0.5
#: Activations in this range are taken, and cut to 0..1: a maximum contraction is known to some
#: per cent, and noise that is taken off may be too much.
TAKEN: Final = (-0.05, 1.2)


@dataclass(frozen=True, slots=True)
class Activity:
    """Activation (m,), each 0..1, its standard error (m,), and what is wrong with it."""

    alpha: FloatArray
    sd: FloatArray
    flags: list[str]


class Channels(Protocol):
    """Channels that turn the numbers of a sample, one a muscle, into activations."""

    @property
    def signal(self) -> str:
        """Name of the numbers in a packet."""

    @property
    def delay_s(self) -> float:
        """Delay of the activations, s."""

    def reset(self) -> None:
        """Forget all samples."""

    def take(self, values: FloatArray, sd: FloatArray, tick: Tick) -> Activity:
        """The activations at a sample; NaN where a channel dropped out."""


class HeldActivity:
    """The last good activation of each muscle, with the error that grows while it is lost.

    `highest` (m,): range of each activation in the model.
    """

    def __init__(self, highest: FloatArray) -> None:
        self._unknown = UNKNOWN * highest
        self._good, self._sd = highest / 2, np.zeros(len(highest))
        # nothing was seen yet: as unknown as can be
        self._lost_s = np.full(len(highest), FORGOTTEN_S)

    def put_back(self, activation: FloatArray, where: BoolArray) -> None:
        """Hold these activations (m,) instead: what was last taken was wrong already."""
        self._good = np.where(where, activation.clip(0.0, 1.0), self._good)

    def take(
        self, activation: FloatArray, sd: FloatArray, lost: BoolArray, step_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Activation (m,), each 0..1, and its standard error, for a sample `step_s` after the last.

        `lost` (m,) bool.
        `activation`, `sd` (m,): of any value where `lost`.
        """
        if not lost.any():
            self._good, self._sd = activation.clip(0.0, 1.0), sd
            self._lost_s[:] = 0.0
            return self._good, sd
        self._good = np.where(lost, self._good, activation.clip(0.0, 1.0))
        self._sd = np.where(lost, self._sd, sd)
        self._lost_s = np.where(lost, np.minimum(self._lost_s + step_s, FORGOTTEN_S), 0.0)
        return self._good, np.hypot(self._sd, self._unknown * self._lost_s / FORGOTTEN_S)


class ActivationChannels:
    """Samples that hold activations.

    `muscles` (m,) tuple of str.
    `highest` (m,): range of each activation in the model.
    """

    signal, delay_s = "activation", 0.0

    def __init__(self, muscles: tuple[str, ...], highest: FloatArray) -> None:
        self._muscles, self._highest = muscles, highest
        self.reset()

    def reset(self) -> None:
        """Forget all samples."""
        self._held = HeldActivity(self._highest)

    def take(self, values: FloatArray, sd: FloatArray, tick: Tick) -> Activity:
        """The activations at a sample; one that is missing or far outside of 0..1 is held."""
        # written so that NaN is lost
        lost = ~((values >= TAKEN[0]) & (values <= TAKEN[1]))
        alpha, sd = self._held.take(values, sd, lost, tick.step_s)
        return Activity(alpha, sd, [f"lost: {self._muscles[i]}" for i in np.flatnonzero(lost)])
