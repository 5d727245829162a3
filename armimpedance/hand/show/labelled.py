"""Matrices with their intervals and the names of their axes, as a person reads them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES, MATRICES, UNITS
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Ellipse, Which, ellipse_of
from armimpedance.hand.show.text import estimate_text
from armimpedance.numerics.regression import t_factor
from armimpedance.show.text import html_table

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False, eq=False)
class LabelledMatrix(FrozenRecord):
    """One matrix of an estimate with its 95 % intervals.

    NumPy takes it as the matrix: ``np.linalg.eigvalsh(hand["relaxed"].stiffness)``.

    Attributes
    ----------
    symbol, unit : str
        Such as ``K`` and ``N/m``.
    axes : tuple of k str
        Names of the rows and columns.
    value, sd, low, high : (k, k)
        Elements, their standard errors and their 95 % limits.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> stiffness = ai.estimate(session)["cocontraction_10"].stiffness
    >>> stiffness.axes
    ('x', 'y')
    >>> bool((stiffness.low < stiffness.value).all())
    True
    """

    symbol: str
    unit: str
    axes: Annotated[tuple[str, ...], "k"]
    value: Annotated[FloatArray, "k k"]
    sd: Annotated[FloatArray, "k k"]
    low: Annotated[FloatArray, "k k"]
    high: Annotated[FloatArray, "k k"]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.value, dtype=dtype) if copy else np.asarray(self.value, dtype=dtype)

    def to_frame(self) -> pd.DataFrame:
        """One row an element: its row and column, value, standard error, 95 % limits, unit."""
        import pandas as pd

        places = pd.MultiIndex.from_product([self.axes, self.axes], names=["row", "column"])
        columns = {name: getattr(self, name).ravel() for name in ("value", "sd", "low", "high")}
        return pd.DataFrame({**columns, "unit": self.unit}, index=places)

    def _table(self) -> list[list[str]]:
        """The heading and the rows: ``104 [95.4, 113]`` of every element."""
        rows = [
            [axis, *(f"{v:.4g} [{a:.4g}, {b:.4g}]" for v, a, b in zip(*row, strict=True))]
            for axis, row in zip(
                self.axes, np.stack([self.value, self.low, self.high], axis=1), strict=True
            )
        ]
        return [[f"{self.symbol} ({self.unit})", *self.axes], *rows]

    def __repr__(self) -> str:
        table = self._table()
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        return "\n".join(
            "   ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
            for row in table
        )

    def _repr_html_(self) -> str:
        return html_table(self._table())


class LabelledEstimate:
    """One estimate as a person reads it: its matrices with intervals, units and axes.

    Every other attribute is the record's own: ``hand["relaxed"].quality``. `print` shows all of it.

    Parameters
    ----------
    estimate : ImpedanceEstimate

    Attributes
    ----------
    estimate : ImpedanceEstimate
        The record, with plain arrays.
    inertia, viscosity, stiffness : LabelledMatrix

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> level = ai.estimate(session)["cocontraction_10"]
    >>> level.stiffness.unit, level.inertia.unit
    ('N/m', 'kg')
    """

    def __init__(self, estimate: ImpedanceEstimate) -> None:
        self.estimate = estimate

    @property
    def inertia(self) -> LabelledMatrix:
        """M, the limb's own."""
        return self._labelled("inertia")

    @property
    def viscosity(self) -> LabelledMatrix:
        """B."""
        return self._labelled("viscosity")

    @property
    def stiffness(self) -> LabelledMatrix:
        """K."""
        return self._labelled("stiffness")

    def ellipse(self, which: Which = "stiffness") -> Ellipse | None:
        """The ellipse of a matrix at the hand with its limits; None where there is none.

        Parameters
        ----------
        which : {"inertia", "viscosity", "stiffness"}
        """
        return ellipse_of(self.estimate, which)

    def __getattr__(self, name: str) -> Any:
        if name == "estimate":
            raise AttributeError(name)
        return getattr(self.estimate, name)

    def _labelled(self, which: Which) -> LabelledMatrix:
        estimate, (symbol, _) = self.estimate, MATRICES[which]
        value, sd = getattr(estimate, which), estimate.sd["MBK".index(symbol)]
        half = t_factor(estimate.dof) * sd
        unit = UNITS[estimate.level][symbol]
        return LabelledMatrix(
            symbol, unit, axes_of(estimate), value, sd, value - half, value + half
        )

    def __str__(self) -> str:
        """The estimate in full: matrices, their parts and ellipses, quality, warnings."""
        return estimate_text(self.estimate)

    def __repr__(self) -> str:
        return "\n".join(map(repr, (self.inertia, self.viscosity, self.stiffness)))

    def _repr_html_(self) -> str:
        matrices = (self.inertia, self.viscosity, self.stiffness)
        return "".join(matrix._repr_html_() for matrix in matrices)


def axes_of(estimate: ImpedanceEstimate) -> tuple[str, ...]:
    """Names of an estimate's axes: x and y, shoulder and elbow, or the muscles."""
    k = estimate.k
    if estimate.level == "hand" and k <= len(AXES):
        return AXES[:k]
    if estimate.level == "joint" and k == 2:
        return ("shoulder", "elbow")
    if estimate.level == "muscle" and len(estimate.muscles) == k:
        return estimate.muscles
    return tuple(map(str, range(1, k + 1)))
