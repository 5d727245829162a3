"""Arm and exoskeleton as one hinge, with the two-loop control (1)-(2), all trials side by side.

The control reads its sensors at every sample and its command reaches the motor one sample later.
Between samples the command is held and the motion is integrated by Runge and Kutta's fourth-order
step; the motor's current follows exactly.

(2) as printed drops q0 and does not say how the interaction torque is filtered "so that only the
torque opposing voluntary motion is fed back". Here the reference is about q0 and what is fed back
is the filtered difference of reference and interaction: with a low-pass L and a gain G

    command = fd - fmt + G L (fd - fmt - interaction)

the limb feels ``fd - fmt`` less the device's own dynamics over ``1 + G L``.

Sizes: T trials, S control samples, H = 2 S - 1 instants twice as fine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from manipulandum_sim.elbow.device import (
    GYROSCOPE,
    MOTOR_COMMAND,
    MOTOR_CURRENT,
    POTENTIOMETER,
    RATE_HZ,
    STRAIN_GAUGE,
    Exoskeleton,
    Limits,
    Rendered,
)

Progress = Callable[[int, int], None]

#: Low-pass of the control's kinematics: Butterworth, second order, Hz.
KINEMATICS_HZ: Final = 10.0
#: Feedback of the interaction torque: gain, first-order low-pass Hz.
HIDING_GAIN: Final = 4.0
HIDING_HZ: Final = 3.0
#: What the sensors are called in `Motion.measured`, in their order.
SENSORS: Final = (POTENTIOMETER, GYROSCOPE, STRAIN_GAUGE, MOTOR_CURRENT)
ANGLE, GYRO, GAUGE, CURRENT = range(4)
#: Why a trial was stopped, by the number in `Motion.cause`.
CAUSES: Final = ("", "velocity", "torque")
_STEPS_TOLD: Final = 500


@dataclass(frozen=True)
class Drive:
    """Inputs to arm and device in T trials.

    Attributes
    ----------
    inertia, gravity : float
        The limb's, kg m^2 and N m (see `ElbowSubject`).
    K, B : (H, T)
        Muscles' stiffness and viscosity.
    push : (H, T)
        Torque on the limb that does not depend on its motion, N m: the muscles' part
        ``isometric + K rest + B rest_rate`` and the voluntary torque.
    load : (T,)
        Constant torque asked of the device, N m.
    perturbation : (S, T)
    rendered : Rendered
    q0 : float
        rad.
    angle, rate : (T,)
        Angle and angular velocity at the first instant.
    """

    inertia: float
    gravity: float
    K: FloatArray
    B: FloatArray
    push: FloatArray
    load: FloatArray
    perturbation: FloatArray
    rendered: Rendered
    q0: float
    angle: FloatArray
    rate: FloatArray


@dataclass(frozen=True)
class Motion:
    """Motion and torques of T trials at S samples.

    Attributes
    ----------
    angle, rate, acceleration, interaction, motor : (S, T)
        Exact; torque by the device on the limb, torque of the motor.
    measured : (4, S, T)
        Through `SENSORS`.
    stop : (T,) int
        Sample at which a limit was met; S if none was.
    cause : (T,) int
        Number of the cause in `CAUSES`.
    """

    angle: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    interaction: FloatArray
    motor: FloatArray
    measured: FloatArray
    stop: IntArray
    cause: IntArray


class Sensing:
    """The four sensors at once: noise, counts, full scale; or nothing of it."""

    def __init__(self, noise: FloatArray | None) -> None:
        self._noise = noise
        column = np.array([[c.low, c.high - c.step, c.step] for c in SENSORS])[..., None]
        self._low, self._high, self._step = column[:, 0], column[:, 1], column[:, 2]

    def read(self, k: int, exact: FloatArray) -> FloatArray:
        """Sensor readings of sample k from states (4, T)."""
        return exact if self._noise is None else self._convert(exact + self._noise[:, k])

    def read_all(self, exact: FloatArray) -> FloatArray:
        """Sensor readings of all samples from states (4, S, T)."""
        if self._noise is None:
            return exact
        return self._convert((exact + self._noise).transpose(1, 0, 2)).transpose(1, 0, 2)

    def _convert(self, values: FloatArray) -> FloatArray:
        counts = np.rint((values - self._low) / self._step) * self._step + self._low
        return np.clip(counts, self._low, self._high)


class Control:
    """The two loops, one sample after another, for T trials."""

    def __init__(self, drive: Drive, converted: bool) -> None:
        from scipy.signal import butter

        trials = len(drive.load)
        self._drive, self._converted = drive, converted
        b, a = butter(2, KINEMATICS_HZ, fs=RATE_HZ)
        self._b, self._a = [float(x) for x in b], [float(x) for x in a]
        self._states = np.zeros((2, 2, trials))
        self._kinematics = np.zeros((2, trials))
        self._keep = float(np.exp(-2 * np.pi * HIDING_HZ / RATE_HZ))
        self._error = np.zeros(trials)

    def command(self, k: int, measured: FloatArray) -> FloatArray:
        """Torque (T,) for the motor from the sensors (4, T) at sample k."""
        wanted = self._drive.perturbation[k] + self._drive.load + self._reference(measured)
        self._error *= self._keep
        self._error += (1 - self._keep) * (wanted - measured[GAUGE])
        command = wanted + HIDING_GAIN * self._error
        return MOTOR_COMMAND.convert(command) if self._converted else command

    def _reference(self, measured: FloatArray) -> FloatArray:
        """``-(I qdd + B qd + K (q - q0))`` (1) of the low-passed kinematics."""
        now = measured[:2].copy()
        now[0] -= self._drive.q0
        b, a, before = self._b, self._a, self._kinematics
        # transposed direct form II: y = b0 x + s1, s1 = b1 x - a1 y + s2, s2 = b2 x - a2 y
        smooth = b[0] * now + self._states[0]
        self._states[0] = b[1] * now - a[1] * smooth + self._states[1]
        self._states[1] = b[2] * now - a[2] * smooth
        self._kinematics = smooth
        asked = self._drive.rendered
        torque = asked.stiffness * smooth[0] + asked.viscosity * smooth[1]
        if asked.inertia:
            torque += asked.inertia * RATE_HZ * (smooth[1] - before[1])
        return -torque


def run(
    drive: Drive,
    device: Exoskeleton,
    noise: FloatArray | None,
    limits: Limits,
    progress: Progress | None = None,
) -> Motion:
    """Integrate T trials.

    Parameters
    ----------
    noise : (4, S, T) or None
        Noise of the sensors; None: exact sensors and commands, without converters.
    """
    samples, trials = drive.perturbation.shape
    sensing, control = Sensing(noise), Control(drive, noise is not None)
    step = _Step(drive, device)
    state = np.stack([drive.angle, drive.rate, drive.load])
    command = np.array(drive.load)
    out = np.empty((5, samples, trials))
    measured = np.empty((4, samples, trials))
    stop = np.full(trials, samples)
    for k in range(samples):
        acceleration = step.acceleration(2 * k, state[0], state[1], state[2])
        interaction = step.interaction(2 * k, state[0], state[1], acceleration)
        out[:3, k], out[3, k], out[4, k] = (*state[:2], acceleration), interaction, state[2]
        seen = measured[:, k]
        seen[...] = sensing.read(k, np.stack([state[0], state[1], interaction, state[2]]))
        met = limit_met(seen, limits)
        if met.any():
            stop[(met > 0) & (stop == samples)] = k
        if k + 1 < samples:
            # the command worked out one sample ago is held until the next
            state = step.advance(k, state, acceleration, command)
            command = np.where(stop < samples, 0.0, control.command(k, seen))
        if progress is not None and ((k + 1) % _STEPS_TOLD == 0 or k + 1 == samples):
            progress(k + 1, samples)
    stop, cause = find_stops(measured, limits)
    angle, rate, acceleration, interaction, motor = out
    return Motion(angle, rate, acceleration, interaction, motor, measured, stop, cause)


def limit_met(measured: FloatArray, limits: Limits) -> IntArray:
    """Which of `CAUSES` the sensors (4, ...) show, (...,)."""
    fast = np.abs(measured[GYRO]) > limits.velocity
    strong = np.abs(measured[GAUGE]) > limits.torque
    return np.where(fast, 1, np.where(strong, 2, 0))


def find_stops(measured: FloatArray, limits: Limits) -> tuple[IntArray, IntArray]:
    """First sample (T,) of (4, S, T) at which a limit is met (S: never), and which of `CAUSES`."""
    met = limit_met(measured, limits)
    samples = len(met)
    stop = np.where(met.any(axis=0), met.astype(bool).argmax(axis=0), samples)
    last = np.minimum(stop, samples - 1)
    return stop, np.take_along_axis(met, last[None], axis=0)[0]


class _Step:
    """The equations of motion of arm and device strapped together, and one step of theirs."""

    def __init__(self, drive: Drive, device: Exoskeleton) -> None:
        self._drive, self._device = drive, device
        self._all = drive.inertia + device.inertia
        steps = 1 / (RATE_HZ * device.motor_lag_s)
        self._last = float(np.exp(-steps))
        # For a torque that depends on time alone the step comes down to Simpson's rule. The middle
        # is what makes that exact for the motor's decay, 2e-5 from the decay's own middle.
        mean = (1 - self._last) / steps
        self._middle = (6 * mean - 1 - self._last) / 4

    def acceleration(
        self, n: int, angle: FloatArray, rate: FloatArray, motor: FloatArray
    ) -> FloatArray:
        """``(I + I_d) theta'' = motor - device's friction + torque on the limb`` at instant n."""
        torque = motor - self._device.resistance(rate) + self._own(n, angle, rate)
        return torque / self._all

    def interaction(
        self, n: int, angle: FloatArray, rate: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Torque by the device on the limb: what Newton asks beyond the limb's own."""
        return np.asarray(self._drive.inertia * acceleration - self._own(n, angle, rate))

    def _own(self, n: int, angle: FloatArray, rate: FloatArray) -> FloatArray:
        d = self._drive
        spring = d.K[n] * angle + d.B[n] * rate
        return np.asarray(d.push[n] - spring - d.gravity * np.sin(angle))

    def advance(
        self, k: int, state: FloatArray, first: FloatArray, command: FloatArray
    ) -> FloatArray:
        """From sample k to the next under a held command; `first` is the acceleration at k."""
        h, (angle, v1, motor), n = 1 / RATE_HZ, state, 2 * k
        middle = command + (motor - command) * self._middle
        last = command + (motor - command) * self._last
        v2 = v1 + h / 2 * first
        a2 = self.acceleration(n + 1, angle + h / 2 * v1, v2, middle)
        v3 = v1 + h / 2 * a2
        a3 = self.acceleration(n + 1, angle + h / 2 * v2, v3, middle)
        v4 = v1 + h * a3
        a4 = self.acceleration(n + 2, angle + h * v3, v4, last)
        moved = angle + h / 6 * (v1 + 2 * (v2 + v3) + v4)
        return np.stack([moved, v1 + h / 6 * (first + 2 * (a2 + a3) + a4), last])
