"""Arm and noise from a pilot recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import IntArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.hand.planning.noise_level import PilotNoise
from armimpedance.hand.planning.precision import Precision
from armimpedance.hand.planning.setting import PlannedArm, Setting
from armimpedance.hand.still import (
    FEWEST_TRIALS,
    Model,
    bound_of,
    elbow_told,
)
from armimpedance.numerics.signals import cut_windows, disturbance_times


@dataclass(frozen=True)
class Pilot:
    """Results of a pilot.

    `setting`: the setting with its arm and noise.
    `precision`: predicted precision of more trials like the pilot's.
    `duration_s`, `amplitude_m`: duration and amplitude of its disturbances, medians over trials.
    `warnings`: facts that the plan cannot take into account.
    """

    setting: Setting
    precision: Precision
    duration_s: float
    amplitude_m: float
    warnings: tuple[str, ...] = ()


def pilot_of(recording: Recording, condition: str | None = None) -> Pilot:
    """Fit one condition of a pilot.

    Parameters
    ----------
    recording : Recording
    condition : str, optional
        Default: that of the first trial.

    Returns
    -------
    Pilot

    Raises
    ------
    InputError
        If it is not of returning disturbances of the hand in two or three axes, has no such
        condition or too few trials, or its matrices are not those of an arm.
    NotIdentifiableError
        If its motion does not determine M, B, K.
    """
    if recording.kind != "hand" or recording.axes < 2 or recording.perturbation != "returning":
        raise InputError(
            f"a pilot of {recording.perturbation} disturbances, {recording.kind}, "
            f"{recording.axes} axes",
            expected="returning disturbances of the hand in two or three axes",
        )
    names = recording.trials["condition"].astype(str)
    wanted = names.iloc[0] if condition is None else condition
    rows = np.flatnonzero(names == wanted)
    if not len(rows):
        examples = ", ".join(names.unique()[:5])
        raise InputError(
            f"no condition {wanted!r}", column="condition", expected=f"such as {examples}"
        )
    window = cut_windows(recording, rows, disturbance_times(recording))
    if window.usable.sum() < FEWEST_TRIALS:
        raise InputError(
            f"{wanted}: {int(window.usable.sum())} usable trials",
            expected=f"{FEWEST_TRIALS} or more, better a set of all directions",
        )
    model, d = Model.of(window, "hand"), recording.axes
    arm = PlannedArm(model.parameters.reshape(3, d, d), f"pilot, {wanted}")
    setting = Setting(
        arm,
        PilotNoise.of(model.found_noise, window),
        sample_rate_hz=float(recording.sample_rate_hz),
    )
    moved = window.position - window.position_at_onset[:, None]
    reached = np.linalg.norm(moved[window.usable], axis=2).max(axis=1)
    return Pilot(
        setting,
        _precision(model),
        duration_s=float(np.median(window.duration_s[window.usable])),
        amplitude_m=float(np.median(reached)),
        warnings=_warnings(recording, rows),
    )


def _precision(model: Model) -> Precision:
    """Predicted precision of more trials like those of the pilot.

    Raises NotIdentifiableError: the pilot's noise has swamped its motion.
    """
    d, bound = model.equation.axes, bound_of(model.equations)
    if bound is None:
        raise NotIdentifiableError("the pilot's noise has swamped its motion")
    trials = model.equation.trials
    knowledge = model.knowledge().times(1 / trials)
    return Precision(model.parameters.reshape(3, d, d), bound * trials, knowledge)


def _warnings(recording: Recording, rows: IntArray) -> tuple[str, ...]:
    if recording.axes == 2 or elbow_told(recording, rows) == "held":
        return ()
    return (
        "elbow not held: the plan is for the stiffness that a short disturbance meets, not for "
        "that at rest, and a free elbow makes the intervals of `estimate` wider; hold the elbow, "
        "or use disturbances that stay out for 0.3 s (docs/explanation/space.md)",
    )
