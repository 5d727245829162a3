"""Ask a fitted model what joint or hand impedance it predicts where nobody measured."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import NUMBERED_JOINTS, PLANAR_JOINTS
from armimpedance.core.described import Meaning
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
from armimpedance.muscles.show.rows_csv import joined, read_activations, read_postures
from armimpedance.show.verbs.results import PathLike

if TYPE_CHECKING:
    from armimpedance.core.arrays import FloatArray


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
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> names = [f"posture_{i:02d}" for i in range(1, 11)]
    >>> recording, _ = simulate("postures", seed=1, sets=1, conditions=names)
    >>> model = ai.fit_posture(ai.to_joint(ai.estimate(recording)), order=1)
    >>> predicted = ai.predict(model, postures=[[1.0, 1.5]])
    >>> predicted.to_frame()[["K_11", "sd_K_11", "extrapolated"]].round(1)
       K_11  sd_K_11  extrapolated
    0  24.9      7.5             1
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


#: No joint of an arm turns so far: larger angles are degrees.
_MOST_RAD: Final = 2 * np.pi


def _postures(given: ArrayLike | PathLike | None) -> FloatArray | None:
    if given is None:
        return None
    file = given if isinstance(given, str | os.PathLike) else None
    postures = np.atleast_2d(
        np.asarray(given, dtype=float) if file is None else read_postures(Path(file))
    )
    largest = float(np.abs(postures).max(initial=0.0))
    if np.isfinite(largest) and largest > _MOST_RAD:
        raise InputError(
            f"a joint angle of {largest:g} rad", file=file, expected="radians: 60 degrees are 1.047"
        )
    return postures


def _activations(given: ArrayLike | PathLike | None, model: Any) -> FloatArray | None:
    if isinstance(given, str | os.PathLike):
        return read_activations(Path(given), len(model.muscles))
    return None if given is None else np.atleast_2d(np.asarray(given, dtype=float))


# Moment arms over posture and muscles' stiffness over activation, as `predict` writes them.

#: An angle this far beyond the range is still inside (rounding in a file).
_EDGE_RAD = 1e-6


#: What the columns of single muscles are; of one joint the muscles alone stand in the header.
OF_MUSCLES: Final = {
    "r_{}_m": Meaning("moment arm: {}", "m"),
    "K_{}_N_per_m": Meaning("stiffness of {}", "N/m"),
    "dK_{}_N_per_m": Meaning("stiffness that activation adds: {}", "N/m"),
    "extrapolated": Meaning("whether the arm is not known at this posture: 0 or 1"),
}


def moment_arm_rows(args: argparse.Namespace) -> tuple[list[dict[str, Any]], int]:
    """Moment arms at postures, OpenSim's sign: ``r = -dL/dq``, m.

    `args`: `model`: an arm's name, its table, or a model of muscles; `postures`; `joint`.
    Returns: `rows`: angles and ``r_<joint>_<muscle>_m``; for one joint the muscles alone, as
    OpenSim's analysis.
    `outside`: postures that the arm is not known at.
    Raises InputError: a file cannot be read, or the model holds no moment arms of single muscles.
    """
    import numpy as np

    from armimpedance.muscles.models import angle_columns
    from armimpedance.muscles.show.rows_csv import read_postures

    q = read_postures(args.postures)
    muscles, lengthening, limits = _moment_arms(args.model, q)
    n = q.shape[1]
    joints = PLANAR_JOINTS if n == len(PLANAR_JOINTS) else NUMBERED_JOINTS[:n]
    if args.joint is not None and args.joint not in joints:
        problem = f"--joint {args.joint} of an arm of {n} joints"
        raise InputError(problem, expected=" or ".join(joints))
    arms = -lengthening
    beyond = np.maximum(limits[:, 0] - q, q - limits[:, 1]).max(axis=1)
    outside = [float(angle) > _EDGE_RAD for angle in beyond]
    if args.joint is not None:
        column = joints.index(args.joint)
        rows = [dict(zip(muscles, row, strict=True)) for row in arms[..., column].tolist()]
        return rows, sum(outside)
    names = [f"r_{joint}_{muscle}_m" for joint in joints for muscle in muscles]
    rows = [
        {
            **dict(zip(angle_columns(n), angles.tolist(), strict=True)),
            **dict(zip(names, row.T.ravel().tolist(), strict=True)),
            "extrapolated": int(far),
        }
        for angles, row, far in zip(q, arms, outside, strict=True)
    ]
    return rows, sum(outside)


def _moment_arms(source: Path, q: FloatArray) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Muscles, ``dL/dq`` (P, m, 2), and the range (2, 2) of each angle that it holds for, rad."""
    from armimpedance.limb.arm import arm_named
    from armimpedance.muscles.models import MuscleModel, read_model

    def checked(joints: int) -> None:
        if q.shape[1] != joints:
            problem = f"postures of {q.shape[1]} joints"
            raise InputError(problem, expected=f"{joints}, as {source.name}")

    if source.suffix != ".json":
        arm = arm_named(str(source))
        checked(arm.paths.joints)
        return arm.paths.muscles, arm.paths.moment_arms(q), arm.angle_range
    model = read_model(source)
    if not isinstance(model, MuscleModel):
        expected = "a model of the kind muscles, an arm's name or a table of moment arms"
        raise InputError("no moment arms of single muscles", file=source, expected=expected)
    checked(len(model.box))
    return model.muscles, model.paths.moment_arms(q), model.box


def muscle_rows(args: argparse.Namespace) -> list[dict[str, Any]]:
    """Stiffness of each muscle at activations, N/m.

    `args`: `model`: a fitted model of single muscles; `activations`.
    Returns: ``alpha_i``, then ``K_<muscle>_N_per_m``; with ``sd_`` where the model tells it. A
    model of one posture tells what activation adds, then they are ``dK_<muscle>_N_per_m``.
    Raises InputError: a file cannot be read, or the model has no single muscles.
    """
    from armimpedance.muscles.models import ActivationModel, MuscleModel, read_model
    from armimpedance.muscles.show.rows_csv import read_activations

    model = read_model(args.model)
    if not isinstance(model, ActivationModel | MuscleModel):
        expected = "a model of the kind activation or muscles"
        raise InputError("no single muscles", file=args.model, expected=expected)
    alpha = read_activations(args.activations, len(model.muscles))
    symbol = "dK" if isinstance(model, ActivationModel) else "K"
    names = [f"{symbol}_{muscle}_N_per_m" for muscle in model.muscles]
    columns = dict(zip(names, model.muscle_stiffness(alpha).T, strict=True))
    if isinstance(model, ActivationModel):
        sds = model.muscle_stiffness_sd(alpha).T
        columns |= {f"sd_{name}": sd for name, sd in zip(names, sds, strict=True)}
    known = {f"alpha_{i}": a for i, a in enumerate(alpha.T, start=1)} | columns
    return [{name: float(values[p]) for name, values in known.items()} for p in range(len(alpha))]
