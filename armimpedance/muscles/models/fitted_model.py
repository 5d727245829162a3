"""Common parts of the models over posture, over activation and over both."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from html import escape
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, from_plain, to_plain
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import FitSummary
from armimpedance.show.files import FittedResult

# How well a model of joint impedance fits, element by element, and what that is worth.
#
# The source's R and E (Tsuji 1997, Tables 1 and 2) rise and fall with the number of coefficients
# whatever the data are: beside them stand the R that pure noise would give (null R) and the R of
# predictions of rows that the fit has not seen (leave-one-out R).

#: Below this part of their size, predictions that differ are the same number rounded.
_CONSTANT = 1e-9


@dataclass(frozen=True)
class ElementQuality:
    """One element of K or B.

    Attributes
    ----------
    element : str
        ``K_ss``, ``K_se``, ``K_es``, ``K_ee``, or the same of B.
    r : float
        Correlation between measured and fitted values; 0 where the fit is a constant.
    e : float
        Sum of squared errors, in the element's unit squared.
    adjusted_r2 : float
        ``1 - (E/(P - p)) / (E_0/(P - 1))``; nan with no rows to spare.
    leave_one_out_r : float
        Correlation between measured values and predictions without their own row.
    null_r : float
        R that the same fit gives on rows whose order was shuffled, on average.
    """

    element: str
    r: float
    e: float
    adjusted_r2: float
    leave_one_out_r: float
    null_r: float


def correlation(measured: ArrayLike, predicted: ArrayLike) -> float:
    """Correlation of two vectors (P,); 0 where one of them is constant.

    Parameters
    ----------
    measured, predicted : (P,)

    Returns
    -------
    float
    """
    return float(correlations(np.atleast_2d(measured), np.atleast_2d(predicted))[0])


def correlations(measured: ArrayLike, predicted: ArrayLike) -> FloatArray:
    """Correlation of every row of one table (n, P) with that of another, (n,); 0 if constant."""
    x, y = np.asarray(measured, dtype=float), np.asarray(predicted, dtype=float)
    dx, dy = x - x.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    size_x, size_y = np.linalg.norm(dx, axis=1), np.linalg.norm(dy, axis=1)
    varies = (size_x > _CONSTANT * np.linalg.norm(x, axis=1)) & (
        size_y > _CONSTANT * np.linalg.norm(y, axis=1)
    )
    size = np.where(varies, size_x * size_y, 1.0)
    return np.asarray(np.where(varies, (dx * dy).sum(axis=1) / size, 0.0))


def explained(measured: FloatArray, fitted: FloatArray) -> tuple[float, float]:
    """R^2 and variance accounted for over all elements together, of values (P, e).

    ``1 - |error|^2 / |values about their means|^2``; the second takes the mean error off too.
    Neither exists where nothing varies.
    """
    error, varying = measured - fitted, measured - measured.mean(axis=0)
    total = float((varying**2).sum())
    about = error - error.mean(axis=0)
    if not total:  # one row has nothing to explain
        return float("nan"), float("nan")
    return 1 - float((error**2).sum()) / total, 1 - float((about**2).sum()) / total


def element_quality(
    element: str,
    measured: ArrayLike,
    fitted: ArrayLike,
    *,
    held_out: ArrayLike | None,
    null_r: float,
    coefficients: float,
) -> ElementQuality:
    """Judge one element: measured, fitted, and predicted without the own row, each (P,).

    `held_out` (P,) or None: None where rows cannot be left out.
    `coefficients`: coefficients p that the fit spent on this element.
    """
    y, fit = np.asarray(measured, dtype=float), np.asarray(fitted, dtype=float)
    e, e0 = float(((y - fit) ** 2).sum()), float(((y - y.mean()) ** 2).sum())
    spare = len(y) - coefficients
    adjusted = 1 - (e / spare) / (e0 / (len(y) - 1)) if spare > 0 and e0 > 0 else float("nan")
    return ElementQuality(
        element=element,
        r=correlation(y, fit),
        e=e,
        adjusted_r2=adjusted,
        leave_one_out_r=float("nan") if held_out is None else correlation(y, held_out),
        null_r=null_r,
    )


Model = TypeVar("Model", bound="FittedModel")


class FittedModel(FittedResult, FrozenRecord):
    """A model of joint stiffness and viscosity with what its fit is worth.

    `write` gives its parameters as a table, or FIT.json; MODEL.json, from which it predicts again,
    is `write_model`'s.

    Attributes
    ----------
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    quality : tuple of ElementQuality
        How well each element of K and B is fitted.
    summary : FitSummary
        Method, size, condition and parameters of the fit.
    """

    dof: float
    quality: tuple[ElementQuality, ...]
    summary: FitSummary

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.dof > 0:
            raise InputError(f"{self.dof} degrees of freedom", expected="more than 0")

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of the fit."""
        return self.summary.warnings

    def with_warning(self: Model, warning: str) -> Model:
        """The same model with one warning more."""
        summary = replace(self.summary, warnings=(*self.summary.warnings, warning))
        return cast(Model, replace(cast(Any, self), summary=summary))

    def to_dict(self) -> dict[str, Any]:
        """The fit as MODEL.json holds it: its summary and the quality of each element."""
        return {**self.summary.to_dict(), "quality": [asdict(q) for q in self.quality]}

    def as_plain(self) -> dict[str, Any]:
        """Lists, numbers and texts from which `from_plain` makes the same model again."""
        plain: dict[str, Any] = to_plain(self)
        return plain

    @classmethod
    def from_plain(cls: type[Model], plain: Mapping[str, Any]) -> Model:
        """The model that `as_plain` wrote.

        Raises
        ------
        InputError
            A field is missing, unknown or not what it should be.
        """
        return from_plain(cls, plain)

    def _head(self) -> str:
        count = len(self.summary.warnings)
        warned = f", {count} warning{'s' * (count > 1)}" if count else ""
        return f"{self.summary.method}, {self.summary.n} numbers{warned}"

    def __repr__(self) -> str:
        lines = [
            f"{q.element}: R {q.r:.3f}, of rows left out {q.leave_one_out_r:.3f}, "
            f"of noise {q.null_r:.3f}"
            for q in self.quality
        ]
        return "\n".join([self._head(), *lines])

    def _repr_html_(self) -> str:
        import pandas as pd

        table = pd.DataFrame([asdict(q) for q in self.quality]).set_index("element")
        return f"<p>{escape(self._head())}</p>{table.to_html(float_format='{:.4g}'.format)}"
