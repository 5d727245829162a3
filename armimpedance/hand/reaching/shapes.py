"""Shapes of pushes that a plan compares, and how a hand answers them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray

#: Directions of the planned pushes, equally spaced.
DIRECTIONS: Final = 8
#: Steps in which an answer is followed (s).
STEP_S: Final = 0.001


@dataclass(frozen=True)
class PushShape:
    """A push along its direction, of size 1.

    Attributes
    ----------
    name : str
    kind : {"force", "displacement"}
        Half-sine forces of alternating sign, or a displacement that goes out, holds and comes back.
    parts_s : tuple of float
        How long each part lasts.
    """

    name: str
    kind: Literal["force", "displacement"]
    parts_s: tuple[float, ...]

    @property
    def duration_s(self) -> float:
        """From onset to end."""
        return sum(self.parts_s)

    def at(self, lag_s: FloatArray) -> FloatArray:
        """The push (S,) at times from its onset."""
        if self.kind == "displacement":
            out, hold, back = self.parts_s
            return _rise(lag_s / out) - _rise((lag_s - out - hold) / back)
        value, start, sign = np.zeros_like(lag_s), 0.0, 1.0
        for part in self.parts_s:
            u = (lag_s - start) / part
            value += sign * np.sin(np.pi * u) * ((u > 0) & (u < 1))
            start, sign = start + part, -sign
        return value


def _rise(u: FloatArray) -> FloatArray:
    """From 0 to 1 with the least jerk."""
    u = np.clip(u, 0.0, 1.0)
    return np.asarray(u**3 * (10 - 15 * u + 6 * u**2))


SHAPES: Final = (
    PushShape("pulse of 60 ms", "force", (0.06,)),
    PushShape("doublet of 2 x 45 ms", "force", (0.045, 0.045)),
    PushShape("doublet of 2 x 60 ms", "force", (0.06, 0.06)),
    PushShape("doublet of 2 x 80 ms", "force", (0.08, 0.08)),
    PushShape("doublet of 2 x 100 ms", "force", (0.1, 0.1)),
    PushShape("triplet of 3 x 60 ms", "force", (0.06, 0.06, 0.06)),
    PushShape("displacement of 160 ms", "displacement", (0.06, 0.04, 0.06)),
    PushShape("displacement of 250 ms", "displacement", (0.09, 0.07, 0.09)),
)


@dataclass(frozen=True)
class Response:
    """What pushes of one shape and of the largest allowed size do to a hand.

    Attributes
    ----------
    displacement, velocity, acceleration : (n, S, 2)
        Of n directions.
    force_n, displacement_m : float
        The largest that the limb gives, and goes, in any direction.
    """

    displacement: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force_n: float
    displacement_m: float


def respond_to(
    shape: PushShape,
    hand: FloatArray,
    robot_kg: float,
    limits: tuple[float, float],
    lag_s: FloatArray,
) -> Response:
    """The answer of a hand with constant M, B, K (3, 2, 2) to pushes all around.

    Parameters
    ----------
    shape : PushShape
    hand : (3, 2, 2)
    robot_kg : float
        What a pushed hand carries.
    limits : (largest push in N, largest displacement in m)
    lag_s : (S,)
        When the answer is wanted.
    """
    fine = np.arange(0.0, lag_s[-1] + STEP_S / 2, STEP_S)
    angle = 2 * np.pi / DIRECTIONS * np.arange(DIRECTIONS)
    units = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    course = shape.at(fine)
    if shape.kind == "displacement":
        x = course[None, :, None] * units[:, None]
        v = np.gradient(x, STEP_S, axis=1)
        a = np.gradient(v, STEP_S, axis=1)
        size = limits[1]
    else:
        x, v, a = _swing(course, units, hand, robot_kg)
        size = min(limits[0], limits[1] / np.hypot(x[..., 0], x[..., 1]).max())
    x, v, a = size * x, size * v, size * a
    # F = M a + B v + K x, (2,)
    F = sum(part @ matrix.T for part, matrix in zip((a, v, x), hand, strict=True))
    keep = np.rint(lag_s / STEP_S).astype(int)
    return Response(
        x[:, keep],
        v[:, keep],
        a[:, keep],
        float(np.hypot(F[..., 0], F[..., 1]).max()),
        float(np.hypot(x[..., 0], x[..., 1]).max()),
    )


def _swing(
    course: FloatArray, units: FloatArray, hand: FloatArray, robot_kg: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``(M + m) a + B v + K x = u f(t)`` from rest: x, v, a of (n, S, 2), by steps of 1 ms."""
    from scipy.linalg import expm

    M, B, K = hand
    inverse = np.linalg.inv(M + robot_kg * np.eye(2))
    # state (x, v, f u) (6,): the push stands still over a step
    drift = np.zeros((6, 6))
    drift[:2, 2:4] = np.eye(2)
    drift[2:4] = np.hstack([-inverse @ K, -inverse @ B, inverse])
    step = expm(drift * STEP_S)[:4]
    state = np.zeros((len(course), len(units), 4))
    for s in range(1, len(course)):
        push = (course[s - 1] + course[s]) / 2 * units
        state[s] = np.hstack([state[s - 1], push]) @ step.T
    x, v = np.moveaxis(state[..., :2], 0, 1), np.moveaxis(state[..., 2:], 0, 1)
    push = course[None, :, None] * units[:, None]
    return x, v, (push - v @ B.T - x @ K.T) @ inverse.T
