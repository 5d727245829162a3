"""What the commands explain of motion and force, smooth in frequency, each line from the others.

The response to the commands is a cubic spline of the frequency, whatever robot lies between
command and hand. A line's own noise (sensors', the person's) has no part in what is explained of
it, so that the explained motion serves as an instrument in a closed loop.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.interpolate import BSpline

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.random.lines import Complex, Lines

#: Knots are so far apart (Hz), or so that this many lines fall to each coefficient.
KNOTS_HZ: Final = 0.75
LINES_EACH: Final = 8.0
#: Squares of combinations of commands that are this small beside the largest tell nothing.
ALIKE: Final = 1e-10
#: A line that its own coefficients follow further than this is not told by others.
HIGHEST_LEVERAGE: Final = 0.9


@dataclass(frozen=True, eq=False)
class Explained:
    """What the commands say of each line.

    Attributes
    ----------
    motion, force : (L, d) complex
        Each line from the others.
    coefficients : int
        Of each command's response.
    """

    motion: Complex
    force: Complex
    coefficients: int


def explained_by(lines: Lines) -> Explained:
    """Regress motion and force on the commands, line by line left out.

    Parameters
    ----------
    lines : Lines
        Of the band.
    """
    basis = _basis(lines)
    c, L = lines.command.shape[1], len(basis)
    Phi = (basis[:, :, None] * lines.command[:, None]).reshape(L, -1)
    size = np.linalg.norm(Phi, axis=0)
    Phi = Phi / np.where(size > 0, size, 1.0)
    # orthogonal columns; those of commands that are alike, or nothing, are left out
    values, V = np.linalg.eigh(Phi.conj().T @ Phi)
    seen = values > ALIKE * values[-1]
    U = Phi @ (V[:, seen] / np.sqrt(values[seen]))
    leverage = np.minimum((np.abs(U) ** 2).sum(axis=1), HIGHEST_LEVERAGE)[:, None]
    y = np.hstack([lines.motion[0], lines.force])
    # y_i without line i: y_i - (y_i - yhat_i) / (1 - h_i)
    left_out = y - (y - U @ (U.conj().T @ y)) / (1 - leverage)
    d = lines.axes
    return Explained(left_out[:, :d], left_out[:, d:], U.shape[1] // c)


def _basis(lines: Lines) -> FloatArray:
    """Cubic B-splines of the frequency at every line, (L, k)."""
    f = lines.frequency_hz
    apart = max(KNOTS_HZ, LINES_EACH * lines.command.shape[1] / lines.per_hz)
    inner = np.linspace(f[0], f[-1], max(2, 1 + int((f[-1] - f[0]) / apart)))
    knots = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
    return np.asarray(BSpline.design_matrix(f, knots, 3).toarray())


def share_explained(measured: Complex, explained: Complex) -> FloatArray:
    """Part of the power of each axis (d,) that is explained; below 0 where it is none."""
    left = (np.abs(measured - explained) ** 2).sum(axis=0)
    return np.asarray(1 - left / np.maximum((np.abs(measured) ** 2).sum(axis=0), 1e-300))
