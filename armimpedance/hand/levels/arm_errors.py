"""What is not known of the arm itself, in the covariance of an estimate that was mapped with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.records import ImpedanceEstimate, Subject
from armimpedance.limb.arm import arm_of

#: Step of a difference, in standard deviations: the hand must stay within reach.
_STEP: Final = 0.05

_LENGTHS_FROM_HEIGHT: Final = (
    "lengths: taken from the body's height, how well they fit cannot be told; a segment that is "
    "5 % longer makes K_j some 10 % larger: give upper_arm_m and forearm_hand_m with length_sd_m"
)


def with_arm_errors(
    mapped: Callable[[Subject | None], ImpedanceEstimate], subject: Subject | None
) -> ImpedanceEstimate:
    """An estimate mapped with a subject's arm, its covariance with what is not known of the arm.

    Where the subject says how well its mass and lengths are known, each adds ``s^2 d d^T``, with d
    how M, B, K change with it: the whole way is made again with a little more and a little less of
    it, the posture from a hand's position among it.

    Parameters
    ----------
    mapped : function
        From a subject to the estimate mapped with its arm.
    subject : Subject or None

    Returns
    -------
    ImpedanceEstimate
        With a warning where lengths come from the height alone, and nothing says how well.
    """
    made = mapped(subject)
    if subject is None:
        return made
    covariance, shared = np.array(made.covariance), dict(made.shared_errors)
    for name, less, more in _neighbours(subject):
        # d (3 k^2,) for one standard deviation of one measure
        d = (mapped(more).parameters - mapped(less).parameters) / (2 * _STEP)
        covariance += np.outer(d, d)
        shared[name] = d
    made = replace(made, covariance=covariance, shared_errors=shared)
    guessed = subject.upper_arm_m is None or subject.forearm_hand_m is None
    if guessed and subject.length_sd_m is None:
        return made.with_warning(_LENGTHS_FROM_HEIGHT)
    return made


def _neighbours(subject: Subject) -> Iterator[tuple[str, Subject, Subject]]:
    """Each measure that has an sd, the subject with a little less of it and with a little more."""
    if subject.mass_kg is not None and subject.mass_sd_kg is not None:
        step = _STEP * subject.mass_sd_kg
        yield (
            "mass_kg",
            replace(subject, mass_kg=subject.mass_kg - step),
            replace(subject, mass_kg=subject.mass_kg + step),
        )
    if subject.length_sd_m is None:
        return
    step = _STEP * subject.length_sd_m
    arm = arm_of(subject if subject.mass_kg else replace(subject, mass_kg=1.0))
    lengths = {"upper_arm_m": arm.upper_arm_m, "forearm_hand_m": arm.forearm_hand_m}
    for name, length in lengths.items():
        yield (
            name,
            replace(subject, **{**lengths, name: length - step}),  # type: ignore[arg-type]
            replace(subject, **{**lengths, name: length + step}),  # type: ignore[arg-type]
        )
