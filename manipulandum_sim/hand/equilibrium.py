"""Which activations hold a posture and a hand force: static optimisation."""

from __future__ import annotations

from itertools import product
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.arm_plant import Arm, MuscleCommand
from manipulandum_sim.hand.muscles import N_MUSCLES, joint_basis

#: Preferred share of the co-contraction in each muscle: the two-joint muscles, which the subject
#: sees on the screen, lead, and the others join in.
COCONTRACTION_SHARE: Final = np.array([0.3, 0.3, 0.3, 0.3, 1.0, 1.0])


def hand_jacobian(arm: Arm, posture: FloatArray) -> FloatArray:
    """Jacobian of the hand at a posture.

    Parameters
    ----------
    arm : Arm
    posture : (2,)
        Joint angles, rad.

    Returns
    -------
    (2, 2)
        ``dp/dq``, m.
    """
    x, y = arm.link.end_position(posture[0], posture[1])
    m = arm.link.end_motion(x, y, np.zeros(()), np.zeros(()))
    return np.array([[-m.ry, -m.uy], [m.rx, m.ux]])


def muscle_jacobian(arm: Arm, posture: FloatArray) -> FloatArray:
    """``G = dL/dq``, (6, 2), at a posture (2,)."""
    return np.stack(arm.paths.moment_arms(joint_basis(*posture)), axis=1)


def _nearest_nonnegative(target: FloatArray, A: FloatArray, c: FloatArray) -> FloatArray | None:
    """The nonnegative a nearest to `target` with ``A a = c``: all 64 active sets, best one wins."""
    best, best_cost = None, np.inf
    for choice in product((True, False), repeat=N_MUSCLES):
        free = np.array(choice)
        part = A[:, free]
        a = np.zeros(N_MUSCLES)
        # minimise |a - target|^2 with part a = c: a = target + part^+ (c - part target)
        step = np.linalg.lstsq(part, c - part @ target[free], rcond=None)[0] if free.any() else 0
        a[free] = target[free] + step
        feasible = a.min() >= -1e-12 and np.abs(A @ a - c).max() <= 1e-9
        cost = float(((a - target) ** 2).sum())
        if feasible and cost < best_cost:
            best, best_cost = np.clip(a, 0.0, None), cost
    return best


def solve_activation(
    arm: Arm, posture: FloatArray, force: FloatArray, cocontraction: float | None = None
) -> FloatArray:
    """Activations (6,) that bear a hand force at a posture with least effort.

    ``tau_passive - G^T f = J^T F``, ``f = rest + max a``, ``a >= 0``; least sum of squares, or with
    co-contraction the nearest to the preferred pattern whose muscles 5 and 6 have that mean.

    Parameters
    ----------
    posture : (2,) rad
    force : (2,) N, by the hand on the handle
    cocontraction : float, optional
        Mean activation of muscles 5 and 6, 0..1.

    Raises
    ------
    InputError
        If no activation in 0..1 does it.
    """
    G, J = muscle_jacobian(arm, posture), hand_jacobian(arm, posture)
    still = np.zeros(())
    passive = np.array(arm.passive_torque(posture[0], posture[1], still, still))
    # (2, 6) (6,) = (2,)
    A = G.T * arm.mechanics.max_tension
    c = passive - J.T @ force - G.T @ arm.mechanics.rest_tension
    target = np.zeros(N_MUSCLES)
    if cocontraction is not None:
        target = cocontraction * COCONTRACTION_SHARE
        A = np.vstack([A, [0, 0, 0, 0, 0.5, 0.5]])
        c = np.append(c, cocontraction)
    activation = _nearest_nonnegative(target, A, c)
    if activation is None or activation.max() > 1:
        raise InputError(
            f"no muscle activation holds a hand force of {np.hypot(*force):.3g} N at "
            f"{np.round(posture, 2).tolist()} rad with co-contraction {cocontraction}",
            expected="a smaller force or another co-contraction",
        )
    return activation


def muscle_command(
    arm: Arm,
    postures: FloatArray,
    activations: FloatArray,
    *,
    drift: FloatArray | None = None,
    reflex_gain: float = 0.0,
) -> MuscleCommand:
    """Command of the muscles for which each posture is the equilibrium at time 0.

    Parameters
    ----------
    arm : Arm
    postures : (T, 2)
        rad.
    activations : (T, 6)
    drift : (T, 2), optional
        Velocity of the virtual hand position (m/s).
    reflex_gain : float
        Reflex tension per stretch as a fraction of the muscle's stiffness.

    Returns
    -------
    MuscleCommand of (6, T) arrays
    """
    q1, q2 = np.asarray(postures, dtype=float).T
    basis = joint_basis(q1, q2)
    length = arm.paths.length(basis)
    velocity = np.zeros_like(length)
    if drift is not None:
        m = arm.link.end_motion(*arm.link.end_position(q1, q2), drift[:, 0], drift[:, 1])
        G1, G2 = arm.paths.moment_arms(basis)
        velocity = G1 * m.w1 + G2 * m.w2
    mechanics = arm.mechanics
    tension, k, viscosity = (
        np.ascontiguousarray(part(activations).T)
        for part in (mechanics.tension, mechanics.stiffness, mechanics.viscosity)
    )
    return MuscleCommand(tension, k, viscosity, length, velocity, reflex_gain * k)
