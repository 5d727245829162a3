"""Plan of a test of a relaxed arm: subject, number of trials, duration."""

from __future__ import annotations

from typing import Final, NamedTuple, get_args

import numpy as np

from armimpedance.core.errors import InputError
from manipulandum_sim.passive.drive import Test
from manipulandum_sim.passive.subject import PassiveSubject, find_passive_subject

#: (trials, frames of each) of the source's tests.
SIZES: Final = {"p5": (1, 700), "release": (4, 275)}


class Plan(NamedTuple):
    """Trials of one or more recordings, simulated together."""

    test: Test
    subject: PassiveSubject
    trials: int
    frames: int
    rate_hz: float


def plan_of(
    test: Test,
    subject: str | PassiveSubject,
    trials: int | None,
    duration_s: float | None,
    rate_hz: float,
) -> Plan:
    """The plan of a test, in the source's size where none is asked for.

    Raises
    ------
    InputError
        Unknown test or subject, or a number that makes no recording.
    """
    if test not in SIZES:
        raise InputError(f"no passive test {test!r}", expected=" or ".join(get_args(Test)))
    if not (np.isfinite(rate_hz) and 1 <= rate_hz <= 1000):
        raise InputError(f"{rate_hz} frames/s", expected="1 to 1000")
    usual, frames = SIZES[test]
    if duration_s is None:
        frames = round(frames * rate_hz / 30)
    elif not (np.isfinite(duration_s) and duration_s * rate_hz >= 2):
        raise InputError(f"trials of {duration_s} s", expected="two frames or more")
    else:
        frames = round(duration_s * rate_hz)
    if trials is not None and trials < 1:
        raise InputError(f"{trials} trials", expected="1 or more")
    return Plan(test, find_passive_subject(subject), trials or usual, frames, rate_hz)
