"""What a robot makes of a commanded course: the hand's actual motion.

Robot mass m, servo stiffness k_s and damping d_s move hand and robot together:

    (M + m I) x'' + (B + d_s I) x' + (K + k_s I) x = k_s x_c + d_s x_c' + m x_c'' (feedforward)

so that the following error e = x - x_c obeys the same left side with
``-(M x_c'' + B x_c' + K x_c)`` on the right (without feedforward ``-((M + m I) x_c'' + ...)``).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


@dataclass(frozen=True)
class Servo:
    """Cartesian stiffness and damping around the commanded course.

    Attributes
    ----------
    stiffness : float
        N/m; inf: the hand moves as commanded.
    mass_kg : float
        Mass of robot and handle, as felt at the hand.
    damping_ratio : float
        Damping ratio of robot and handle alone.
    feedforward : bool
        The robot's own inertia is compensated.
    """

    stiffness: float = np.inf
    mass_kg: float = 2.0
    damping_ratio: float = 0.7
    feedforward: bool = True

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and 0 < self.mass_kg < np.inf and self.damping_ratio >= 0):
            raise InputError(
                f"servo of {self.stiffness:g} N/m, {self.mass_kg:g} kg, "
                f"damping ratio {self.damping_ratio:g}",
                expected="positive stiffness and mass, damping ratio >= 0",
            )

    @classmethod
    def of_bandwidth(cls, hertz: float, mass_kg: float = 2.0) -> Servo:
        """A servo known by its natural frequency only, without feedforward."""
        if not (np.isfinite(hertz) and hertz > 0):
            raise InputError(f"a servo bandwidth of {hertz:g} Hz", expected="more than 0")
        return cls(mass_kg * (2 * np.pi * hertz) ** 2, mass_kg, feedforward=False)

    @property
    def natural_hz(self) -> float:
        """Natural frequency of robot and servo without a hand."""
        return float(np.sqrt(self.stiffness / self.mass_kg) / (2 * np.pi))


IDEAL: Final = Servo()


def follow(
    servo: Servo, parameters: FloatArray, course: FloatArray, sample_rate_hz: float
) -> FloatArray:
    """Actual displacement of the hand for a command along each axis.

    Parameters
    ----------
    servo : Servo
    parameters : (3, d, d)
        M (with handle), B, K.
    course : (3, ..., S)
        Commanded displacement, velocity, acceleration, from rest.
    sample_rate_hz : float

    Returns
    -------
    (..., d, d, S) : commanded axis, actual axis, time.
    """
    from scipy.linalg import expm

    d = parameters.shape[1]
    unit = np.eye(d)
    commanded = unit[:, :, None] * course[0][..., None, None, :]
    if np.isinf(servo.stiffness):
        return np.asarray(commanded)
    damping = 2 * servo.damping_ratio * np.sqrt(servo.stiffness * servo.mass_kg)
    robot = np.stack([servo.mass_kg * unit, damping * unit, servo.stiffness * unit])
    M, B, K = parameters + robot
    load = parameters + np.stack([servo.mass_kg * unit * (not servo.feedforward), 0 * B, 0 * K])
    # push (..., a, i, S): on axis i for a command along axis a
    push = -np.einsum("mia,m...s->...ais", load, course[::-1])
    inverse = np.linalg.inv(M)
    # state (e, e') (2 d,), input held linear between samples: exponential of [[F, G, 0], [0, 0, 1]]
    F = np.block([[0 * unit, unit], [-inverse @ K, -inverse @ B]])
    G = np.vstack([0 * unit, inverse])
    size, step = 2 * d, 1 / sample_rate_hz
    big = np.zeros((size + 2 * d, size + 2 * d))
    big[:size, :size], big[:size, size : size + d] = F, G
    big[size : size + d, size + d :] = unit
    moved = expm(big * step)
    keep, now, slope = moved[:size, :size], moved[:size, size:-d], moved[:size, -d:] / step
    flat = np.moveaxis(push, -1, 0).reshape(push.shape[-1], -1, d)
    state, error = np.zeros((flat.shape[1], size)), np.zeros(flat.shape)
    for n in range(len(flat) - 1):
        state = state @ keep.T + flat[n] @ now.T + (flat[n + 1] - flat[n]) @ slope.T
        error[n + 1] = state[:, :d]
    return np.asarray(commanded + np.moveaxis(error.reshape(-1, *push.shape[:-1]), 0, -1))
