"""Ask a fitted model what joint or hand impedance it predicts where nobody measured."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.levels import Elbow, Whose, arm_of_whose, moving_joints
from armimpedance.muscles.models import (
    FittedModel,
    HandPrediction,
    JointPrediction,
    at_hand as predicted_at_hand,
    kind_of,
    read_model,
)
from armimpedance.muscles.show.prediction_csv import joined, read_activations, read_postures
from armimpedance.show.verbs.sources import PathLike


def predict(
    model: FittedModel | PathLike,
    *,
    postures: ArrayLike | PathLike | None = None,
    activations: ArrayLike | PathLike | None = None,
) -> JointPrediction:
    """Predict joint stiffness and viscosity, with 95 % intervals, from a fitted model.

    Parameters
    ----------
    model : PostureModel, ActivationModel, MuscleModel or path
        The path is that of a MODEL.json.
    postures : (P, n) or path, optional
        Angles of shoulder and elbow, rad, or a table with the columns `q_shoulder_rad` and
        `q_elbow_rad`; of n joints `q_1_rad` to `q_n_rad`.
    activations : (P, m) or path, optional
        Activation of each muscle, 0..1, or a table with the columns `alpha_1 …`. Given both, row
        goes with row; a single row goes with all rows of the other.

    Returns
    -------
    JointPrediction
        With what is extrapolated, and why.

    Raises
    ------
    InputError
        A file cannot be read, or postures or activations are missing, or given to a model that
        has none.

    Examples
    --------
    >>> from armimpedance.muscles.show import predict
    >>> predict("nowhere.json", postures=[[1.0, 1.5]])
    Traceback (most recent call last):
    armimpedance.core.errors.InputError: nowhere.json: cannot be read: No such file or directory
    """
    file = model if isinstance(model, str | os.PathLike) else None
    made = read_model(Path(file)) if file is not None else cast(FittedModel, model)
    kind = kind_of(made)
    for name, given in (("postures", postures), ("activations", activations)):
        if (name in kind.needs) != (given is not None):
            problem = f"a {kind.name} model {'without' if name in kind.needs else 'with'} {name}"
            raise InputError(problem, file=file, expected=" and ".join(kind.needs))
    q, alpha = joined(_postures(postures), _activations(activations, made))
    arguments = [given for given in (q, alpha) if given is not None]
    predicted: JointPrediction = cast(Any, made).predict(*arguments)
    return predicted


def at_hand(
    predicted: JointPrediction,
    *,
    recording: Whose,
    force_N: ArrayLike | None = None,
    elbow: Elbow | None = None,
) -> HandPrediction:
    """Carry a predicted joint impedance to the hand: compliances add.

    ``K_e = (J (K_j + Gamma(F) + dg/dq)^-1 J^T)^-1``, in the plane
    ``J^-T (K_j + Gamma(F) + dg/dq) J^-1``.

    Parameters
    ----------
    predicted : JointPrediction
        What `predict` returned.
    recording : Recording, Subject or path
        Whose arm's lengths, and how gravity acts on it.
    force_N : (d,) or (P, d), optional
        Force by the hand on its environment; none: no force.
    elbow : {"held", "free"}, optional
        In space: whether the upper arm is kept from turning about its own axis. Default: what the
        recording's column `elbow` says, else free.

    Returns
    -------
    HandPrediction
        Stiffness and viscosity of the hand with their covariance.

    Raises
    ------
    InputError
        The recording cannot be read, its subject has neither lengths nor height, or the force has
        another shape.
    NotIdentifiableError
        The arm is stretched in a posture.

    Examples
    --------
    >>> from armimpedance.muscles.show import at_hand
    >>> from armimpedance.muscles.models import JointPrediction
    >>> from armimpedance.core.records import Subject
    >>> known = [[[0.0] * 3] * 3]
    >>> joint = JointPrediction(
    ...     [[1.0, 1.5]], [[15.0, 6.0, 16.0]], [[1.0, 0.4, 1.0]], known, known, 10.0, [False], [""]
    ... )
    >>> at_hand(joint, recording=Subject(height_m=1.75)).stiffness.round().tolist()
    [[78.0, -58.0, 246.0]]
    """
    joints = predicted.joint_angles.shape[1]
    arm, moving = arm_of_whose(recording, joints), moving_joints(joints, recording, elbow)
    return predicted_at_hand(predicted, arm, force_N, moving=moving)


def _postures(given: ArrayLike | PathLike | None) -> FloatArray | None:
    if isinstance(given, str | os.PathLike):
        return read_postures(Path(given))
    return None if given is None else np.atleast_2d(np.asarray(given, dtype=float))


def _activations(given: ArrayLike | PathLike | None, model: Any) -> FloatArray | None:
    if isinstance(given, str | os.PathLike):
        return read_activations(Path(given), len(model.muscles))
    return None if given is None else np.atleast_2d(np.asarray(given, dtype=float))
