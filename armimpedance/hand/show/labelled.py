"""Labelled estimates: their matrices are arrays with intervals and units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, MATRICES, UNITS
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.core.shown import html_table
from armimpedance.hand.ellipses import Ellipse, Which, ellipse_of
from armimpedance.hand.show.text import estimate_text
from armimpedance.numerics.regression import t_factor

if TYPE_CHECKING:
    import pandas as pd


class LabelledMatrix(np.ndarray[Any, np.dtype[np.float64]]):
    """One matrix of an estimate with its 95 % intervals.

    For NumPy and for every function of the package it is the matrix; results computed from it are
    plain arrays.

    Attributes
    ----------
    symbol, unit : str
        For example ``K`` and ``N/m``.
    axes : tuple of k str
        Names of the rows and columns.
    sd, low, high : (k, k)
        Standard errors of the elements and their 95 % limits.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> session, truth = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> stiffness = ai.estimate(session)["cocontraction_10"].stiffness
    >>> stiffness.axes
    ('x', 'y')
    >>> bool((stiffness.low < stiffness).all())
    True
    """

    symbol: str | None
    unit: str
    axes: tuple[str, ...]
    sd: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, estimate: ImpedanceEstimate, which: Which) -> LabelledMatrix:
        """Build the labelled matrix of an estimate.

        Parameters
        ----------
        estimate : ImpedanceEstimate
        which : {"inertia", "viscosity", "stiffness"}

        Returns
        -------
        LabelledMatrix
        """
        symbol = MATRICES[which][0]
        plain = np.asarray(getattr(estimate, which))
        labelled: LabelledMatrix = plain.view(cls)
        labelled.symbol, labelled.unit = symbol, UNITS[estimate.level][symbol]
        labelled.axes, labelled.sd = axes_of(estimate), estimate.sd["MBK".index(symbol)]
        half = t_factor(estimate.dof) * labelled.sd
        labelled.low, labelled.high = plain - half, plain + half
        return labelled

    def __array_finalize__(self, source: Any) -> None:
        # a part or a copy of the matrix has no labels
        self.symbol = None

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        plain = np.asarray(array)
        return plain[()] if return_scalar or plain.ndim == 0 else plain

    def __getitem__(self, key: Any) -> Any:
        return np.asarray(self)[key]

    def __reduce__(self) -> Any:
        # only the numbers are pickled; an estimate labels them again
        return np.asarray(self).__reduce__()

    @property
    def value(self) -> FloatArray:
        """The plain matrix."""
        return np.asarray(self)

    @property
    def T(self) -> Any:
        """The plain matrix transposed."""
        return np.asarray(self).T

    def to_frame(self) -> pd.DataFrame:
        """One row per element: its row and column, value, standard error, 95 % limits, unit."""
        import pandas as pd

        places = pd.MultiIndex.from_product([self.axes, self.axes], names=["row", "column"])
        columns = {name: getattr(self, name).ravel() for name in ("value", "sd", "low", "high")}
        return pd.DataFrame({**columns, "unit": self.unit}, index=places)

    def _table(self) -> list[list[str]]:
        """Heading and rows: ``104 [95.4, 113]`` for every element."""
        rows = [
            [axis, *(f"{v:.4g} [{a:.4g}, {b:.4g}]" for v, a, b in zip(*row, strict=True))]
            for axis, row in zip(
                self.axes, np.stack([self.value, self.low, self.high], axis=1), strict=True
            )
        ]
        return [[f"{self.symbol} ({self.unit})", *self.axes], *rows]

    def __repr__(self) -> str:
        if self.symbol is None:
            return repr(np.asarray(self))
        table = self._table()
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        return "\n".join(
            "   ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip()
            for row in table
        )

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return repr(self) if self.symbol is None else html_table(self._table())


class LabelledEstimate(ImpedanceEstimate):
    """An estimate for display: its matrices have intervals, units and names of axes.

    It is an `ImpedanceEstimate`. `print` shows all of it.

    Attributes
    ----------
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

    if TYPE_CHECKING:
        inertia: LabelledMatrix
        viscosity: LabelledMatrix
        stiffness: LabelledMatrix

    @classmethod
    def of(cls, estimate: ImpedanceEstimate) -> LabelledEstimate:
        """Add labels to an estimate.

        Parameters
        ----------
        estimate : ImpedanceEstimate

        Returns
        -------
        LabelledEstimate
        """
        if isinstance(estimate, cls):
            return estimate
        labelled = object.__new__(cls)
        # its fields were checked on construction
        labelled.__dict__.update(vars(estimate))
        labelled._label()
        return labelled

    def __post_init__(self) -> None:
        super().__post_init__()
        self._label()

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        self._label()

    def _label(self) -> None:
        for which in get_args(Which):
            object.__setattr__(self, which, LabelledMatrix.of(self, which))

    def ellipse(self, which: Which = "stiffness") -> Ellipse | None:
        """The ellipse of a matrix at the hand with its limits; None if there is none.

        Parameters
        ----------
        which : {"inertia", "viscosity", "stiffness"}
        """
        return ellipse_of(self, which)

    def __str__(self) -> str:
        """The estimate in full: matrices, their parts and ellipses, quality, warnings."""
        return estimate_text(self)

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
