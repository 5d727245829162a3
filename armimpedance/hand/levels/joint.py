"""Conversion of impedance from the hand to the joints, and back.

With the force F that the hand exerts on the environment and the torque g that carries the arm's
weight, the muscles bear ``tau = J^T F + g``. Its derivative by the joint angles, with
``dtau = -K_j dq`` and ``dF = -K_e J dq``, is ``K_j = J^T K_e J - Gamma(F) - dg/dq``. Tsuji (1997),
eq. (10) is ``J^T K_e J`` alone, which holds in a horizontal plane for a hand that bears no force.
With more joints than hand axes, only the conversion to the hand is unique.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.records import ArmPosture, ImpedanceEstimate, Subject
from armimpedance.hand.levels.symmetry import symmetric_part
from armimpedance.limb.arm import SINGULAR_CONDITION, arm_of, require_full_rank

#: Above this condition of J, an error of one per cent in a length is as large as J's smallest
#: singular value.
_NEARLY_SINGULAR = 100.0

#: Number of the hand's directions at which gravity always has a component along them.
_IN_SPACE = 3

_WITHOUT_GRAVITY = (
    "gravity: unknown, so that its gradient dg/dq was left out of the joint stiffness, of which it "
    "may be some 5 to 10 %; give a posture with its gravity_gradient"
)
#: Largest distance, m, between the hand's measured place and that by the joint angles.
_APART_M = 0.01

_WITHOUT_GAMMA = "hand force unknown: the force term Gamma was left out of the joint stiffness"


def force_term(posture: ArmPosture, force: ArrayLike) -> FloatArray:
    """``Gamma_ij = sum_k F_k d2p_k/dq_i dq_j``: the term of a hand force, (n, n), N m/rad.

    Parameters
    ----------
    posture : ArmPosture
    force : (d,)
        Force by the hand on the environment, N.

    Returns
    -------
    (n, n)
        N m/rad.

    Raises
    ------
    InputError
        The force has another number of axes than the posture.
    """
    force = np.asarray(force, dtype=float)
    if force.shape != posture.hand_position.shape or not np.isfinite(force).all():
        wanted = f"{len(posture.hand_position)} finite values"
        raise InputError(f"hand force {force.tolist()}", expected=wanted)
    return np.einsum("k,kij->ij", force, posture.jacobian_derivative)


def to_joint(
    estimate: ImpedanceEstimate,
    posture: ArmPosture,
    *,
    force_dependent: bool = True,
    symmetric: bool = True,
) -> ImpedanceEstimate:
    """Hand -> joint: ``K_j = J^T K_e J - Gamma(F) - dg/dq``, ``B_j = J^T B_e J``, M_j likewise.

    Tsuji (1997), eqs. (10), (12), (14)-(17). `position` and `force` stay those of the hand, so
    that `to_hand` can undo Gamma. The covariance is that of M, B, K; the mean force, the posture
    and the arm's weight count as known.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        At the hand, d axes.
    posture : ArmPosture
        n <= d joints; its `gravity_gradient` is subtracted.
    force_dependent : bool
        False leaves Gamma out, as the source does.
    symmetric : bool
        Map the symmetric part only; False maps the matrices as they are.

    Returns
    -------
    ImpedanceEstimate

    Raises
    ------
    InputError
        The estimate is not at the hand, or posture and estimate differ in axes.
    NotIdentifiableError
        More joints than hand axes (see `feasible_joint_stiffness`), or a singular posture.
    """
    J = _hand_jacobian(estimate, posture, "hand")
    d, n = J.shape
    hand = symmetric_part(estimate) if symmetric else estimate
    gamma, note = _gamma(estimate, posture, force_dependent)
    # for a stable arm K_j + Gamma + dg/dq - J^T K_e J is positive semidefinite
    stiffness = J.T @ hand.stiffness @ J - gamma - _gravity_gradient(posture)
    if n > d:
        least = ", ".join(f"{element:.3g}" for element in np.diag(stiffness))
        raise NotIdentifiableError(
            f"{n} joints, {d} hand axes: the joint impedance is not unique, its stiffness on the "
            f"diagonal is at least {least} N m/rad; feasible_joint_stiffness describes all that "
            "fit the hand's, and `fit muscles --recording` takes hands of many places",
            ("M", "B", "K"),
        )
    warnings = _posture_warnings(J)
    # A_j (n, n) = J^T (n, d) A_e (d, d) J (d, n); row by row vec(A_j) = (J^T kron J^T) vec(A_e)
    T = np.kron(np.eye(3), np.kron(J.T, J.T))
    return replace(
        hand,
        level="joint",
        inertia=J.T @ hand.inertia @ J,
        inertia_with_handle=J.T @ np.asarray(hand.inertia_with_handle) @ J,
        viscosity=J.T @ hand.viscosity @ J,
        stiffness=stiffness,
        covariance=T @ hand.covariance @ T.T,
        bound=None if hand.bound is None else T @ hand.bound @ T.T,
        shared_errors=hand.shared_through(T),
        joint_angles=posture.joint_angles,
        torque=None if estimate.force is None else posture.torque_under(estimate.force),
        warnings=(
            *hand.warnings,
            *warnings,
            *_missing_force(estimate, force_dependent),
            *_missing_gravity(posture),
            *warnings_of(posture_findings(estimate, posture)),
        ),
        provenance=(*hand.provenance, f"mapped from hand to joint {note}"),
    )


def to_hand(
    estimate: ImpedanceEstimate, posture: ArmPosture, *, force_dependent: bool = True
) -> ImpedanceEstimate:
    """Joint -> hand: compliances add, ``K_e = (J (K_j + Gamma + dg/dq)^-1 J^T)^-1``.

    From ``(K_j + Gamma + dg/dq) dq = -J^T dF`` and ``dX = J dq``; for a square J it is
    ``J^-T (K_j + Gamma + dg/dq) J^-1``. Inertia takes the same form, Tsuji (1997), eq. (17). For a
    redundant arm the viscosity is that of the viscous joints alone, without their inertia and
    stiffness; each matrix must then be invertible.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        At the joints, n axes; `force` is the hand's.
    posture : ArmPosture
        n >= d joints.
    force_dependent : bool
        True if the estimate was (or is to be) mapped with Gamma.

    Returns
    -------
    ImpedanceEstimate

    Raises
    ------
    InputError
        The estimate is not at the joints, or posture and estimate differ in joints.
    NotIdentifiableError
        Singular posture, fewer joints than hand axes, or a singular matrix of a redundant arm.
    """
    J = _hand_jacobian(estimate, posture, "joint")
    require_full_rank(J)
    gamma, note = _gamma(estimate, posture, force_dependent)
    inertia, T_M = _compliances_added(J, estimate.inertia, "inertia")
    with_handle, _ = _compliances_added(J, np.asarray(estimate.inertia_with_handle), "inertia")
    viscosity, T_B = _compliances_added(J, estimate.viscosity, "viscosity")
    loaded = estimate.stiffness + gamma + _gravity_gradient(posture)
    stiffness, T_K = _compliances_added(J, loaded, "stiffness")
    T = block_diag(T_M, T_B, T_K)
    warnings = (
        *_posture_warnings(J),
        *_missing_force(estimate, force_dependent),
        *_missing_gravity(posture),
    )
    return replace(
        estimate,
        level="hand",
        inertia=inertia,
        inertia_with_handle=with_handle,
        viscosity=viscosity,
        stiffness=stiffness,
        covariance=T @ estimate.covariance @ T.T,
        bound=None if estimate.bound is None else T @ estimate.bound @ T.T,
        shared_errors=estimate.shared_through(T),
        joint_angles=posture.joint_angles,
        warnings=tuple(dict.fromkeys((*estimate.warnings, *warnings))),
        provenance=(*estimate.provenance, f"mapped from joint to hand {note}"),
    )


def _compliances_added(J: FloatArray, A: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    """``A_e = (J A^-1 J^T)^-1`` (d, d) and its derivative by A, row by row, (d^2, n^2)."""
    d, n = J.shape
    if d == n:
        # needs no inverse of A, which may be singular: A_e = J^-T (n, d) A (n, n) J^-1 (n, d)
        right = np.linalg.inv(J)
        return right.T @ A @ right, np.kron(right.T, right.T)
    if not np.linalg.cond(A) < SINGULAR_CONDITION:
        raise NotIdentifiableError(f"the joint {name} is singular: it does not reach the hand")
    # A_e (d, d) = (J (d, n) A^-1 (n, n) J^T (n, d))^-1
    moved = np.linalg.solve(A, J.T)
    hand = np.linalg.inv(J @ moved)
    # dA_e = L (d, n) dA (n, n) R (n, d): vec(dA_e) = (L kron R^T) vec(dA)
    left, right = hand @ np.linalg.solve(A.T, J.T).T, moved @ hand
    return hand, np.kron(left, right.T).astype(float)


def _hand_jacobian(estimate: ImpedanceEstimate, posture: ArmPosture, level: str) -> FloatArray:
    if estimate.level != level:
        raise InputError(f"an estimate at the {estimate.level} level", expected=f"level {level}")
    d, n = posture.jacobian.shape
    have, want = estimate.k, d if level == "hand" else n
    if have != want:
        raise InputError(f"estimate with {have} {level} axes", expected=f"{want}, as the posture")
    return posture.jacobian


def _gamma(
    estimate: ImpedanceEstimate, posture: ArmPosture, force_dependent: bool
) -> tuple[FloatArray, str]:
    if force_dependent and estimate.force is not None:
        return force_term(posture, estimate.force), "with the force term Gamma"
    n = len(posture.joint_angles)
    return np.zeros((n, n)), "without the force term Gamma"


def posture_findings(estimate: ImpedanceEstimate, posture: ArmPosture) -> tuple[Finding, ...]:
    """Check that the arm's lengths and the shoulder's place agree with the hand's place.

    `estimate`: at the hand.
    `posture`: posture of the mapping.
    Returns: empty if the hand's place was not measured, or nothing depends on the shoulder's.
    """
    if estimate.position is None:
        return ()
    if estimate.shoulder_m is None:
        if estimate.joint_angles is not None:
            return ()
        text = "its place is not known and was taken as the origin: K_j is that of an arm there"
        return (Finding("shoulder", "cannot tell", f"{text}; give shoulder_m or joint angles"),)
    reach = estimate.position - estimate.shoulder_m
    apart = float(np.linalg.norm(posture.hand_position - reach))
    share = 200 * apart / max(float(np.linalg.norm(reach)), apart)
    text_of_distance = (
        f"the joint angles put the hand {1e3 * apart:.0f} mm from where it was measured"
    )
    smallest = f"{1e3 * _APART_M:.0f} mm"
    if apart <= _APART_M:
        return (Finding("lengths", "ok", text_of_distance, smallest=smallest),)
    text_of_distance += f": lengths, shoulder_m or angles are wrong, and K_j by some {share:.0f} %"
    return (Finding("lengths", "warning", text_of_distance, smallest=smallest),)


def _gravity_gradient(posture: ArmPosture) -> FloatArray:
    n = len(posture.joint_angles)
    return np.zeros((n, n)) if posture.gravity_gradient is None else posture.gravity_gradient


def _missing_gravity(posture: ArmPosture) -> tuple[str, ...]:
    """A warning if gravity acts in the hand's directions and its effect is unknown."""
    known = posture.gravity_gradient is not None
    return () if known or len(posture.hand_position) < _IN_SPACE else (_WITHOUT_GRAVITY,)


def _missing_force(estimate: ImpedanceEstimate, force_dependent: bool) -> tuple[str, ...]:
    return (_WITHOUT_GAMMA,) if force_dependent and estimate.force is None else ()


def _posture_warnings(J: FloatArray) -> tuple[str, ...]:
    condition = np.linalg.cond(J)
    if not condition < SINGULAR_CONDITION:
        raise NotIdentifiableError(
            "singular posture: the hand cannot move along some direction, so the joint "
            "impedance does not follow from the hand's"
        )
    if condition > _NEARLY_SINGULAR:
        return (f"nearly singular posture (condition of the Jacobian {condition:.3g})",)
    return ()


# Uncertainty of the arm itself, in the covariance of an estimate that was mapped with it.

#: Step of a numerical difference, in standard deviations: small, so that the hand stays within
#: reach.
_STEP: Final = 0.05

_LENGTHS_FROM_HEIGHT: Final = (
    "lengths: taken from the body's height, how well they fit cannot be told; a segment that is "
    "5 % longer makes K_j some 10 % larger: give upper_arm_m and forearm_hand_m with length_sd_m"
)


def with_arm_errors(
    mapped: Callable[[Subject | None], ImpedanceEstimate], subject: Subject | None
) -> ImpedanceEstimate:
    """Map an estimate with a subject's arm, and add the uncertainty of the arm to its covariance.

    If the subject states standard deviations of its mass and lengths, each adds ``s^2 d d^T``, with
    d the derivative of M, B, K. For that the whole mapping is repeated with a slightly larger and a
    slightly smaller value, including the posture from a hand's position.

    `mapped`: function from a subject to the estimate mapped with its arm.
    Returns: with a warning if lengths come from the height alone and no uncertainty is stated.
    """
    estimate = mapped(subject)
    if subject is None:
        return estimate
    covariance, shared = np.array(estimate.covariance), dict(estimate.shared_errors)
    for name, less, more in _neighbours(subject):
        # d (3 k^2,) for one standard deviation of one measure
        d = (mapped(more).parameters - mapped(less).parameters) / (2 * _STEP)
        covariance += np.outer(d, d)
        shared[name] = d
    estimate = replace(estimate, covariance=covariance, shared_errors=shared)
    guessed = subject.upper_arm_m is None or subject.forearm_hand_m is None
    if guessed and subject.length_sd_m is None:
        return estimate.with_warning(_LENGTHS_FROM_HEIGHT)
    return estimate


def _neighbours(subject: Subject) -> Iterator[tuple[str, Subject, Subject]]:
    """Yield each measure that has an sd, with the subject for a smaller and a larger value."""
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
