"""A person as the prior of `fit muscles` has it: what a calibration can be planned for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.combined.equations import MuscleEquations
from armimpedance.muscles.models.combined.fit import prior_of, start_of
from armimpedance.muscles.models.combined.lengths import corrected_lengths


@dataclass(frozen=True)
class TypicalMuscles:
    """The equations of an arm with likely parameters, before anything was measured.

    Attributes
    ----------
    equations : MuscleEquations
    values : (n,)
        The parameters where the search for a person's begins.
    prior_sd : (n,)
        Standard deviations of the parameters before anything was measured.
    """

    equations: MuscleEquations
    values: FloatArray
    prior_sd: FloatArray


def typical_muscles(
    arm: MuscularArm,
    joint_angles: FloatArray,
    activation: FloatArray,
    *,
    moment_arm_order: int = 2,
    activation_order: int = 1,
    prior_percent: float = 20.0,
) -> TypicalMuscles:
    """The form that `fit_muscle_model` would fit to such conditions.

    Parameters
    ----------
    arm : MuscularArm
    joint_angles : (P, n)
        rad.
    activation : (P, m)
        0..1.
    moment_arm_order, activation_order, prior_percent
        As for `fit_muscle_model`.

    Returns
    -------
    TypicalMuscles

    Raises
    ------
    InputError
        Other joints or muscles than the arm's, or a muscle that is never active.
    """
    if joint_angles.shape[1] != arm.paths.joints:
        problem = f"postures of {joint_angles.shape[1]} joints, an arm of {arm.paths.joints}"
        raise InputError(problem, expected="an arm with the postures' joints")
    highest = activation.max(axis=0)
    if not (highest > 0).all():
        name = arm.paths.muscles[int(highest.argmin())]
        raise InputError(f"{name} is never active", expected="a level of co-contraction above 0")
    lengths = corrected_lengths(
        arm, joint_angles, order=moment_arm_order, prior_part=prior_percent / 100
    )
    kappa = arm.stiffness_per_tension
    equations = MuscleEquations(lengths, activation_order, highest, kappa, True)
    prior = prior_of(equations, arm, 0.1, torque=False)
    return TypicalMuscles(equations, start_of(equations, prior), np.asarray(prior.sd))
