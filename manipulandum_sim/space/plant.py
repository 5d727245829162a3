"""Arm and muscles at work: torques of the joints, and the force of the hand on what it holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy.optimize import lsq_linear

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import SimulatedSubject
from manipulandum_sim.space.arm import AXIAL, FOUR, SpaceArm
from manipulandum_sim.space.muscles import Muscles, SpaceMuscles
from manipulandum_sim.space.wrist_muscles import WristMuscles

#: The joints' own tissue, those of the wrist last: N m/rad and N m s/rad.
TISSUE_STIFFNESS: Final = (1.5, 1.5, 0.8, 1.0, 0.3, 0.6, 0.5)
TISSUE_VISCOSITY: Final = (0.2, 0.2, 0.08, 0.15, 0.02, 0.03, 0.03)
#: No muscle works harder in a measurement.
STRONGEST: Final = 0.9
#: Torque that the muscles may miss, parts of what they must bear.
MISSED: Final = 1e-9


@dataclass(frozen=True)
class Plant:
    """A subject's arm whose muscles hold a posture.

    ``f = tension + stiffness (L - L0) + viscosity dL``, never below 0; ``tau = -G^T f`` and the
    joints' tissue, which is slack at the posture.

    Attributes
    ----------
    arm : SpaceArm
    muscles : Muscles
    posture : (n,)
        Where the tensions are told, rad.
    tension : (m,)
        N.
    moving : tuple of int
        The joints that move; the others are held.
    """

    arm: SpaceArm
    muscles: Muscles
    posture: FloatArray
    tension: FloatArray
    moving: tuple[int, ...]

    @cached_property
    def _held(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lengths, stiffnesses and viscosities (m,) of the muscles at the posture."""
        f, length = self.tension, self.muscles.length(self.posture[None])[0]
        return length, self.muscles.stiffness(f), self.muscles.viscosity(f)

    def full(self, q: FloatArray) -> FloatArray:
        """All joints' angles (N, n) from those that move (N, r)."""
        whole = np.tile(self.posture, (len(q), 1))
        whole[:, self.moving] = q
        return whole

    def torque(self, q: FloatArray, qd: FloatArray) -> FloatArray:
        """Torque (N, n) of muscles and tissue, N m."""
        rest, stiffness, viscosity = self._held
        length, G = self.muscles.paths(q)
        f = self.tension + stiffness * (length - rest)
        f = np.maximum(f + viscosity * (G @ qd[..., None])[..., 0], 0.0)
        own, drag = (np.array(t[: q.shape[1]]) for t in (TISSUE_STIFFNESS, TISSUE_VISCOSITY))
        tissue = own * (q - self.posture) + drag * qd
        # tau (N, n) = -G^T (n, m) f (m,)
        return np.asarray(-(f[:, None] @ G)[:, 0] - tissue)


def moving_joints(joints: int, elbow_held: bool, wrist_locked: bool) -> tuple[int, ...]:
    """The joints that move: without the upper arm's turning about its axis, where it is held."""
    last = FOUR if wrist_locked else joints
    return tuple(j for j in range(last) if not elbow_held or j != AXIAL)


def plant_at(
    subject: SimulatedSubject,
    posture: FloatArray,
    force: FloatArray,
    cocontraction: float,
    elbow_held: bool,
    wrist_locked: bool = False,
) -> Plant:
    """The arm in balance with its weight and the hand's force.

    Parameters
    ----------
    subject : SimulatedSubject
    posture : (n,)
        rad; seven angles where the wrist is free, or its angles are known.
    force : (3,)
        By the hand on what it holds, N.
    cocontraction : float
        Least activation of every muscle, as a part of its greatest tension.
    elbow_held, wrist_locked : bool

    Returns
    -------
    Plant

    Raises
    ------
    InputError
        The muscles cannot bear it.
    """
    posture = np.asarray(posture, dtype=float)
    seven = len(posture) > FOUR
    arm = SpaceArm.of(subject, seven)
    muscles: Muscles = WristMuscles.of(subject) if seven else SpaceMuscles.of(subject.strength)
    still = arm.dynamics(posture[None], np.zeros((1, arm.joints)))
    needed = still.h[0] + still.J[0].T @ force
    tension = _least_effort(muscles, posture, needed, cocontraction)
    return Plant(
        arm, muscles, posture, tension, moving_joints(arm.joints, elbow_held, wrist_locked)
    )


def _least_effort(
    muscles: Muscles, posture: FloatArray, torque: FloatArray, least: float
) -> FloatArray:
    """The tensions (m,) of least squared activation that make a torque (n,)."""
    if not 0 <= least < STRONGEST:
        raise InputError(f"co-contraction of {least}", expected=f"0 to {STRONGEST} of the greatest")
    pull = -(muscles.jacobian(posture[None])[0] * muscles.greatest[:, None]).T
    heavy = 1e4
    count = len(muscles.greatest)
    A = np.vstack([heavy * pull, np.eye(count)])
    b = np.concatenate([heavy * torque, np.zeros(count)])
    start = lsq_linear(A, b, bounds=(least, STRONGEST), tol=1e-14)
    free = start.active_mask == 0
    # the muscles between their limits then meet the torque exactly
    miss = torque - pull @ start.x
    activation = start.x.copy()
    activation[free] += np.linalg.pinv(pull[:, free]) @ miss
    left = float(np.abs(torque - pull @ activation).max())
    if left > MISSED * max(1.0, float(np.abs(torque).max())):
        raise InputError(f"the muscles miss {left:.2g} N m of the torque", expected="less force")
    return np.asarray(activation * muscles.greatest)
