"""The smoother's linear Gaussian model: banded information of angle, B and K of all samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.elbow.varying_data import VaryingData
from armimpedance.elbow.varying_equation import HALF, WIDTH, Linearised
from armimpedance.records import FloatArray, IntArray

#: Unknowns per sample: angle, B, K.
STATE: Final = 3
#: Rows of the banded information matrix.
BAND: Final = STATE * 2 * HALF + STATE
#: The difference that is white noise, and its order.
DIFFERENCE: Final = (1.0, -2.0, 1.0)
ORDER: Final = len(DIFFERENCE) - 1


@dataclass(frozen=True)
class Levels:
    """Noise levels of the smoother.

    Attributes
    ----------
    B, K : float
        Intensity of the second derivative's white noise over the parameter's mean, s^-1.5.
    torque : float
        Torque noise over the floor that was read from the channel.
    """

    B: float
    K: float
    torque: float

    @property
    def logs(self) -> FloatArray:
        """Natural logarithms, (3,)."""
        return np.log([self.B, self.K, self.torque])


@dataclass(frozen=True)
class SmootherModel:
    """The linear Gaussian model of one linearisation, split by noise level.

    H = ``torque / lambda^2 + angle + rough_B / q_B + rough_K / q_K``, all lower banded; likewise
    the right-hand sides.
    """

    torque: FloatArray
    angle: FloatArray
    rough_B: FloatArray
    rough_K: FloatArray
    right_torque: FloatArray
    right_angle: FloatArray
    coupling: FloatArray
    shared: FloatArray
    shared_right: FloatArray
    shared_prior: FloatArray
    square_torque: float
    square_angle: float
    rows: int
    differences: IntArray
    unit: FloatArray

    def information(self, levels: Levels) -> FloatArray:
        """H (w, n), lower banded."""
        q = self.unit * np.array([levels.B, levels.K]) ** 2
        return np.asarray(
            self.torque / levels.torque**2 + self.angle + self.rough_B / q[0] + self.rough_K / q[1]
        )

    def right(self, levels: Levels) -> FloatArray:
        """[g, coupling to the shared parameters], (n, 1 + s)."""
        weight = levels.torque**-2
        g = self.right_torque * weight + self.right_angle
        return np.column_stack([g, self.coupling * weight])


def smoother_model(data: VaryingData, eq: Linearised, scale: FloatArray) -> SmootherModel:
    N = len(data.angle)
    n, c = STATE * N, eq.centre
    s1, s2 = eq.sd_torque, eq.sd_angle
    L, y = eq.L / s1[:, None], eq.torque_side / s1
    x1, x0 = eq.x1 / s1, eq.x0 / s1
    U = np.column_stack([eq.x2, eq.nuisance]) / s1[:, None]
    torque = _torque_information(n, c, L, x1, x0)
    angle = np.zeros((BAND, n))
    angle[0, ::STATE] = s2**-2
    right_angle = np.zeros(n)
    right_angle[::STATE] = data.angle / s2**2

    def transposed(v: FloatArray) -> FloatArray:
        """``A^T v`` of the torque rows, (n, q) of (R, q)."""
        out = np.zeros((n, v.shape[1]))
        for a in range(WIDTH):
            out[STATE * (c + a - HALF)] += L[:, a, None] * v
        out[STATE * c + 1] += x1[:, None] * v
        out[STATE * c + 2] += x0[:, None] * v
        return out

    return SmootherModel(
        torque=torque,
        angle=angle,
        rough_B=_roughness(data, 1),
        rough_K=_roughness(data, 2),
        right_torque=transposed(y[:, None])[:, 0],
        right_angle=right_angle,
        coupling=transposed(U),
        shared=U.T @ U,
        shared_right=U.T @ y,
        shared_prior=np.concatenate([[0.0], eq.prior_sd**-2]),
        square_torque=float(y @ y),
        square_angle=float(((data.angle / s2) ** 2).sum()),
        rows=len(c),
        differences=_starts(data),
        unit=scale**2 / data.rate_hz ** (2 * ORDER - 1),
    )


def _torque_information(
    n: int, c: IntArray, L: FloatArray, x1: FloatArray, x0: FloatArray
) -> FloatArray:
    """``A^T A`` of the torque rows ``L theta + x1 B + x0 K``, lower banded."""
    H = np.zeros((BAND, n))

    def put(i: IntArray, j: IntArray, values: FloatArray) -> None:
        H[(i - j)[0], j] += values

    theta = [STATE * (c + a - HALF) for a in range(WIDTH)]
    for a in range(WIDTH):
        for b in range(a, WIDTH):
            put(theta[b], theta[a], L[:, a] * L[:, b])
        for k, x in ((1, x1), (2, x0)):
            own = STATE * c + k
            if a <= HALF:
                put(own, theta[a], L[:, a] * x)
            else:
                put(theta[a], own, L[:, a] * x)
    put(STATE * c + 1, STATE * c + 1, x1 * x1)
    put(STATE * c + 2, STATE * c + 2, x0 * x0)
    put(STATE * c + 2, STATE * c + 1, x1 * x0)
    return H


def _starts(data: VaryingData) -> IntArray:
    """First sample of each difference that lies within a trial."""
    ends = zip(data.offsets[:-1], data.offsets[1:], strict=True)
    return np.concatenate([np.arange(a, b - ORDER) for a, b in ends])


def _roughness(data: VaryingData, which: int) -> FloatArray:
    """``D^T D`` of the second differences within trials, of unknown `which` of a sample."""
    H = np.zeros((BAND, STATE * len(data.angle)))
    first = _starts(data)
    for i, wi in enumerate(DIFFERENCE):
        for j, wj in enumerate(DIFFERENCE[: i + 1]):
            H[STATE * (i - j), STATE * (first + j) + which] += wi * wj
    return H
