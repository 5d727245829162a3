"""The planar and the spatial arm as whatever holds their hand feels them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand import Arm, MuscleCommand
from manipulandum_sim.space import Plant


class Held(NamedTuple):
    """One instant of T limbs with r coordinates q.

    ``A qdd = pull + J^T (force on the hand)``: A (T, r, r), pull (T, r); hand place and velocity
    (T, d), J (T, d, r), ``Jdot qd`` (T, d); stretch of the muscles (T, m).
    """

    A: FloatArray
    pull: FloatArray
    place: FloatArray
    velocity: FloatArray
    J: FloatArray
    drift: FloatArray
    stretch: FloatArray


class Limb(Protocol):
    """Interface of a limb that is integrated."""

    @property
    def start(self) -> FloatArray:
        """Coordinates (r,) at rest."""

    def at(self, q: FloatArray, qd: FloatArray, delayed: FloatArray | None) -> Held:
        """The limb at coordinates and rates (T, r); `delayed` is the stretch of before (T, m)."""


@dataclass(frozen=True)
class PlanarLimb:
    """Two links and six muscles; the coordinates are the hand's own.

    Attributes
    ----------
    arm : Arm
    muscles : MuscleCommand
        (6, 1) each.
    hand : (2,)
    """

    arm: Arm
    muscles: MuscleCommand
    hand: FloatArray

    @property
    def start(self) -> FloatArray:
        """The hand's place at rest."""
        return self.hand

    def at(self, q: FloatArray, qd: FloatArray, delayed: FloatArray | None) -> Held:
        """See `Limb`."""
        end = self.arm.link.end_motion(*q.T, *qd.T)
        late = 0.0 if delayed is None else delayed.T
        pulled, stretch = self.arm.muscle_force_at_hand(end, self.muscles, 0.0, late)
        A = np.stack([end.Lxx, end.Lxy, end.Lxy, end.Lyy], axis=-1).reshape(-1, 2, 2)
        pull = np.stack([pulled[0] - end.bx, pulled[1] - end.by], axis=-1)
        J = np.broadcast_to(np.eye(2), A.shape)
        return Held(A, pull, q, qd, J, np.zeros_like(q), stretch.length.T)


@dataclass(frozen=True)
class SpaceLimb:
    """The spatial arm; the coordinates are the joints that move.

    Attributes
    ----------
    plant : Plant
    reflex_gain : float
        Of each muscle's stiffness.
    """

    plant: Plant
    reflex_gain: float = 0.0

    @property
    def start(self) -> FloatArray:
        """The moving joints' angles at rest."""
        return self.plant.posture[list(self.plant.moving)]

    def at(self, q: FloatArray, qd: FloatArray, delayed: FloatArray | None) -> Held:
        """See `Limb`."""
        plant, r = self.plant, list(self.plant.moving)
        full, rates = plant.full(q), np.zeros((len(q), len(plant.posture)))
        rates[:, r] = qd
        now = plant.arm.dynamics(full, rates)
        torque = plant.torque(full, rates) - now.h
        length, G = plant.muscles.paths(full)
        if delayed is not None:
            late = self.reflex_gain * plant.muscles.stiffness(plant.tension) * delayed
            torque = torque - (late[:, None] @ G)[:, 0]
        stretch = length - plant.muscles.length(plant.posture[None])
        A, J = now.M[:, r][:, :, r], now.J[:, :, r]
        return Held(A, torque[:, r], now.place, now.velocity, J, now.drift, stretch)

    def reflex_at_hand(self) -> FloatArray:
        """Stiffness of the hand that the reflex adds after its delay, (3, 3)."""
        plant, r = self.plant, list(self.plant.moving)
        q = plant.posture[None]
        J = plant.arm.dynamics(q, np.zeros_like(q)).J[0][:, r]
        G = plant.muscles.jacobian(q)[0][:, r] @ np.linalg.inv(J)
        gain = self.reflex_gain * plant.muscles.stiffness(plant.tension)
        # (3, 3) = (3, m) (m,) (m, 3)
        return np.asarray((G.T * gain) @ G)
