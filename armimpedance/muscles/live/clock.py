"""Time stamps of a stream that nobody can trust: late, repeated, ahead, begun anew."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError

#: A stamp further ahead is refused, unless the ones after it agree (s): one wrong packet would
#: otherwise make all that follow late.
LONGEST_GAP_S: Final = 10.0
#: So many stamps in a row that follow each other, away from the others, begin the stream anew.
AGREEING: Final = 20


@dataclass(frozen=True, slots=True)
class Tick:
    """When a sample is.

    Attributes
    ----------
    time_s : float
    step_s : float
        Since the sample before; the nominal step at the first one.
    gap : bool
        Samples are missing before it.
    anew : bool
        The first one, or the sender has begun anew.
    """

    time_s: float
    step_s: float
    gap: bool
    anew: bool


class Clock:
    """Gives each sample its time, or refuses it.

    Parameters
    ----------
    rate_hz : float
        Nominal rate of the samples.
    """

    def __init__(self, rate_hz: float) -> None:
        self._step = 1 / rate_hz
        self._last: float | None = None
        self._elsewhere: float | None = None
        self._agreeing = 0

    def next(self, stamp_s: float | None) -> Tick:
        """The time of the next sample.

        Parameters
        ----------
        stamp_s : float or None
            None where samples bear no time: they are then a nominal step apart from 0 on.

        Raises
        ------
        InputError
            A stamp that is not finite, repeated, earlier than the last, or far ahead.
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
