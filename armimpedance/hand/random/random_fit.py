"""Result of a random perturbation of a hand, and its frequency response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.random.lines import Complex, Lines

# Force over motion at each frequency, without a model: the frequency response matrix.
#
# About a frequency the impedance is a polynomial of the second order, ``F_j = -(Z0 + Z1 d + Z2 d^2)
# X_j + W_j`` over the lines beside it (the local polynomial method: R. Pintelon, J. Schoukens,
# System Identification, 2nd ed. 2012, chapter 7; smooth ends replace its polynomial of the
# transient). The instrument is the part of the motion that the commands explain.

#: Distance of the frequencies, half-width of the lines used for each (Hz), and fewest lines for
#: each estimated number.
STEP_HZ: Final = 0.5
SIDE_HZ: Final = 1.0
LINES_EACH: Final = 6
_ORDER: Final = 3


@dataclass(frozen=True, eq=False)
class ResponseMatrix(FrozenRecord):
    """Impedance at f frequencies.

    `frequency_hz` (f,).
    `impedance` (f, d, d) complex: force of the hand against its motion, N/m or N m/rad.
    `sd` (f, d, d): standard error of real and imaginary part.
    `multiple` (f, d): coherence of each force with the motion of all axes, 0..1.
    `partial` (f, d, d): coherence of force i with motion j after removing the other motions from
    both.
    `model` (f, d, d) complex: impedance by M, B, K and the reflex.
    """

    frequency_hz: Annotated[FloatArray, "f"]
    impedance: Complex
    sd: Annotated[FloatArray, "f d d"]
    multiple: Annotated[FloatArray, "f d"]
    partial: Annotated[FloatArray, "f d d"]
    model: Complex


def response_matrix(
    lines: Lines, explained: Complex, matrices: FloatArray, delay_s: float
) -> ResponseMatrix:
    """Estimate the frequency response matrix over the lines' band.

    `explained` (L, d) complex: the motion that the commands explain.
    `matrices` (4, d, d): M, B, K and the reflex of the model for comparison.
    """
    f, d = lines.frequency_hz, lines.axes
    side = max(SIDE_HZ, LINES_EACH * _ORDER * d / lines.per_hz / 2)
    centres = np.arange(f[0] + STEP_HZ / 2, f[-1], STEP_HZ)
    parts = [_at(lines, explained, centre, side) for centre in centres]
    impedance, sd, multiple, partial = (np.stack(part) for part in zip(*parts, strict=True))
    model = _model_impedance(centres, matrices, delay_s)
    return ResponseMatrix(centres, impedance, sd, multiple, partial, model)


def _model_impedance(frequency_hz: FloatArray, matrices: FloatArray, delay_s: float) -> Complex:
    """``M s^2 + B s + K + R exp(-s t)`` at each frequency, (f, d, d)."""
    s = 2j * np.pi * frequency_hz[:, None, None]
    M, B, K, R = matrices
    return np.asarray(M * s**2 + B * s + K + R * np.exp(-s * delay_s))


def _at(
    lines: Lines, explained: Complex, centre: float, side: float
) -> tuple[Complex, FloatArray, FloatArray, FloatArray]:
    """Impedance, standard error, multiple and partial coherence about one frequency."""
    near = np.abs(lines.frequency_hz - centre) <= side
    u = (lines.frequency_hz[near] - centre)[:, None] / side
    x, z, F = lines.motion[0][near], explained[near], lines.force[near]
    n, d = F.shape
    X, Z = _powers(x, u), _powers(z, u)
    inverse = np.linalg.pinv(Z.conj().T @ X)
    H = inverse @ (Z.conj().T @ F)
    residual = F - X @ H
    spare = max(n - X.shape[1], 1)
    spread = inverse @ (Z.conj().T @ Z) @ inverse.conj().T
    S = (np.abs(residual) ** 2).sum(axis=0) / spare
    # H^T is force over motion, and real and imaginary part share the variance
    sd = np.sqrt(np.outer(S, np.diag(spread).real[:d]) / 2)
    whole = (np.abs(F) ** 2).sum(axis=0) / n
    full = _unexplained(X, F)
    multiple = np.clip(1 - full / np.maximum(whole, 1e-300), 0, 1)
    partial = np.empty((d, d))
    for j in range(d):
        others = _unexplained(_powers(np.delete(x, j, axis=1), u), F)
        partial[:, j] = np.clip(1 - full / np.maximum(others, 1e-300), 0, 1)
    return -H[:d].T, sd, multiple, partial


def _powers(x: Complex, u: FloatArray) -> Complex:
    return np.hstack([x * u**n for n in range(_ORDER)])


def _unexplained(X: Complex, F: Complex) -> FloatArray:
    """Power (d,) of the force that a linear system does not explain."""
    residual = F - X @ np.linalg.lstsq(X, F, rcond=None)[0]
    return np.asarray((np.abs(residual) ** 2).sum(axis=0) / max(len(F) - X.shape[1], 1))


@dataclass(frozen=True, eq=False)
class ReflexPart(FrozenRecord):
    """Estimate of a delayed response.

    `probability`: posterior probability of a reflex.
    `matrix`, `sd` (d, d): R with its standard error, given a reflex, N/m or N m/rad.
    `delay_s`, `delay_sd_s`: its delay and the standard deviation.
    `share`: its size along K, relative to K.
    """

    probability: float
    matrix: Annotated[FloatArray, "d d"]
    sd: Annotated[FloatArray, "d d"]
    delay_s: float
    delay_sd_s: float
    share: float

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and nested lists."""
        return {
            "probability": self.probability,
            "R": np.asarray(self.matrix).tolist(),
            "sd_R": np.asarray(self.sd).tolist(),
            "delay_s": self.delay_s,
            "sd_delay_s": self.delay_sd_s,
            "share_of_K": self.share,
        }


@dataclass(frozen=True, eq=False)
class RandomFit(FrozenRecord):
    """Results for one group of trials.

    `estimate`: M, B and K without the reflex.
    `lag_s`, `lag_probability`: delay of the recorded force relative to the motion, and the
    probability that there is one.
    `band_hz` (low, high): fitted band.
    `response`: frequency response without a model.
    """

    estimate: ImpedanceEstimate
    reflex: ReflexPart
    lag_s: float
    lag_probability: float
    band_hz: tuple[float, float]
    response: ResponseMatrix
