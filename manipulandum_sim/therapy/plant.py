"""The therapy robot, what it carries and who is in it, through time; all trials side by side.

    M_r qdd + b_r + friction + cables + spring + M_h qdd + b_h + passive = motor + user

Controller and person act at every sample, and what they exert is held until the next one. Within
a sample the mass matrix, Coriolis and gravity torques, springs and the passive arm are those of its
predicted middle; bristles and velocities go on in `SUBSTEPS` leaps, friction implicit. What is
returned at the samples is exact: accelerations are solved from the equation above with everything
at the sample itself.

Sizes: T trials, S samples, n axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice
from manipulandum_sim.therapy.dynamics import (
    Moments,
    Payload,
    SerialChain,
    mass_and_bias,
    mass_matrix,
    needed_torque,
)
from manipulandum_sim.therapy.friction import Bristles

Progress = Callable[[int, int], None]
#: (k, measured angles (T, n), measured velocities (T, n)) -> motor torques (T, n); k counts samples
#: and is negative in the run-in. Called once a sample, in order.
Controller = Callable[[int, FloatArray, FloatArray], FloatArray]
#: (time in s, true angles, true velocities (T, n)) -> torque by the person (T, n). Once a sample.
User = Callable[[float, FloatArray, FloatArray], FloatArray]
#: (angles, velocities (..., T, n)) -> what the passive arm needs beside its masses, (..., T, n).
#: Has no memory: it is asked at samples and between them.
Passive = Callable[[FloatArray, FloatArray], FloatArray]

#: Steps of bristles and velocities within a sample.
SUBSTEPS: Final = 5
#: Low-pass of the measured velocity, first order, Hz.
VELOCITY_HZ: Final = 60.0
#: Samples of all trials that are gone through at once after the run.
_CHUNK: Final = 2048
_STEPS_TOLD: Final = 500


@dataclass(frozen=True)
class Motion:
    """Exact courses at the samples; all (S, T, n) unless told otherwise.

    Attributes
    ----------
    q, qd, qdd : rad, rad/s, rad/s^2
    motor : N m
        What the motors exert from this sample to the next.
    user : N m
        By the person, beyond the passive arm.
    friction, springs : N m
        Bristles' torque; cables and counterbalance spring.
    robot : N m
        ``M_r qdd + b_r``, links and rotors.
    arm : N m
        ``M_h qdd + b_h`` of what is carried.
    passive : N m
        Stiffness, tone and resistance of the arm.
    sensor : (S, T)
        N m, torque beyond the gear of axis 2: motor less friction and rotor.
    q_measured : rad
        As the encoders show it.
    """

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    motor: FloatArray
    user: FloatArray
    friction: FloatArray
    springs: FloatArray
    robot: FloatArray
    arm: FloatArray
    passive: FloatArray
    sensor: FloatArray
    q_measured: FloatArray

    @property
    def balance(self) -> FloatArray:
        """Left side less right side of the plant's equation, (S, T, n), N m."""
        needed = self.robot + self.friction + self.springs + self.arm + self.passive
        return np.asarray(needed - self.motor - self.user)


def nobody(_time: float, q: FloatArray, _qd: FloatArray) -> FloatArray:
    """No person."""
    return np.zeros_like(q)


def no_stiffness(q: FloatArray, _qd: FloatArray) -> FloatArray:
    """No passive arm, or a mock-up's."""
    return np.zeros_like(q)


def run(
    device: TherapyDevice,
    payload: Payload | None,
    start: FloatArray,
    controller: Controller,
    samples: int,
    *,
    user: User = nobody,
    passive: Passive = no_stiffness,
    run_in: int = 500,
    measured: bool = True,
    substeps: int = SUBSTEPS,
    progress: Progress | None = None,
) -> Motion:
    """Move T trials through `samples` samples at `RATE_HZ`.

    Parameters
    ----------
    payload : Payload or None
        Whose `upper_arm_m` the robots are adjusted to; None for empty robots as the device is.
    start : (T, n)
        Angles, rad, at rest with unbent bristles, `run_in` samples before the first that is kept.
    controller, user, passive : functions
        See `Controller`, `User`, `Passive`. Elementwise operations keep a trial's numbers the same
        whatever trials run beside it.
    measured : bool
        Whether the controller reads encoders with steps, or the true angles. Velocities are always
        filtered differences.
    substeps : int
    progress : function, optional
        Called with how many samples are done, of how many.

    Raises
    ------
    InputError
        Angles outside of the robot's limits at the start, or a payload for other trials.
    EstimationError
        The motion runs away.
    """
    plant = _Plant.of(device, payload, start)
    course = _Course.empty(samples, start.shape)
    state = _State.at_rest(start)
    estimate = _VelocityEstimate(device.encoder_rad[:, None] if measured else None)
    for k in range(-run_in, samples):
        seen, rate = estimate.update(state.q)
        limit = device.torque_limit_Nm[:, None]
        motor = np.clip(np.asarray(controller(k, seen.T, rate.T)).T, -limit, limit)
        own = np.asarray(user(k / RATE_HZ, state.q.T, state.qd.T)).T
        if k >= 0:
            course.keep(k, state, motor, own, seen)
        state = plant.step(state, motor + own, passive, substeps)
        if k % 100 == 0 and not np.abs(state.q).max() < 4 * np.pi:
            raise EstimationError(f"a simulated robot runs away {k / RATE_HZ:g} s into a trial")
        if progress is not None and (k + run_in + 1) % _STEPS_TOLD == 0:
            progress(k + run_in + 1, samples + run_in)
    if progress is not None:
        progress(samples + run_in, samples + run_in)
    return plant.finished(course, passive)


@dataclass(frozen=True)
class _State:
    """Angles, velocities, bristles and the last mean acceleration; all (n, T)."""

    q: FloatArray
    qd: FloatArray
    bend: FloatArray
    qdd: FloatArray

    @classmethod
    def at_rest(cls, start: FloatArray) -> _State:
        q = np.ascontiguousarray(start.T, dtype=float)
        return cls(q, *np.zeros((3, *q.shape)))


class _VelocityEstimate:
    """Estimate of the velocity that the controller has."""

    def __init__(self, step: FloatArray | None) -> None:
        self._step = step
        self._last: FloatArray | None = None
        self._rate: FloatArray | None = None
        self._share = 1 - float(np.exp(-2 * np.pi * VELOCITY_HZ / RATE_HZ))

    def update(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Measured angles and velocities (n, T)."""
        seen = q if self._step is None else np.rint(q / self._step) * self._step
        if self._last is None or self._rate is None:
            self._last, self._rate = seen, np.zeros_like(seen)
        self._rate = self._rate + self._share * ((seen - self._last) * RATE_HZ - self._rate)
        self._last = seen
        return seen, self._rate


@dataclass
class _Course:
    """Samples (S, n, T) as they come."""

    q: FloatArray
    qd: FloatArray
    bend: FloatArray
    motor: FloatArray
    user: FloatArray
    seen: FloatArray

    @classmethod
    def empty(cls, samples: int, shape: tuple[int, ...]) -> _Course:
        return cls(*(np.empty((samples, shape[1], shape[0])) for _ in range(6)))

    def keep(
        self, k: int, state: _State, motor: FloatArray, user: FloatArray, seen: FloatArray
    ) -> None:
        self.q[k], self.qd[k], self.bend[k] = state.q, state.qd, state.bend
        self.motor[k], self.user[k], self.seen[k] = motor, user, seen


@dataclass(frozen=True)
class _Plant:
    """A device with T payloads."""

    device: TherapyDevice
    chain: SerialChain
    links: Moments
    carried: Moments
    whole: Moments
    rotors: FloatArray
    bristles: Bristles

    @classmethod
    def of(cls, device: TherapyDevice, payload: Payload | None, start: FloatArray) -> _Plant:
        trials, n = start.shape
        if payload is None:
            payload = Payload.nothing(np.full(trials, device.upper_arm_m), n)
        if payload.n_trials != trials or payload.mass_kg.shape[1] != n:
            raise InputError(
                f"a payload of {payload.n_trials} trials and {payload.mass_kg.shape[1]} links",
                expected=f"{trials} trials and {n} links",
            )
        low, high = device.limits_rad.T
        if not ((start >= low) & (start <= high)).all():
            raise InputError("a trial starts outside of the robot's limits")
        rotors = device.motor_inertia_kgm2
        links, carried = device.moments(trials), Moments.of(payload)
        return cls(
            device,
            device.chain(payload.upper_arm_m),
            links,
            carried,
            links + carried,
            rotors,
            device.friction.bristles(rotors),
        )

    def step(self, state: _State, driving: FloatArray, passive: Passive, substeps: int) -> _State:
        """One sample on under motor and user torque (n, T)."""
        T = 1 / RATE_HZ
        qd = state.qd + T / 2 * state.qdd
        q = state.q + T / 2 * state.qd + T * T / 8 * state.qdd
        M, bias = mass_and_bias(self.chain, self.whole, q, qd)
        inverse = np.moveaxis(np.linalg.inv(np.moveaxis(self._with_rotors(M), -1, 0)), 0, -1)
        held = driving - bias - self.device.springs(q.T).T - np.asarray(passive(q.T, qd.T)).T
        return self._leaps(state, np.ascontiguousarray(inverse), held, substeps)

    def _leaps(self, state: _State, inverse: FloatArray, held: FloatArray, substeps: int) -> _State:
        """Bristles and velocities in turns, half a step apart; second order.

        ``v+ = v + dt M^-1 (n, n, T) (held - tau_f(z, v))`` with friction at its middle.
        """
        dt, law = 1 / RATE_HZ / substeps, self.bristles
        q, v = state.q, state.qd
        rate = law.rate(v)
        z = law.bent(state.bend, v, rate, dt / 2)
        for i in range(substeps):
            half = v + dt / 2 * (inverse * (held - law.torque(z, v, rate))).sum(axis=1)
            after = v + dt * (inverse * (held - law.torque(z, half))).sum(axis=1)
            q = q + dt / 2 * (v + after)
            v, rate = after, law.rate(after)
            z = law.bent(z, v, rate, dt if i + 1 < substeps else dt / 2)
        return _State(q, v, z, (v - state.qd) * RATE_HZ)

    def _with_rotors(self, M: FloatArray) -> FloatArray:
        n = len(self.rotors)
        M[range(n), range(n)] += self.rotors.reshape(n, *[1] * (M.ndim - 2))
        return M

    def finished(self, course: _Course, passive: Passive) -> Motion:
        """Everything else at the samples, from what was kept."""
        samples, n, trials = course.q.shape
        parts = {
            name: np.empty((samples, trials, n))
            for name in ("qdd", "friction", "springs", "robot", "arm", "passive")
        }
        stride = max(1, _CHUNK // trials)
        for first in range(0, samples, stride):
            rows = slice(first, first + stride)
            for name, values in self._at_samples(course, rows, passive).items():
                parts[name][rows] = values
        q, qd, motor, user, seen = (
            np.ascontiguousarray(part.transpose(0, 2, 1))
            for part in (course.q, course.qd, course.motor, course.user, course.seen)
        )
        gear = motor - parts["friction"] - self.rotors * parts["qdd"]
        return Motion(
            q=q, qd=qd, motor=motor, user=user, q_measured=seen, sensor=gear[..., 1], **parts
        )

    def _at_samples(self, course: _Course, rows: slice, passive: Passive) -> dict[str, FloatArray]:
        """Torques and accelerations (s, T, n) of some samples."""
        chain = self.chain.over_samples()
        # (n, s, T)
        q, qd = course.q[rows].transpose(1, 0, 2), course.qd[rows].transpose(1, 0, 2)
        bend = course.bend[rows].transpose(1, 0, 2)
        shape = bend.shape
        friction = self.bristles.torque(bend.reshape(len(q), -1), qd.reshape(len(q), -1))
        friction = np.moveaxis(friction.reshape(shape), 0, -1)
        angles, rates = np.moveaxis(q, 0, -1), np.moveaxis(qd, 0, -1)
        springs = self.device.springs(angles)
        stiff = np.asarray(passive(angles, rates))
        driving = np.moveaxis(course.motor[rows] + course.user[rows], 1, -1)
        at = chain.place(q)
        links, carried = (at.inertia(b.over_samples()) for b in (self.links, self.carried))
        M = mass_matrix(chain, at, links + carried)
        bias = needed_torque(chain, at, links + carried, qd)
        M = np.moveaxis(self._with_rotors(M), (0, 1), (-2, -1))
        right = driving - np.moveaxis(bias, 0, -1) - friction - springs - stiff
        # qdd (n,) = M^-1 (n, n) (motor + user - b - friction - springs - passive) (n,)
        qdd = np.asarray(np.linalg.solve(M, right[..., None])[..., 0], dtype=np.float64)
        turned = np.moveaxis(qdd, -1, 0)
        robot = np.moveaxis(needed_torque(chain, at, links, qd, turned), 0, -1)
        return {
            "qdd": qdd,
            "friction": friction,
            "springs": springs,
            "robot": robot + self.rotors * qdd,
            "arm": np.moveaxis(needed_torque(chain, at, carried, qd, turned), 0, -1),
            "passive": stiff,
        }


#: Of the position controller: N m/rad, N m s/rad, and the time constant of its integral, s.
POSITION_GAIN: Final = (3000.0, 3000.0, 1500.0, 1000.0, 300.0)
VELOCITY_GAIN: Final = (90.0, 90.0, 30.0, 22.0, 6.0)
INTEGRAL_S: Final = 0.15


class PositionController:
    """PD about a reference, its static load fed forward, an integral while the reference moves.

    The integral rests where the reference does: with stiction it would hunt. `Controller`.

    Parameters
    ----------
    device : TherapyDevice
        Whose weight and springs are fed forward.
    q, qd : (S, T, n)
        Reference, rad, rad/s; its first sample is held through the run-in.
    """

    def __init__(self, device: TherapyDevice, q: FloatArray, qd: FloatArray) -> None:
        self._q, self._qd = q, qd
        still = np.zeros((len(q), q.shape[2]))
        load = [device.rigid_torque(q[:, t], still, still) for t in range(q.shape[1])]
        self._load = np.stack(load, axis=1) + device.springs(q)
        self._sum = np.zeros(q.shape[1:])

    def __call__(self, k: int, q: FloatArray, qd: FloatArray) -> FloatArray:
        i = max(k, 0)
        error = self._q[i] - q
        self._sum += np.where(self._qd[i] != 0, error, 0.0) / (INTEGRAL_S * RATE_HZ)
        torque = self._load[i] + np.multiply(POSITION_GAIN, error + self._sum)
        return np.asarray(torque + np.multiply(VELOCITY_GAIN, self._qd[i] - qd))
