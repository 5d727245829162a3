"""From the joints to the hand of an arm that moves: ``-dF/da``, ``-dF/dv``, ``-dF/dx``.

The hand's force is that of the muscles less that of the moving links,

    J^T F = tau - K_j dq - B_j dqd - Y(q, qd, qdd) phi,

and a hand's place, velocity and acceleration say the joints', with A = J^-1 and N = dJ/dt:

    dq = A dx,  dqd = A dv - A N A dx,  dqdd = A da - A P A dx - 2 A N dqd.

So the Coriolis terms and the turning of the arm stand in the hand's B and K, which are therefore
not symmetric; both vanish at rest, where K is the posture's formula with its force term.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.arm import inertia_rows, inertial_gradients
from armimpedance.hand.reaching.windows import PhaseWindows
from armimpedance.limb.arm import TwoLinkArm

#: Step of the one difference that is not written out (rad).
_STEP_RAD = 1e-4


@dataclass(frozen=True)
class Instant(FrozenRecord):
    """One instant of the undisturbed reach.

    Attributes
    ----------
    angle, rate, acceleration : (2,)
        rad, rad/s, rad/s^2.
    hand, velocity, force : (2,)
        From the shoulder, m; m/s; by the limb on what it holds, N.
    """

    angle: Annotated[FloatArray, "2"]
    rate: Annotated[FloatArray, "2"]
    acceleration: Annotated[FloatArray, "2"]
    hand: Annotated[FloatArray, "2"]
    velocity: Annotated[FloatArray, "2"]
    force: Annotated[FloatArray, "2"]


#: Channels that make an instant.
_CHANNELS = ("angle", "rate", "joint_acceleration", "hand", "velocity", "force")


@dataclass(frozen=True)
class Where:
    """The same instant of n free reaches.

    Attributes
    ----------
    states : tuple of (n, 2)
        What an `Instant` holds.
    """

    states: tuple[FloatArray, ...]

    @property
    def mean(self) -> Instant:
        """The undisturbed reach."""
        return Instant(*(x.mean(axis=0) for x in self.states))

    def scatter(self, value: Callable[[Instant], FloatArray]) -> FloatArray:
        """Covariance (p, p) of ``value`` (p,) of the mean: leave out one reach in turn."""
        n = len(self.states[0])
        # means without one (n, d): (n m - x_i) / (n - 1)
        without = [(n * x.mean(axis=0) - x) / (n - 1) for x in self.states]
        values = np.stack([value(Instant(*parts)) for parts in zip(*without, strict=True)])
        values = values - values.mean(axis=0)
        return np.asarray((n - 1) / n * values.T @ values)


#: Channels that make an instant, in its order.
INSTANT: Final = ("angle", "rate", "joint_acceleration", "hand", "velocity", "force")


def where_of(windows: PhaseWindows) -> Where:
    """Free reaches in the middle of the window."""
    return Where(tuple(windows.part(name)[~windows.pushed, windows.middle] for name in INSTANT))


def instant_of(windows: PhaseWindows) -> Instant:
    """The undisturbed reach in the middle of the window."""
    return where_of(windows).mean


def at_level(
    level: Level, arm: TwoLinkArm, where: Where, theta: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """M, B and K row by row (12,) and their covariance, from phi, K_j and B_j (11,).

    What adds to the covariance is that free reaches, which say where the hand was, differ.
    """
    at = where.mean
    if level == "hand":
        weights, constant = to_hand(arm, at)
        scatter = where.scatter(lambda other: _hand_matrices(arm, other, theta, with_force=True))
    else:
        weights, constant = joint_weights(at), np.zeros(12)
        scatter = where.scatter(lambda other: joint_weights(other) @ theta)
    # values (12,) = W (12, 11) theta (11,) + constant
    return weights @ theta + constant, weights @ covariance @ weights.T + scatter


def to_hand(arm: TwoLinkArm, at: Instant) -> tuple[FloatArray, FloatArray]:
    """The hand's M, B, K as a linear function of the joints' unknowns.

    Parameters
    ----------
    arm : TwoLinkArm
        Its lengths.
    at : Instant

    Returns
    -------
    weights : (12, 11)
        Of phi, K_j and B_j (in the order of `equation`).
    constant : (12,)
        What the force that the hand bears adds: M, B, K row by row.
    """
    columns = [_hand_matrices(arm, at, unit, with_force=False) for unit in np.eye(11)]
    constant = _hand_matrices(arm, at, np.zeros(11), with_force=True)
    return np.stack(columns, axis=1), constant


def joint_weights(at: Instant) -> FloatArray:
    """The joints' M, B, K row by row as a linear function (12, 11) of the unknowns."""
    weights = np.zeros((12, 11))
    weights[:4, :3] = inertia_rows(at.angle).reshape(4, 3)
    weights[4:8, 7:11] = np.eye(4)
    weights[8:12, 3:7] = np.eye(4)
    return weights


def _hand_matrices(
    arm: TwoLinkArm, at: Instant, unknowns: FloatArray, with_force: bool
) -> FloatArray:
    """M, B, K (12,) of the hand for these unknowns (11,)."""
    phi, K_j, B_j = unknowns[:3], unknowns[3:7].reshape(2, 2), unknowns[7:].reshape(2, 2)
    A = np.linalg.inv(arm.jacobian(at.angle))
    N, P = arm.jacobian_rate(at.angle, at.rate), turning(arm, at)
    gradients = inertial_gradients(at.angle, at.rate, at.acceleration)
    by_angle, by_rate = (part @ phi for part in gradients)
    M_j = inertia_rows(at.angle) @ phi
    K_q, B_q = K_j + by_angle, B_j + by_rate
    if with_force:
        # Gamma_ij = sum_k d2p_k/dq_i dq_j F_k, (2, 2)
        K_q = K_q + np.einsum("kij,k->ij", arm.jacobian_derivative(at.angle), at.force)
    # M = A^T M_j A, (2, 2); B and K collect what multiplies dv and dx
    turn = A @ N @ A
    M = A.T @ M_j @ A
    B = A.T @ (B_q @ A - 2 * M_j @ turn)
    K = A.T @ (K_q @ A - B_q @ turn - M_j @ A @ P @ A + 2 * M_j @ turn @ N @ A)
    return np.concatenate([M, B, K], axis=None)


def turning(arm: TwoLinkArm, at: Instant) -> FloatArray:
    """``d(J qdd + dJ/dt qd)/dq`` with rates and accelerations held, (2, 2), central differences."""

    def value(q: FloatArray) -> FloatArray:
        return np.asarray(
            arm.jacobian(q) @ at.acceleration + arm.jacobian_rate(q, at.rate) @ at.rate
        )

    steps = _STEP_RAD * np.eye(2)
    columns = [(value(at.angle + s) - value(at.angle - s)) / (2 * _STEP_RAD) for s in steps]
    return np.stack(columns, axis=1)
