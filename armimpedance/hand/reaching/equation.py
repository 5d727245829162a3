"""The joint equation of a pushed reach, projected on slow functions of time.

For each trial, relative to its undisturbed course,

    J^T F + Y phi + K(t) q + B(t) qd + R q(t - d) = w,   (2,)

where w is the torque of the person's own movement, independent of the push: it has the same
distribution in pushed and in free reaches. K and B change over the window linearly and a little
quadratically. R is a reflex, with a prior that it is small.

The unknowns theta hold each matrix row by row (`Part`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.hand.reaching.course import N_INERTIAL
from armimpedance.hand.reaching.windows import SPACING_S, PhaseWindows

#: K' and B' are changes over this time (s), K'' and B'' those over its square.
CHANGE_S: Final = 0.2
#: Highest frequency of the cosines on which the equation is projected (Hz).
FASTEST_HZ: Final = 20.0
#: Number of components of the history that are projected out of every term.
COMPONENTS: Final = 6
#: Delay of the reflex in the model (s).
REFLEX_S: Final = 0.055

#: An arm counts as fully moving if the hand travels this far over the window (m).
MOVING_M: Final = 0.02

INERTIAL: Final = slice(0, 3)
STIFFNESS: Final = slice(3, 7)
VISCOSITY: Final = slice(7, 11)
#: The reported unknowns: phi, K and B in the middle of the window.
REPORTED: Final = slice(0, 11)
STIFFNESS_CHANGE: Final = slice(11, 15)
VISCOSITY_CHANGE: Final = slice(15, 19)
STIFFNESS_CURVE: Final = slice(19, 23)
VISCOSITY_CURVE: Final = slice(23, 27)
REFLEX: Final = slice(27, 31)
N_UNKNOWN: Final = 31


@dataclass(frozen=True)
class ReachEquations(FrozenRecord):
    """Projected equations of n trials, R rows each: ``y + X theta = w``.

    `X` (n, R, 31), `y` (n, R), `pushed` (n,) bool.
    `instruments` (n, d): orthonormal.
    `nuisance` (n, g): orthonormal: the two groups' means and the history, which are projected out
    of all other terms.
    `moving`: from 0 for an arm at rest, whose impedance does not change, to 1.
    """

    X: Annotated[FloatArray, "n R p"]
    y: Annotated[FloatArray, "n R"]
    instruments: Annotated[FloatArray, "n d"]
    pushed: Annotated[BoolArray, "n"]
    nuisance: Annotated[FloatArray, "n g"]
    moving: float

    @property
    def trials(self) -> int:
        """Number of trials n."""
        return len(self.y)

    def along_direction(self, values: FloatArray) -> FloatArray:
        """Part of values (n, ...) that is linear in the push's direction, or in its commands."""
        flat = values.reshape(len(values), -1)
        # H = U U^T, (n, n) = (n, d) (d, n)
        U = self.instruments
        return np.asarray(U @ (U.T @ flat)).reshape(values.shape)


def equations_of(windows: PhaseWindows) -> ReachEquations:
    """Build the equations of one phase, with means and history projected out of every term."""
    lag = windows.lag_s
    X, y = projected(lag, terms_of(windows)), projected(lag, windows.part("torque"))
    n = len(X)
    nuisance = _nuisance(windows)

    def without(values: FloatArray) -> FloatArray:
        flat = values.reshape(n, -1)
        return np.asarray(flat - nuisance @ (nuisance.T @ flat))

    return ReachEquations(
        X=without(X).reshape(X.shape),
        y=without(y),
        instruments=orthonormal(without(windows.instruments)),
        pushed=windows.pushed,
        nuisance=nuisance,
        moving=min(1.0, windows.travel_m / MOVING_M),
    )


def terms_of(windows: PhaseWindows) -> FloatArray:
    """Regressors of the unknowns over a window, (n, S, 2, 31)."""
    Y = windows.part("inertial")
    return regressors(
        windows.lag_s,
        Y.reshape(*Y.shape[:2], 2, N_INERTIAL),
        windows.part("angle"),
        windows.part("rate"),
        windows.late("angle", round(REFLEX_S / SPACING_S)),
    )


def cosines(lag_s: FloatArray) -> FloatArray:
    """Orthonormal cosines (S, b) up to `FASTEST_HZ` over a window."""
    samples = len(lag_s)
    count = int(2 * (lag_s[-1] - lag_s[0]) * FASTEST_HZ) + 1
    phase = (np.arange(samples) + 0.5) / samples
    basis = np.cos(np.pi * np.arange(count) * phase[:, None])
    return np.asarray(basis / np.linalg.norm(basis, axis=0))


def regressors(
    lag_s: FloatArray, inertial: FloatArray, angle: FloatArray, rate: FloatArray, late: FloatArray
) -> FloatArray:
    """Regressors of the unknowns, (n, S, 2, 31), from motion.

    `lag_s` (S,).
    `inertial` (n, S, 2, 3): rows ``Y``.
    `angle`, `rate`, `late` (n, S, 2): angles, their rates, and the angles `REFLEX_S` ago.
    """
    change = ((lag_s - lag_s[len(lag_s) // 2]) / CHANGE_S)[:, None]
    parts = [
        inertial,
        _by_rows(angle),
        _by_rows(rate),
        _by_rows(angle * change),
        _by_rows(rate * change),
        _by_rows(angle * change**2),
        _by_rows(rate * change**2),
        _by_rows(late),
    ]
    return np.concatenate(parts, axis=-1)


def projected(lag_s: FloatArray, signal: FloatArray) -> FloatArray:
    """Project signals (n, S, 2, ...) on the cosines of the window, (n, R, ...)."""
    on = np.einsum("nsi...,sb->nbi...", signal, cosines(lag_s))
    return np.asarray(on.reshape(len(on), -1, *signal.shape[3:]))


def _by_rows(vector: FloatArray) -> FloatArray:
    """``A x`` as a matrix (..., 2, 4) times the elements of A, row by row, for x (..., 2)."""
    out = np.zeros((*vector.shape[:-1], 2, 4))
    out[..., 0, :2] = out[..., 1, 2:] = vector
    return out


def orthonormal(columns: FloatArray) -> FloatArray:
    """Orthonormal columns (n, d) that span these; directions of negligible size are left out."""
    U, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(U[:, size > 1e-6 * size[0]])


def _nuisance(windows: PhaseWindows) -> FloatArray:
    """Orthonormal columns (n, g): means of pushed and of free reaches, and the history.

    The history is reduced to its principal components: place and velocity of the hand determine
    most of its later course. The number of components is limited by the number of trials.
    """
    n = len(windows.history)
    count = max(1, min(COMPONENTS, (n - 4) // 6))
    components = np.linalg.svd(windows.history, full_matrices=False)[0][:, :count]
    groups = np.stack([windows.pushed, ~windows.pushed], axis=1).astype(float)
    return np.linalg.qr(np.concatenate([groups, components], axis=1))[0]
