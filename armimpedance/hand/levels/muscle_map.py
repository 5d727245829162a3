"""Mapping of a joint-level estimate to the muscles of an arm."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.levels.muscle_identifiable import MuscleShare, muscle_share
from armimpedance.hand.levels.tension import tensions_for
from armimpedance.limb.arm import MuscularArm

# Stiffness and viscosity of the joints from those of the muscles.
#
# With ``tau = -G^T f`` (Tsuji (1997), eq. (6)) and muscles whose tension grows by k per
# lengthening, ``K_j = -dtau/dq = G^T K_m G + sum_n f_n d2L_n/dq2``. The source's eq. (11) lacks the
# second term; it holds if the muscles bear no tension or their moment arms are constant.


def joint_stiffness(
    G: ArrayLike,
    K_m: ArrayLike,
    tensions: ArrayLike | None = None,
    curvature: ArrayLike | None = None,
) -> FloatArray:
    """``K_j = G^T K_m G + sum_n f_n d2L_n``; Tsuji (1997), eq. (11) without the second term.

    `G` (..., m, n): moment arms dL/dq, m.
    `K_m` (..., m): stiffness of each muscle, N/m.
    `tensions` (..., m): N; with `curvature`. Without both the second term is left out, as the
    source does.
    `curvature` (..., m, n, n): d2L/dq2, m.
    Returns: (..., n, n): N m/rad.
    Raises InputError: shapes that do not belong together, or only one of `tensions` and
    `curvature`.
    """
    if (tensions is None) != (curvature is None):
        raise InputError("the curvature term needs both tensions and curvature", expected="both")
    K_j = _through_arms(G, K_m)
    if tensions is None or curvature is None:
        return K_j
    return K_j + curvature_term(tensions, curvature)


def joint_viscosity(G: ArrayLike, B_m: ArrayLike) -> FloatArray:
    """``B_j = G^T B_m G``; Tsuji (1997), eq. (13).

    `G` (..., m, n): moment arms dL/dq, m.
    `B_m` (..., m): viscosity of each muscle, N s/m.
    Returns: (..., n, n): N m s/rad.
    """
    return _through_arms(G, B_m)


def curvature_term(tensions: ArrayLike, curvature: ArrayLike) -> FloatArray:
    """``sum_n f_n d2L_n/dq2``, N m/rad, (..., n, n), of tensions (..., m)."""
    f, C = np.asarray(tensions, dtype=float), np.asarray(curvature, dtype=float)
    if C.ndim < 3 or f.ndim < 1 or f.shape[-1] != C.shape[-3]:
        raise InputError(
            f"tensions {f.shape} and curvature {C.shape}", expected="(..., m) and (..., m, n, n)"
        )
    return np.einsum("...m,...mij->...ij", f, C)


def _through_arms(G: ArrayLike, per_muscle: ArrayLike) -> FloatArray:
    """``G^T (n, m) diag(k) (m, m) G (m, n)``."""
    arms, k = np.asarray(G, dtype=float), np.asarray(per_muscle, dtype=float)
    if arms.ndim < 2 or k.ndim < 1 or k.shape[-1] != arms.shape[-2]:
        raise InputError(
            f"moment arms {arms.shape} and muscles {k.shape}", expected="(..., m, n) and (..., m)"
        )
    return np.einsum("...mi,...m,...mj->...ij", arms, k, arms)


_JOINTS: Final = ("shoulder", "elbow")
_NO_TORQUE: Final = (
    "joint torque unknown: muscle tensions unknown, and the curvature term was left out"
)


@dataclass(frozen=True)
class MuscleEstimate(FrozenRecord):
    """Information about the muscles from joint stiffness and viscosity of one condition.

    `arm`, `arm_source`: the arm's name, and the source of its numbers.
    `joint_angles` (n,): rad.
    `tension` (m,) or None: tensions in N from static optimisation; None if the torque is unknown or
    impossible.
    `keys`: the group's columns.
    """

    arm: str
    arm_source: str
    joint_angles: Annotated[FloatArray, "n"]
    tension: Annotated[FloatArray, "m"] | None
    stiffness: MuscleShare
    viscosity: MuscleShare
    method: str
    n_trials: int
    keys: Mapping[str, Any]
    warnings: tuple[str, ...] = ()
    provenance: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tension is not None and len(self.tension) != len(self.muscles):
            raise InputError(f"{len(self.tension)} tensions", expected=f"{len(self.muscles)}")

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the m muscles."""
        return self.stiffness.muscles


def to_muscle(
    estimate: ImpedanceEstimate,
    arm: MuscularArm,
    *,
    curvature: bool = True,
    activation: ArrayLike | None = None,
) -> MuscleEstimate:
    """Joint -> muscle: tensions, and the information of K_j and B_j about K_m and B_m.

    ``K_j = G^T K_m G + sum_n f_n d2L_n``, ``B_j = G^T B_m G``; tensions f produce the joint torque
    ``tau = -G^T f`` with least effort, or nearest to measured activations. Least effort includes no
    tension of opposing muscles without torque, and the joints' own tissue counts as muscle.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        An estimate at the joints, n axes.
    arm : MuscularArm
        An arm of n joints.
    curvature : bool
        False leaves the curvature term out, as Tsuji (1997), eq. (11) does.
    activation : (m,), optional
        Measured, 0..1, in the order of the arm's muscles.

    Returns
    -------
    MuscleEstimate

    Raises
    ------
    InputError
        The estimate is not at the joints or has another number of joints, or its joint angles are
        unknown or outside of a table of moment arms.
    """
    q = _angles(estimate, arm)
    G, C = arm.paths.moment_arms(q), arm.paths.curvature(q)
    tension, warnings = _tension(estimate, arm, G, activation)
    bent = curvature_term(tension, C) if curvature and tension is not None else None
    blocks = len(estimate.covariance) // 3
    shares = {}
    for i, name in ((1, "viscosity"), (2, "stiffness")):
        block = slice(i * blocks, (i + 1) * blocks)
        shares[name] = muscle_share(
            getattr(estimate, name),
            estimate.covariance[block, block],
            G,
            arm.paths.muscles,
            curvature=bent if name == "stiffness" else None,
            dof=estimate.dof,
        )
        warnings += _impossible(name, shares[name])
    note = "without the curvature term" if bent is None else "with the curvature term"
    return MuscleEstimate(
        arm=arm.name,
        arm_source=arm.source,
        joint_angles=q,
        tension=tension,
        **shares,
        method=estimate.method,
        n_trials=estimate.quality.n_trials,
        keys=estimate.keys,
        warnings=(*estimate.warnings, *_outside(q, arm), *warnings),
        provenance=(*estimate.provenance, f"muscles of {arm.name} ({arm.source}), {note}"),
    )


def _angles(estimate: ImpedanceEstimate, arm: MuscularArm) -> FloatArray:
    if estimate.level != "joint":
        raise InputError(f"an estimate at the {estimate.level} level", expected="level joint")
    if estimate.k != arm.paths.joints:
        raise InputError(
            f"an estimate of {estimate.k} joints", expected=f"{arm.paths.joints}, as {arm.name} has"
        )
    # in a recording of joints, the position is the joint angles
    q = estimate.position if estimate.joint_angles is None else estimate.joint_angles
    if q is None:
        raise InputError("joint angles unknown", expected="q_shoulder_rad and q_elbow_rad")
    return q


def _tension(
    estimate: ImpedanceEstimate, arm: MuscularArm, G: FloatArray, activation: ArrayLike | None
) -> tuple[FloatArray | None, tuple[str, ...]]:
    """Tensions (m,) if the torque is known and possible, and warnings."""
    torque = estimate.torque
    if torque is None and estimate.joint_angles is None:
        # in a recording of joints, the force is the torque by the limb
        torque = estimate.force
    if torque is None:
        return None, (_NO_TORQUE,)
    try:
        name = "static optimisation"
        tensions = tensions_for(
            torque[None], G, arm.max_tension, activation=activation, labels=[name]
        )
    except InputError as error:
        return None, (f"{error}: the curvature term was left out",)
    return tensions[0], ()


def _outside(q: FloatArray, arm: MuscularArm) -> tuple[str, ...]:
    """A warning for each joint angle outside the range of the arm model."""
    names = _JOINTS if len(q) == 2 else tuple(f"joint {i + 1}" for i in range(len(q)))
    return tuple(
        f"{name} at {np.rad2deg(angle):.0f} degrees, outside of the {np.rad2deg(low):.0f} to "
        f"{np.rad2deg(high):.0f} that {arm.name} holds for: its moment arms are extrapolated"
        for name, angle, (low, high) in zip(names, q, arm.angle_range, strict=True)
        if not low - 1e-9 <= angle <= high + 1e-9
    )


def _impossible(name: str, share: MuscleShare) -> tuple[str, ...]:
    if share.outside_se == 0:
        return ()
    text = (
        f"joint {name} lies {share.outside_se:.2g} standard errors outside of what muscles with "
        "these moment arms make"
    )
    if share.possible:
        return (f"{text}: the ranges are those at the nearest that they make",)
    return (f"{text}: no ranges",)
