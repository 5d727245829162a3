"""How well parameters predict the contact wrench (or the torques), motion by motion.

The vertical force's R^2 is 1 for free where it is taken about zero: a weight at rest explains it.
Here R^2 is about each row's mean in each motion, and moments are reported apart from forces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray


@dataclass(frozen=True)
class BodyValidation(FrozenRecord):
    """Residuals per motion and row.

    Attributes
    ----------
    motions : tuple of T str
    rows, row_units : tuples of R str
    samples : (T,) int
    residual_squares, squares : (T, R)
        Sums over samples: of the residual, and of what was measured about its mean in that motion.
    """

    motions: Annotated[tuple[str, ...], "T"]
    rows: Annotated[tuple[str, ...], "R"]
    row_units: Annotated[tuple[str, ...], "R"]
    samples: Annotated[IntArray, "T"]
    residual_squares: Annotated[FloatArray, "T R"]
    squares: Annotated[FloatArray, "T R"]

    @property
    def rms(self) -> FloatArray:
        """Root mean square residual (T, R), N or N m."""
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
        """The rows in N m."""
        pairs = zip(self.rows, self.row_units, strict=True)
        return tuple(row for row, unit in pairs if unit == "N m")

    @property
    def forces(self) -> tuple[str, ...]:
        """The rows in N."""
        return tuple(row for row in self.rows if row not in self.moments)

    def to_list(self) -> list[dict[str, Any]]:
        """Plain values, one mapping a motion, as FIT.json holds them."""
        return [
            {
                "motion": motion,
                "samples": int(self.samples[t]),
                "rms": dict(zip(self.rows, self.rms[t].tolist(), strict=True)),
                "r2": dict(zip(self.rows, self.r2[t].tolist(), strict=True)),
            }
            for t, motion in enumerate(self.motions)
        ]

    def _at(self, rows: Sequence[str] | None) -> list[int]:
        return [self.rows.index(row) for row in (self.rows if rows is None else rows)]


def _r2(residual: FloatArray, total: FloatArray) -> FloatArray:
    some = total > 0
    return np.where(some, 1 - residual / np.where(some, total, 1.0), np.nan)
