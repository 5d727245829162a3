"""Linear Gaussian model of the smoother: banded information of angle, B, K and v of all samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.equation import HALF, WIDTH, Linearised

#: Unknowns per sample: angle, B, K; one more if the subject adds a torque v.
STATE: Final = 3
#: Coefficients of the difference that is white noise, and its order.
DIFFERENCE: Final = (1.0, -2.0, 1.0)
ORDER: Final = len(DIFFERENCE) - 1


@dataclass(frozen=True)
class Levels:
    """Noise levels of the smoother.

    `B`, `K`: intensity of the second derivative's white noise over the parameter's mean, s^-1.5.
    `torque`: torque noise over the channel's measured noise floor.
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

    The information is ``H = torque / lambda^2 + angle + rough_B / q_B + rough_K / q_K``, all lower
    banded; the right-hand sides are split in the same way.

    `state`: unknowns per sample.
    """

    state: int
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

    @property
    def block(self) -> int:
        """Number of unknowns in a block of the chain, and of rows in the banded matrices."""
        return len(self.torque)

    def information(self, levels: Levels) -> FloatArray:
        """Information H (w, n), lower banded."""
        q = self.unit * np.array([levels.B, levels.K]) ** 2
        return np.asarray(
            self.torque / levels.torque**2 + self.angle + self.rough_B / q[0] + self.rough_K / q[1]
        )

    def right(self, levels: Levels) -> FloatArray:
        """Right-hand sides [g, coupling to the shared parameters], (n, 1 + s)."""
        weight = levels.torque**-2
        g = self.right_torque * weight + self.right_angle
        return np.column_stack([g, self.coupling * weight])


def smoother_model(data: VaryingData, eq: Linearised, scale: FloatArray) -> SmootherModel:
    """Build the model about a linearisation.

    `scale` (2,): means of B and K, to which the levels are relative.
    """
    state, N = STATE + bool(eq.own.order), len(data.angle)
    n, c, band = state * N, eq.centre, 2 * HALF * state + state
    s1, s2 = eq.sd_torque, eq.sd_angle
    L, y, x1, x0 = eq.L / s1[:, None], eq.torque_side / s1, eq.x1 / s1, eq.x0 / s1
    U = np.column_stack([eq.x2, eq.nuisance]) / s1[:, None]
    further = [x1, x0] if state == STATE else [x1, x0, -1 / s1]
    torque = _torque_information(np.zeros((band, n)), state, c, L, further)
    angle, right_angle = np.zeros((band, n)), np.zeros(n)
    angle[0, ::state], right_angle[::state] = s2**-2, data.angle / s2**2
    if eq.own.order:
        _add_own_torque(angle, state, data, eq)

    def transposed(v: FloatArray) -> FloatArray:
        """``A^T v`` of the torque rows, (n, q) of (R, q)."""
        out = np.zeros((n, v.shape[1]))
        for a in range(WIDTH):
            out[state * (c + a - HALF)] += L[:, a, None] * v
        for k, x in enumerate(further, start=1):
            out[state * c + k] += x[:, None] * v
        return out

    return SmootherModel(
        state=state,
        torque=torque,
        angle=angle,
        rough_B=_roughness(data, angle.shape, state, 1),
        rough_K=_roughness(data, angle.shape, state, 2),
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
    H: FloatArray, state: int, c: IntArray, L: FloatArray, further: list[FloatArray]
) -> FloatArray:
    """Add ``A^T A`` of the torque rows ``L theta + x1 B + x0 K - v`` to H, lower banded."""

    def put(i: IntArray, j: IntArray, values: FloatArray) -> None:
        i, j = np.maximum(i, j), np.minimum(i, j)
        H[(i - j)[0], j] += values

    theta = [state * (c + a - HALF) for a in range(WIDTH)]
    own = [state * c + k for k in range(1, 1 + len(further))]
    for a in range(WIDTH):
        for b in range(a, WIDTH):
            put(theta[b], theta[a], L[:, a] * L[:, b])
        for at, x in zip(own, further, strict=True):
            put(at, theta[a], L[:, a] * x)
    for i, (at, x) in enumerate(zip(own, further, strict=True)):
        for before, z in zip(own[: i + 1], further[: i + 1], strict=True):
            put(at, before, x * z)
    return H


def _add_own_torque(H: FloatArray, state: int, data: VaryingData, eq: Linearised) -> None:
    """Add information ``A^T A / sd^2`` of the subject's torque in all samples to H."""
    A = eq.own.operator(np.diff(data.offsets)) / eq.own.sd
    p, N = len(A) - 1, A.shape[1]
    v = state * np.arange(N) + STATE
    for i in range(p + 1):
        for j in range(i, p + 1):
            # row r of A holds the samples r - i and r - j
            r = np.arange(j, N)
            H[state * (j - i), v[r - j]] += A[i, r] * A[j, r]


def _starts(data: VaryingData) -> IntArray:
    """First sample of each difference that lies within a trial."""
    ends = zip(data.offsets[:-1], data.offsets[1:], strict=True)
    return np.concatenate([np.arange(a, b - ORDER) for a, b in ends])


def _roughness(data: VaryingData, shape: tuple[int, ...], state: int, which: int) -> FloatArray:
    """``D^T D`` of the second differences within trials, for unknown number `which` of a sample."""
    H = np.zeros(shape)
    first = _starts(data)
    for i, wi in enumerate(DIFFERENCE):
        for j, wj in enumerate(DIFFERENCE[: i + 1]):
            H[state * (i - j), state * (first + j) + which] += wi * wj
    return H


# A chain of blocks: Kalman filter in information form and Rauch-Tung-Striebel backward pass.
#
# A Gaussian posterior whose information matrix couples only neighbours is a Markov chain of blocks.
# Filtering forward and smoothing backward cost one small factorisation per block, so the cost is
# linear in the number of samples.


@dataclass(frozen=True)
class Smoothed:
    """Means (n, q) for q right-hand sides, and the marginal variances (n,)."""

    mean: FloatArray
    variance: FloatArray


def smooth_chain(banded: FloatArray, right: FloatArray, size: int) -> Smoothed:
    """Compute ``H^-1 g`` and ``diag(H^-1)`` for information H (n, n) and g (n, q).

    `right` (n, q).
    `banded` (w, n): H in lower banded form: ``banded[k, i] = H[i + k, i]``.
    `size`: number of unknowns in a block, at least w - 1.
    Raises EstimationError: H is not positive definite.
    """
    n, q = right.shape
    own, below = _blocks(banded, size)
    count = len(own)
    padded = np.zeros((count * size, q))
    padded[:n] = right
    g: FloatArray = padded.reshape(count, size, q)
    inverse, gain = np.empty_like(own), np.empty_like(own)
    filtered = np.empty_like(g)
    information: FloatArray = own[0]
    carried: FloatArray = g[0]
    for k in range(count):
        inverse[k] = _inverse(information)
        filtered[k] = inverse[k] @ carried
        # gain G (s, s) = D_k^-1 H_(k+1,k)^T
        gain[k] = inverse[k] @ below[k].T
        if k + 1 < count:
            information = own[k + 1] - below[k] @ gain[k]
            carried = g[k + 1] - below[k] @ filtered[k]
    mean, covariance = filtered, inverse
    for k in range(count - 2, -1, -1):
        # x_k = D_k^-1 g_k - G_k x_(k+1), P_k = D_k^-1 + G_k P_(k+1) G_k^T
        mean[k] -= gain[k] @ mean[k + 1]
        covariance[k] += gain[k] @ covariance[k + 1] @ gain[k].T
    variance = np.diagonal(covariance, axis1=1, axis2=2).reshape(-1)[:n]
    return Smoothed(mean.reshape(-1, q)[:n], np.array(variance))


def _inverse(information: FloatArray) -> FloatArray:
    """Symmetric inverse, with rows and columns scaled first: units differ by orders of
    magnitude."""
    diagonal = np.diagonal(information)
    if not (diagonal > 0).all():
        raise EstimationError("the smoother's information matrix is not positive definite")
    scale = 1 / np.sqrt(diagonal)
    inverse = np.linalg.inv(information * scale[:, None] * scale) * scale[:, None] * scale
    return np.asarray((inverse + inverse.T) / 2)


def _blocks(banded: FloatArray, size: int) -> tuple[FloatArray, FloatArray]:
    """Diagonal blocks (c, s, s), and those below them (c, s, s), padded by an identity."""
    width, n = banded.shape
    count = -(-n // size)
    own, below = np.zeros((count, size, size)), np.zeros((count, size, size))
    at = np.arange(n)
    for k in range(width):
        values = banded[k, : n - k] if k else banded[0]
        column = at[: n - k]
        row = column + k
        same = row // size == column // size
        c, i, j = column // size, row % size, column % size
        own[c[same], i[same], j[same]] = values[same]
        own[c[same], j[same], i[same]] = values[same]
        below[c[~same], i[~same], j[~same]] = values[~same]
    rest = np.arange(n % size or size, size)
    own[-1, rest, rest] = 1.0
    return own, below
