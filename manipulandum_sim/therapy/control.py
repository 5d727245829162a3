"""Controllers of the therapy robot with a person in it, at 1 kHz, from measured angles alone.

All of them add what the robot itself needs, by a model of it that is about one per cent off. Then:

- position: the reference is followed (proportional, integral, derivative);
- assist: one-sided. Only an axis that is below its reference is pushed, and only upwards; ahead of
  the reference the person is free, beyond the target a soft stop waits;
- free: nothing else. The person's own timing. The robot's inertia is left to the person, as in the
  source, unless a share of it is compensated from the measured acceleration.

The axes that do not move are held by the position controller throughout.

Friction is compensated for the reference's velocity under position control, which cannot become
unstable. Otherwise by the measured one, and less than all of it: `COMPENSATED` of the Coulomb and
`VISCOUS_COMPENSATED` of the viscous part, the Coulomb part as ``sign(v) (1 - exp(-(v / v_0)^2))``,
which has no slope at rest: what sticks is not shaken loose by its own sensor's noise. While the
person is to move, v is biased by a few deg/s towards the target, or nobody could break the axis
loose with less than its static friction.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice
from manipulandum_sim.therapy.dynamics import Moments, SerialChain, inverse_dynamics
from manipulandum_sim.therapy.reference import Reference

POSITION, ASSIST, FREE = 0, 1, 2

#: Position controller, axes 1 to 5: N m/rad, N m/(rad s), N m s/rad. About 4 Hz with the robot's
#: inertia about each axis.
POSITION_P: Final = np.array([1500.0, 1200.0, 250.0, 250.0, 40.0])
POSITION_I: Final = np.array([4500.0, 3600.0, 750.0, 750.0, 120.0])
POSITION_D: Final = np.array([90.0, 75.0, 12.0, 12.0, 1.5])
#: One-sided assistance, axes 1 and 2: soft enough to be felt, stiff enough to carry an arm.
ASSIST_P: Final = np.array([400.0, 250.0, 0.0, 0.0, 0.0])
ASSIST_D: Final = np.array([40.0, 25.0, 0.0, 0.0, 0.0])
#: Angle over which the assistance's damping fades in, rad.
FADE_RAD: Final = float(np.deg2rad(0.5))

COMPENSATED: Final = 0.98
VISCOUS_COMPENSATED: Final = 0.97
#: v_0 and the bias, rad/s.
REST_rad_s: Final = float(np.deg2rad(2.0))
BIAS_rad_s: Final = float(np.deg2rad(4.0))
#: Time over which the bias of a free person fades in, s, and distance from the target over which
#: it fades out, rad.
GOING_S: Final = 0.2
NEAR_RAD: Final = float(np.deg2rad(2.0))
#: Speed of a reference at which the friction under position control is whole, rad/s.
FOLLOWED_rad_s: Final = float(np.deg2rad(0.3))
#: Low-pass of the acceleration from which inertia is compensated, first order, Hz.
ACCELERATION_HZ: Final = 5.0
#: Sd of the model's parameters about the truth.
MODEL_SD: Final = 0.01


def identified(device: TherapyDevice, rng: np.random.Generator) -> TherapyDevice:
    """The robot as its makers know it: masses, friction, cables and spring each about 1 % off."""
    off = 1 + MODEL_SD * rng.standard_normal(4)
    links = (
        replace(s, mass_kg=s.mass_kg * off[0], inertia_kgm2=s.inertia_kgm2 * off[0])
        for s in device.skeleton.segments
    )
    return replace(
        device,
        skeleton=replace(device.skeleton, segments=tuple(links)),
        friction=device.friction.scaled(float(off[1])),
        cable_stiffness=device.cable_stiffness * off[2],
        spring=replace(device.spring, stiffness=float(device.spring.stiffness * off[3])),
    )


def friction_share(velocity: FloatArray) -> FloatArray:
    """``sign(v) (1 - exp(-(v / v_0)^2))``: odd, flat at rest."""
    return np.asarray(-np.sign(velocity) * np.expm1(-np.square(velocity / REST_rad_s)))


@dataclass
class TherapyController:
    """Controller of T trials; it has a memory (the integrals) and serves one run.

    Attributes
    ----------
    model : TherapyDevice
        As `identified`.
    chain, bodies :
        Of the model, adjusted to each trial's upper arm.
    reference : Reference
    mode : (T,)
        POSITION, ASSIST or FREE, of the moving axis.
    integral : (T, 5)
        N m.
    held, assisted : (T, 5) bool
        Axes under position control, and with assistance.
    inertia_share : (T, 5)
        Of the robot's inertia that is compensated, where the person is free.
    last_rate, sensed : (T, 5)
        The velocity one sample ago, rad/s, and the acceleration, rad/s^2.
    """

    model: TherapyDevice
    chain: SerialChain
    bodies: Moments
    reference: Reference
    mode: Any
    integral: FloatArray
    held: Any
    assisted: Any
    inertia_share: FloatArray
    last_rate: FloatArray
    sensed: FloatArray

    @classmethod
    def of(
        cls,
        model: TherapyDevice,
        upper_arm_m: FloatArray,
        reference: Reference,
        mode: Any,
        inertia_share: float = 0.0,
    ) -> TherapyController:
        """Adjusted to upper arms (T,), before a run."""
        trials, mode = len(upper_arm_m), np.asarray(mode)
        moving = np.arange(model.n_axes) == np.asarray(reference.axis)[:, None]
        return cls(
            model,
            model.chain(upper_arm_m),
            model.moments(trials),
            reference,
            mode,
            integral=np.zeros((trials, model.n_axes)),
            held=~moving | (mode == POSITION)[:, None],
            assisted=moving & (mode == ASSIST)[:, None],
            inertia_share=inertia_share * (moving & (mode == FREE)[:, None]),
            last_rate=np.zeros((trials, model.n_axes)),
            sensed=np.zeros((trials, model.n_axes)),
        )

    def __call__(self, k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
        """Motor torques (T, 5) from measured angles and velocities (T, 5)."""
        time = k / RATE_HZ
        wanted = self.reference.at(time)
        torque = np.where(self.held, self._follow(q, qd, wanted), 0.0)
        torque += np.where(self.assisted, self._assist(q, qd, wanted), 0.0)
        return torque + self._robot(time, q, qd, wanted)

    def _follow(self, q: FloatArray, qd: FloatArray, wanted: tuple[FloatArray, ...]) -> FloatArray:
        behind, slow = wanted[0] - q, wanted[1] - qd
        self.integral += POSITION_I / RATE_HZ * behind
        return POSITION_P * behind + POSITION_D * slow + self.integral

    def _assist(self, q: FloatArray, qd: FloatArray, wanted: tuple[FloatArray, ...]) -> FloatArray:
        behind, slow = wanted[0] - q, wanted[1] - qd
        fade = np.clip(behind / FADE_RAD, 0.0, 1.0)
        push = np.maximum(ASSIST_P * behind + ASSIST_D * fade * slow, 0.0)
        # beyond the target of a movement that goes up
        size = self.reference.size[:, None]
        end = self.reference.start + np.maximum(size, 0.0)
        beyond = np.where(size > 0, q - end, 0.0)
        stop = np.clip(beyond / FADE_RAD, 0.0, 1.0)
        return np.asarray(push - np.maximum(ASSIST_P * beyond + ASSIST_D * stop * qd, 0.0) * stop)

    def _robot(
        self, time: float, q: FloatArray, qd: FloatArray, wanted: tuple[FloatArray, ...]
    ) -> FloatArray:
        """Torque that the model demands of the robot; its inertia only where it is held."""
        held, model = self.held, self.model
        keep = np.exp(-2 * np.pi * ACCELERATION_HZ / RATE_HZ)
        self.sensed = keep * self.sensed + (1 - keep) * RATE_HZ * (qd - self.last_rate)
        self.last_rate = qd
        acceleration = np.where(held, wanted[2], self.inertia_share * self.sensed)
        rigid = inverse_dynamics(self.chain, self.bodies, q.T, np.zeros_like(q.T), acceleration.T)
        rotors = model.motor_inertia_kgm2 * acceleration
        return np.asarray(rigid.T + rotors + model.springs(q) + self._friction(time, q, qd, wanted))

    def _friction(
        self, time: float, q: FloatArray, qd: FloatArray, wanted: tuple[FloatArray, ...]
    ) -> FloatArray:
        law = self.model.friction
        planned = law.coulomb * np.tanh(wanted[1] / FOLLOWED_rad_s) + law.viscous * wanted[1]
        biased = qd + self._bias(time, q, wanted[1])
        sensed = COMPENSATED * law.coulomb * friction_share(biased)
        sensed += VISCOUS_COMPENSATED * law.viscous * qd
        return np.where(self.held, planned, sensed)

    def _bias(self, time: float, q: FloatArray, planned: FloatArray) -> FloatArray:
        """Added to a measured velocity: the reference's, or towards the target once one may go."""
        plan = self.reference
        size = plan.size[:, None]
        left = (plan.start + size - q) * np.sign(size)
        begun = np.clip((time - plan.begin_s) / GOING_S, 0.0, 1.0)[:, None]
        goal = np.sign(size) * BIAS_rad_s * np.clip(left / NEAR_RAD, 0.0, 1.0) * begun
        free = (self.mode == FREE)[:, None]
        return np.where(free, goal, np.clip(planned, -BIAS_rad_s, BIAS_rad_s))
