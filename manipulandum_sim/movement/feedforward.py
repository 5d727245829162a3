"""Commands of the muscles over a reach: tensions for the torque, and co-contraction."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand import COCONTRACTION_SHARE, Arm, EndMotion, MuscleCommand, basis_at
from manipulandum_sim.movement.path import Motion2

#: Rounds in which muscles that would have to push are left out.
ROUNDS: Final = 6


class Cocontraction(NamedTuple):
    """Activation of the two-joint muscles before, and after, the reach; it rises between."""

    before: float = 0.05
    after: float = 0.20

    def at(self, share: FloatArray) -> FloatArray:
        """Activation at a share 0..1 of the duration."""
        u = np.clip(share, 0.0, 1.0)
        return np.asarray(self.before + (self.after - self.before) * u * u * (3 - 2 * u))


def feedforward(
    arm: Arm,
    motion: Motion2,
    device: FloatArray,
    level: FloatArray,
    reflex_gain: float = 0.0,
) -> MuscleCommand:
    """Commands under which the hand moves as intended, with every muscle's length on its way.

    ``f = f_0 + k (L - L_0) + b (dL - dL_0)``, where ``f_0`` makes the torque that the intended
    motion needs: ``-G^T f_0 + tau_passive = J^T (L a + b + F_device)``.

    Parameters
    ----------
    arm : Arm
    motion : Motion2 of (2, ...)
        The intended motion.
    device : (2, ...)
        Force that the hand must give to the device on it, inertia of handle and robot included.
    level : (...)
        Co-contraction of the two-joint muscles.
    reflex_gain : float
        Reflex tension per stretch as a fraction of a muscle's stiffness.

    Returns
    -------
    MuscleCommand of (6, ...) arrays
    """
    end = arm.link.end_motion(*motion.position, *motion.velocity)
    basis = basis_at(arm.link, end)
    G = np.stack(arm.paths.moment_arms(basis), axis=1)
    rate = G[:, 0] * end.w1 + G[:, 1] * end.w2
    passive = arm.passive_torque(basis[0], basis[3], end.w1, end.w2)
    wanted = np.stack(_torque(end, motion.acceleration, device)) - np.stack(passive)
    activation = _allocated(arm, G, wanted, level)
    tension, k, b = (
        np.moveaxis(part(np.moveaxis(activation, 0, -1)), -1, 0)
        for part in (arm.mechanics.tension, arm.mechanics.stiffness, arm.mechanics.viscosity)
    )
    # joint_torque adds b dL; the intended lengthening is no stretch
    still = np.zeros_like(rate)
    return MuscleCommand(tension - b * rate, k, b, arm.paths.length(basis), still, reflex_gain * k)


def _torque(
    end: EndMotion, acceleration: FloatArray, device: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``J^T (L a + b + F_device)``."""
    ax, ay = acceleration
    fx = end.Lxx * ax + end.Lxy * ay + end.bx + device[0]
    fy = end.Lxy * ax + end.Lyy * ay + end.by + device[1]
    # columns of the Jacobian: (-ry, rx) and (-uy, ux)
    return -end.ry * fx + end.rx * fy, -end.uy * fx + end.ux * fy


def _allocated(arm: Arm, G: FloatArray, wanted: FloatArray, level: FloatArray) -> FloatArray:
    """Activations (6, ...) near the co-contraction that make muscle torques `wanted` (2, ...)."""
    mechanics = arm.mechanics
    shape = (6,) + (1,) * level.ndim
    target = COCONTRACTION_SHARE.reshape(shape) * level
    A = -G * mechanics.max_tension.reshape((6, 1) + (1,) * level.ndim)
    missing = wanted + np.einsum("ij...,i->j...", G, mechanics.rest_tension)
    activation, free = target, np.ones_like(target)
    for _ in range(ROUNDS):
        # a = target W + W A (A^T W A)^-1 (missing - A^T target W), (6,) with (6, 2) and (2,)
        a = free * target
        rest = missing - np.einsum("ij...,i...->j...", A, a)
        S = np.einsum("ij...,i...,ik...->jk...", A, free, A)
        det = S[0, 0] * S[1, 1] - S[0, 1] ** 2
        m1 = (S[1, 1] * rest[0] - S[0, 1] * rest[1]) / det
        m2 = (S[0, 0] * rest[1] - S[0, 1] * rest[0]) / det
        activation = a + free * (A[:, 0] * m1 + A[:, 1] * m2)
        if activation.min() >= 0:
            break
        free = free * (activation >= 0)
    return np.maximum(activation, 0.0)
