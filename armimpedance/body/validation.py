"""How well parameters predict the contact wrench (or the torques), motion by motion.

The vertical force's R^2 is 1 for free where it is taken about zero: a weight at rest explains it.
Here R^2 is about each row's mean in each motion, and moments are reported apart from forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import FloatArray, IntArray
from armimpedance.body.equations import BodyEquations


@dataclass(frozen=True)
class BodyValidation:
    """Residuals per motion and row.

    Attributes
    ----------
    motions : tuple of T str
    rows, row_units : tuples of R str
    samples : (T,) int
    residual_squares, squares : (T, R)
        Sums over samples; of what was measured about its mean in that motion.
    """

    motions: tuple[str, ...]
    rows: tuple[str, ...]
    row_units: tuple[str, ...]
    samples: IntArray
    residual_squares: FloatArray
    squares: FloatArray

    @property
    def rms(self) -> FloatArray:
        """Root mean square residual (T, R), N or Nm."""
        return np.sqrt(self.residual_squares / self.samples[:, None])

    @property
    def r2(self) -> FloatArray:
        """``1 - residual / variation`` (T, R); nan where nothing varies."""
        return _r2(self.residual_squares, self.squares)

    def pooled_rms(self, rows: Sequence[str] | None = None) -> float:
        """Root mean square residual over all motions and these rows."""
        at = self._at(rows)
        count = self.samples.sum() * len(at)
        return float(np.sqrt(self.residual_squares[:, at].sum() / count))

    def pooled_r2(self, rows: Sequence[str] | None = None) -> float:
        """R^2 over all motions and these rows."""
        at = self._at(rows)
        return float(_r2(self.residual_squares[:, at].sum(), self.squares[:, at].sum()))

    @property
    def moments(self) -> tuple[str, ...]:
        """The rows in Nm."""
        pairs = zip(self.rows, self.row_units, strict=True)
        return tuple(row for row, unit in pairs if unit == "Nm")

    @property
    def forces(self) -> tuple[str, ...]:
        """The rows in N."""
        return tuple(row for row in self.rows if row not in self.moments)

    def _at(self, rows: Sequence[str] | None) -> list[int]:
        return [self.rows.index(row) for row in (self.rows if rows is None else rows)]


def validate(equations: BodyEquations, phi: FloatArray) -> BodyValidation:
    """Judge the prediction ``W phi`` of parameters (p,), of all segments and joint terms.

    A base solution serves as `BaseParameters.lift`.
    """
    left, varying = equations.squares(phi)
    return BodyValidation(
        equations.motions, equations.rows, equations.row_units, equations.samples, left, varying
    )


def _r2(residual: FloatArray, total: FloatArray) -> FloatArray:
    some = total > 0
    return np.where(some, 1 - residual / np.where(some, total, 1.0), np.nan)
