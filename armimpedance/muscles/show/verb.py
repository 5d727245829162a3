"""Fit models of joint impedance over posture and muscle activation."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.core.workers import single_threaded
from armimpedance.hand.levels import Whose, arm_of_whose, moving_joints
from armimpedance.hand.show import estimates_of, read_results
from armimpedance.limb.arm import FREE_WRIST, LOCKED_WRIST, MuscularArm, SpatialArm
from armimpedance.muscles.models import (
    MODEL_KINDS,
    ActivationModel,
    FittedModel,
    HandRows,
    JointRows,
    MuscleModel,
    PostureModel,
    joint_rows,
    rows_of_hand,
)
from armimpedance.muscles.show.rows_csv import read_joint_rows
from armimpedance.show.verbs.results import PathLike, naming, read_recording

#: Rows of the joint level: a path or several of RESULTS.csv, estimates, or the rows themselves;
#: for muscles also those of a hand whose joints are all free.
Rows = JointRows | HandRows | PathLike | Sequence[PathLike] | Sequence[ImpedanceEstimate]

#: What is told of a model whose rows are in doubt together.
_IN_ALL_ROWS: Final = (
    "rows in doubt together: their estimates warn of {}, which makes all rows wrong alike; "
)
_ALLOWED: Final = "the intervals allow for it, and may still be too narrow: mend the record"
_NOT_ALLOWED: Final = (
    "the rows have no shared_errors that say by how much, so that the intervals do not hold it: "
    "mend the record, or take the intervals as several times too narrow"
)


@single_threaded
def fit_posture(
    rows: Rows,
    *,
    order: int = 2,
    model: str | None = None,
    box_deg: ArrayLike | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> PostureModel:
    """Fit joint stiffness and viscosity over posture at one activation.

    Moment arms are polynomials of order L in the joint angles, elements of K and B of order 2L;
    Tsuji (1997), eqs. (33)-(37).

    Parameters
    ----------
    rows : JointRows, Estimates, sequence of ImpedanceEstimate, path or paths
        At the joints, at (nearly) constant activation; a path is that of a RESULTS.csv.
    order : int
        L, from 0 to 6.
    model : {"sos", "separable", "box", "polynomial"}, optional
        "polynomial" is the source's least squares; the others are positive definite at every
        posture, "box" on the workspace only. Default: "sos", below order 2 "polynomial".
    box_deg : (2, 2), optional
        The workspace in degrees: of shoulder and elbow the lowest and the highest angle. Default:
        the measured range.
    seed : int
        Seed of the shuffles behind the null R.
    progress : function (done, all), optional
        Called with what is done and what there is to do.

    Returns
    -------
    PostureModel
        With what the fit is worth, element by element.

    Raises
    ------
    InputError
        A file cannot be read, there is no such model or order, a posture lies outside of the
        workspace, or there are fewer postures than coefficients.
    NotIdentifiableError
        The postures are one, lie on a line, or cannot tell some term.
    EstimationError
        The solver did not end with an optimal solution.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.muscles.show import fit_posture
    >>> from armimpedance.hand.levels.show import to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> names = [f"posture_{i:02d}" for i in range(1, 11)]
    >>> recording, _ = simulate("postures", seed=1, sets=1, conditions=names)
    >>> model = fit_posture(to_joint(estimate(recording)), order=1)
    >>> model.predict([1.0, 1.5]).stiffness.shape
    (1, 3)
    """
    box = None if box_deg is None else np.radians(np.asarray(box_deg, dtype=float)).reshape(2, 2)
    options = {"order": order, "model": model, "box": box, "seed": seed, "progress": progress}
    return cast(PostureModel, fit_model("moment-arms", rows, **options))


@single_threaded
def fit_activation(
    rows: Rows,
    *,
    arm: MuscularArm | str = "planar6",
    order: int = 1,
    model: str | None = None,
    torque: bool = False,
    increasing: bool = False,
    curvature: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> ActivationModel:
    """Fit joint stiffness and viscosity over the activation of the muscles at one posture.

    The stiffness of each muscle is a polynomial of order N of its activation; Tsuji (1997), eqs.
    (11), (31), (33)-(35), (38).

    Parameters
    ----------
    rows : JointRows, Estimates, sequence of ImpedanceEstimate, path or paths
        At the joints, with activations; a path is that of a RESULTS.csv.
    arm : MuscularArm or str
        The muscles: "planar6", "arm26" or the path of a table of moment arms.
    order : int
        N, from 1 to 5.
    model : {"polynomial", "bernstein"}, optional
        "polynomial" (default) is the source's least squares, "bernstein" keeps the stiffness of
        every muscle nonnegative.
    torque : bool
        Fit the joint torque too, stiffness being in proportion to tension.
    increasing : bool
        The stiffness grows with activation ("bernstein" only).
    curvature : bool
        False leaves out what tension adds through the curvature of the paths, as the source does.
    seed : int
        Seed of the shuffles behind the null R.
    progress : function (done, all), optional
        Called with what is done and what there is to do.

    Returns
    -------
    ActivationModel
        With what the fit is worth, element by element.

    Raises
    ------
    InputError
        A file cannot be read, rows have no activation or (where asked) no torque or more than one
        posture, or there is no such model, order or arm.
    NotIdentifiableError
        These conditions cannot tell the muscles apart.
    EstimationError
        The fit does not settle.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.muscles.show import fit_activation
    >>> from armimpedance.hand.levels.show import to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> hand = [*estimate(simulate("cocontraction", seed=1, sets=1)[0])]
    >>> recording, _ = simulate("force", seed=1, sets=1)
    >>> joint = to_joint([*hand, *estimate(recording)], recording=recording)
    >>> model = fit_activation(joint, order=1, torque=True)
    >>> model.predict([0.1] * 6).extrapolated.shape
    (1,)
    """
    options = {
        "arm": arm,
        "order": order,
        "model": model,
        "torque": torque,
        "increasing": increasing,
        "curvature": curvature,
        "seed": seed,
        "progress": progress,
    }
    return cast(ActivationModel, fit_model("activation", rows, **options))


@single_threaded
def fit_muscles(
    rows: Rows,
    *,
    recording: Whose | None = None,
    arm: MuscularArm | str = "planar6",
    order: int = 2,
    activation_order: int = 1,
    prior_percent: float = 20.0,
    torque: bool = False,
    curvature: bool = True,
    seed: int = 0,
    progress: Progress | None = None,
) -> MuscleModel:
    """Fit one model of posture and activation, with moment arms that keep to an arm's own.

    Parameters
    ----------
    rows : JointRows, Estimates, sequence of ImpedanceEstimate, path or paths
        At the joints, any postures and activations; a path is that of a RESULTS.csv.
    recording : Recording, Subject or path, optional
        Given, the rows are of the hand in three axes with a free elbow (and wrist, where seven
        angles are measured), which cannot be mapped to the joints one by one; it says whose arm it
        is, and how gravity acts.
    arm : MuscularArm or str
        The muscles whose moment arms are corrected: "planar6", "arm26", in space "myoarm4" or
        "myoarm7" (wrist locked, free), or the path of a table.
    order : int
        L of the corrections to the moment arms, from 0 to 3.
    activation_order : int
        N of stiffness over activation, from 1 to 3.
    prior_percent : float
        Standard deviation of each correction in per cent of the moment arm.
    torque : bool
        Fit the joint torque too, stiffness being in proportion to tension.
    curvature : bool
        False leaves out what tension adds through the curvature of the paths.
    seed : int
        Seed of the shuffles behind the null R.
    progress : function (done, all), optional
        Called with what is done and what there is to do.

    Returns
    -------
    MuscleModel
        With what the fit is worth, element by element.

    Raises
    ------
    InputError
        A file cannot be read, rows have no activation or (where asked) no torque, an option is out
        of range, or there is no such arm.
    NotIdentifiableError
        A muscle was never active.
    EstimationError
        The search does not arrive.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.muscles.show import fit_muscles
    >>> from armimpedance.hand.levels.show import to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1)
    >>> model = fit_muscles(to_joint(estimate(recording)), order=0)
    >>> len(model.muscles)
    6
    """
    options = {
        "arm": arm,
        "moment_arm_order": order,
        "activation_order": activation_order,
        "prior_percent": prior_percent,
        "torque": torque,
        "curvature": curvature,
        "seed": seed,
        "progress": progress,
    }
    given = rows if recording is None else free_hand_rows(rows, recording)
    return cast(MuscleModel, fit_model("muscles", given, **options))


def free_hand_rows(rows: Rows, recording: Whose) -> HandRows:
    """Estimates of a hand in space whose elbow was free, as rows for `fit_muscles`.

    Parameters
    ----------
    rows : Estimates, sequence of ImpedanceEstimate, path or paths
        At the hand, in three axes, with activations and four joint angles, or seven where the
        wrist was free, too.
    recording : Recording, Subject or path
        Whose arm it is, and how gravity acts.

    Returns
    -------
    HandRows

    Raises
    ------
    InputError
        A file cannot be read, the elbow was held, arm or gravity are not known, or an estimate is
        of another kind; the message names it.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.muscles.show import free_hand_rows
    >>> from manipulandum_sim.space import simulate_space
    >>> session, _ = simulate_space(seed=1, sets=1, directions=6, emg=True, elbow="free")
    >>> free_hand_rows(ai.estimate(session, method="exact"), session).stiffness.shape
    (1, 3, 3)
    """
    if isinstance(rows, HandRows):
        return rows
    if isinstance(rows, JointRows):
        raise InputError("rows of joints with a recording", expected="estimates of the hand")
    if isinstance(recording, str | os.PathLike):
        recording = read_recording(recording)
    if len(moving_joints(LOCKED_WRIST, recording, None)) < LOCKED_WRIST:
        expected = "it mapped: map hand.csv --recording session --to joint"
        raise InputError("a hand whose elbow was held", expected=expected)
    sources = [rows] if isinstance(rows, str | os.PathLike) else list(cast(Sequence[Any], rows))
    estimates: list[ImpedanceEstimate] = []
    for one in sources:
        with naming(one):
            if isinstance(one, str | os.PathLike):
                estimates += read_results(Path(one))
            else:
                estimates.append(one)
    joint_counts = {0 if e.joint_angles is None else len(e.joint_angles) for e in estimates}
    joints = FREE_WRIST if joint_counts == {FREE_WRIST} else LOCKED_WRIST
    if len(moving_joints(joints, recording, None)) < joints:
        expected = "four angles, or the elbow held and the hand mapped"
        raise InputError("seven angles of a hand whose wrist was locked", expected=expected)
    arm = cast(SpatialArm, arm_of_whose(recording, joints))
    if arm.gravity_m_s2 is None:
        expected = "gravity_m_s2 of the recording, [0, 0, 0] where the arm's weight is borne"
        raise InputError("an arm in space whose gravity is not stated", expected=expected)
    return rows_of_hand(estimates, arm)


def fit_model(kind: str, rows: Rows, **options: Any) -> FittedModel:
    """Fit a model of a kind that is known by its name, as ``armimpedance fit KIND`` does.

    Parameters
    ----------
    kind : {"moment-arms", "activation", "muscles"}
        A key of `muscles.models.MODEL_KINDS`.
    rows : JointRows, Estimates, sequence of ImpedanceEstimate, path or paths
        At the joints; a path is that of a RESULTS.csv.
    **options
        Keywords of the kind's function `fit`.

    Returns
    -------
    FittedModel
        Of the class of its kind.

    Raises
    ------
    InputError
        There is no such kind, a file cannot be read, or the fit refuses rows or options.

    Examples
    --------
    >>> from armimpedance.muscles.show import fit_model
    >>> from armimpedance.muscles.models import JointRows
    >>> K = [[[15.0, 6.0], [6.0, 16.0]], [[16.0, 6.0], [6.0, 15.0]]]
    >>> rows = JointRows([[0.5, 1.2], [1.1, 1.7]], K, [[[1.0, 0.4], [0.4, 1.0]]] * 2)
    >>> fit_model("moment-arms", rows, order=0).predict([0.8, 1.5]).stiffness.round(6).tolist()
    [[15.5, 6.0, 15.5]]
    """
    given = _joint_rows(rows)
    model = MODEL_KINDS.named(kind).fit(given, **options)
    if not given.doubts:
        return model
    allowed = _NOT_ALLOWED if given.stiffness_shared is None else _ALLOWED
    return model.with_warning(_IN_ALL_ROWS.format(", ".join(given.doubts)) + allowed)


def _joint_rows(rows: Rows) -> JointRows | HandRows:
    if isinstance(rows, JointRows | HandRows):
        return rows
    if isinstance(rows, str | os.PathLike):
        return read_joint_rows([Path(rows)])
    given = rows if isinstance(rows, Sequence) else ()
    if given and all(isinstance(row, str | os.PathLike) for row in given):
        return read_joint_rows([Path(row) for row in cast(Sequence[str], given)])
    return joint_rows(estimates_of(cast(Sequence[ImpedanceEstimate], rows)))
