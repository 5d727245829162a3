"""The verbs `to_joint`, `to_hand` and `to_muscle`: between hand, joints and muscles."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path
from typing import Final, Literal, TypeVar

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Subject
from armimpedance.hand.levels.joint import (
    to_hand as to_hand_once,
    to_joint as to_joint_once,
    with_arm_errors,
)
from armimpedance.hand.levels.muscle_map import MuscleEstimate, to_muscle as to_muscle_once
from armimpedance.hand.levels.posture import (
    Elbow,
    Whose,
    Wrist,
    arm_posture_for,
    elbow_and_wrist_of,
    is_in_space,
    spatial_posture_for,
)
from armimpedance.hand.levels.show.muscle_estimates import MuscleEstimates
from armimpedance.hand.levels.show.options import TO_JOINT, TO_MUSCLE
from armimpedance.hand.show.estimates import Estimates, GivenEstimates, estimates_of
from armimpedance.hand.show.quantities import condition_of
from armimpedance.limb.arm import HELD, LOCKED_WRIST, MuscularArm, arm_named
from armimpedance.recordings import read_subject
from armimpedance.show.verbs.results import naming

#: Estimates, or the path of a RESULTS.csv.
Results = GivenEstimates
Made = TypeVar("Made")

_UPRIGHT: Final = (
    "gravity: {} moves in the sagittal plane, and the recording does not say how gravity acts: the "
    'arm\'s weight and its gradient were left out; say it with "gravity" in recording.json'
)


@TO_JOINT.function
def to_joint(
    estimates: Results,
    *,
    recording: Whose | None = None,
    force_term: bool = True,
    elbow: Elbow | None = None,
    swivel_deg: float | None = None,
) -> Estimates:
    """Map inertia, viscosity and stiffness from the hand to the joints.

    ``K_j = J^T K_e J - Gamma(F) - dg/dq``, ``B_j = J^T B_e J``, ``M_j = J^T M_e J``; Tsuji (1997),
    eqs. (10), (12), (14)-(17). dg/dq is that of the arm's weight, if the recording states that
    gravity acts in the plane.

    Parameters
    ----------
    estimates : Estimates, sequence of ImpedanceEstimate, or path
        At the hand; the path is that of a RESULTS.csv.
    recording : Recording, Subject or path, optional
        Source of the arm and of gravity: lengths or height determine the posture and J. Default:
        subject and gravity of the estimates.
    {options}

    Returns
    -------
    Estimates
        At the joints, one for each input, with the subject. In three axes with a held elbow: turn,
        elevation, elbow.

    Raises
    ------
    InputError
        A file cannot be read, an estimate is not at the hand, or its posture is not known. The
        message names the condition.
    NotIdentifiableError
        The arm is stretched in a posture, or free in space: four joints, three axes of the hand.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.hand.levels.show import to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> joint = to_joint(estimate(recording))
    >>> joint["cocontraction_10"].stiffness.axes
    ('shoulder', 'elbow')
    """
    who = replace(_who(estimates, recording), elbow=elbow, swivel_deg=swivel_deg)
    if any(is_in_space(row) for row in _rows(estimates)):
        stated, wrist = elbow_and_wrist_of(recording)
        who = replace(who, elbow=elbow or stated, wrist=wrist)

    def mapped(row: ImpedanceEstimate) -> ImpedanceEstimate:
        return _at_joint(row, who, force_term)

    return Estimates(tuple(_each(estimates, mapped)), who.subject, who.gravity_m_s2)


def to_hand(
    estimates: Results, *, recording: Whose | None = None, force_term: bool = True
) -> Estimates:
    """Map inertia, viscosity and stiffness from the joints to the hand: compliances add.

    ``K_e = (J (K_j + Gamma + dg/dq)^-1 J^T)^-1``, for a square J
    ``J^-T (K_j + Gamma + dg/dq) J^-1``.

    Parameters
    ----------
    estimates : Estimates, sequence of ImpedanceEstimate, or path
        At the joints, with joint angles; the path is that of a RESULTS.csv.
    recording : Recording, Subject or path, optional
        Source of the arm and of gravity. Default: those of the estimates.
    force_term : bool
        True if the estimates were mapped with the term of the hand's force.

    Returns
    -------
    Estimates
        At the hand, one for each input, with the subject.

    Raises
    ------
    InputError
        A file cannot be read, an estimate is not at the joints, or its posture is not known. The
        message names the condition.
    NotIdentifiableError
        The arm is stretched in a posture.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.hand.levels.show import to_hand, to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> to_hand(to_joint(estimate(recording)))
    1 estimate
    cocontraction_10: weighted, 8 trials, K 408, 153.6 N/m
    1 warning: only 8 clusters ...
    """
    who = _who(estimates, recording)

    def mapped(row: ImpedanceEstimate) -> ImpedanceEstimate:
        posture, q, source = _posture(row, who)
        hand = to_hand_once(row, posture, force_dependent=force_term)
        return replace(hand, joint_angles=q, provenance=(*hand.provenance, source))

    return Estimates(tuple(_each(estimates, mapped)), who.subject, who.gravity_m_s2)


@TO_MUSCLE.function
def to_muscle(
    estimates: Results,
    *,
    arm: MuscularArm | str | Path,
    recording: Whose | None = None,
    force_term: bool = True,
    curvature: bool = True,
    share: Literal["effort", "emg"] = "effort",
) -> MuscleEstimates:
    """Determine the information of joint stiffness and viscosity about the muscles.

    ``K_j = G^T K_m G + sum f d2L``, ``B_j = G^T B_m G``. Three numbers do not determine the
    stiffness of six muscles: the result holds the sums that they do determine, and for each muscle
    the range of all K_m >= 0 that give this K_j.

    Parameters
    ----------
    estimates : Estimates, sequence of ImpedanceEstimate, or path
        At the hand or at the joints; the path is that of a RESULTS.csv.
    arm : MuscularArm, str or path
        The muscles: "planar6", "arm26" or the path of a table of moment arms.
    recording : Recording, Subject or path, optional
        Source of the arm, if rows of the hand are to be mapped, and of gravity. Default: those of
        the estimates.
    {options}

    Returns
    -------
    MuscleEstimates
        One estimate for each input.

    Raises
    ------
    InputError
        A file cannot be read, or the arm, a posture or (if requested) an activation is not known.
        The message names the condition.

    Examples
    --------
    >>> from armimpedance.hand.still.show import estimate
    >>> from armimpedance.hand.levels.show import to_muscle
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> muscles = to_muscle(estimate(recording), arm="planar6")
    >>> [c.name for c in muscles["cocontraction_10"].stiffness.combinations]
    ['ss', 'se', 'ee']
    """
    if not force_term and all(row.level == "joint" for row in _rows(estimates)):
        raise InputError("no force term in rows of the joints", expected="rows of the hand")
    muscular = arm_named(arm)
    who = _who(estimates, recording)

    def mapped(row: ImpedanceEstimate) -> MuscleEstimate:
        if is_in_space(row):
            raise InputError(f"{muscular.name} of an arm in space", expected="rows in the plane")
        activation = _activation(row, who.muscles, muscular) if share == "emg" else None
        joint = _with_torque(row, who)
        if row.level == "hand":
            joint = _at_joint(row, who, force_term)
        if muscular.sagittal and who.gravity_m_s2 is None:
            joint = joint.with_warning(_UPRIGHT.format(muscular.name))
        return to_muscle_once(joint, muscular, curvature=curvature, activation=activation)

    return MuscleEstimates(tuple(_each(estimates, mapped)))


@dataclass(frozen=True)
class _Who:
    """The arm of estimates, as far as it is known, and gravity."""

    subject: Subject | None
    muscles: tuple[str, ...] = ()
    gravity_m_s2: tuple[float, ...] | None = None
    elbow: Elbow | None = None
    swivel_deg: float | None = None
    wrist: Wrist | None = None


def _who(estimates: Results, recording: Whose | None) -> _Who:
    """Subject, as far as known, muscles and gravity of estimates."""
    if isinstance(recording, Subject):
        return _Who(recording)
    if recording is not None:
        opened = read_subject(recording) if isinstance(recording, str | os.PathLike) else recording
        return _Who(opened.subject, opened.muscles or (), opened.gravity_m_s2)
    if isinstance(estimates, Estimates):
        return _Who(estimates.subject, gravity_m_s2=estimates.gravity_m_s2)
    return _Who(None)


def _posture(row: ImpedanceEstimate, who: _Who) -> tuple[ArmPosture, FloatArray, str]:
    """Posture of a row, all its angles, and the sources of posture and gravity."""
    if is_in_space(row):
        at_joints = row.level == "joint"
        elbow_held = who.elbow == "held" or (at_joints and row.k == len(HELD))
        wrist_locked = who.wrist == "locked" or (at_joints and row.k <= LOCKED_WRIST)
        posture, q, source = spatial_posture_for(
            row,
            who.subject,
            elbow="held" if elbow_held else "free",
            gravity_m_s2=who.gravity_m_s2,
            swivel_rad=None if who.swivel_deg is None else radians(who.swivel_deg),
            wrist="locked" if wrist_locked else None,
        )
        return posture, q, f"{source}, elbow {'held' if elbow_held else 'free'}"
    if who.elbow is not None or who.swivel_deg is not None:
        raise InputError(
            f"elbow and swivel of an arm of {row.k} axes", expected="them in three axes only"
        )
    posture, source = arm_posture_for(row, who.subject, gravity_m_s2=who.gravity_m_s2)
    return posture, posture.joint_angles, f"{source}; {_plane(who.gravity_m_s2)}"


def _plane(gravity_m_s2: tuple[float, ...] | None) -> str:
    if gravity_m_s2 is None:
        return "plane taken as horizontal, since the recording says nothing of gravity"
    if not any(gravity_m_s2):
        return "horizontal plane"
    return f"gravity {', '.join(f'{part:g}' for part in gravity_m_s2)} m/s^2 along the axes"


def _each(estimates: Results, mapped: Callable[[ImpedanceEstimate], Made]) -> list[Made]:
    """Map every estimate; errors name its condition and its file."""
    results = []
    for row in _rows(estimates):
        with naming(estimates), _naming_condition(condition_of(row)):
            results.append(mapped(row))
    return results


def _rows(estimates: Results) -> Sequence[ImpedanceEstimate]:
    return estimates_of(estimates)


@contextmanager
def _naming_condition(condition: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise InputError(
            f"{condition}: {error.problem}",
            file=error.file,
            row=error.row,
            column=error.column,
            expected=error.expected,
        ) from error
    except ArmImpedanceError as error:
        error.args = (f"{condition}: {error}",)
        raise


def _at_joint(row: ImpedanceEstimate, who: _Who, force_term: bool) -> ImpedanceEstimate:
    def mapped(subject: Subject | None) -> ImpedanceEstimate:
        posture, q, source = _posture(row, replace(who, subject=subject))
        joint = to_joint_once(row, posture, force_dependent=force_term)
        return replace(joint, joint_angles=q, provenance=(*joint.provenance, source))

    return with_arm_errors(mapped, who.subject)


def _with_torque(row: ImpedanceEstimate, who: _Who) -> ImpedanceEstimate:
    """Add the torque, from angles and force, to a row at the joints that has none."""
    if row.level != "joint" or row.torque is not None:
        return row
    if row.force is None or row.joint_angles is None:
        return row
    posture, _, _ = _posture(row, who)
    return replace(row, torque=posture.torque_under(row.force))


def _activation(row: ImpedanceEstimate, muscles: tuple[str, ...], arm: MuscularArm) -> FloatArray:
    """Measured activation of the arm's muscles, in their order."""
    if row.activation is None:
        raise InputError(
            "tensions by EMG without activation", expected="columns alpha_1, alpha_2, …"
        )
    names = row.muscles or muscles
    if len(names) != len(row.activation):
        raise InputError(
            f"{len(row.activation)} activations, {len(names)} muscles in the recording",
            expected="as many",
        )
    missing = [name for name in arm.paths.muscles if name not in names]
    if missing:
        raise InputError(
            f"no activation of {missing[0]}, a muscle of {arm.name}",
            expected=f"it in the recording beside {', '.join(names)}",
        )
    return row.activation[[names.index(name) for name in arm.paths.muscles]]
