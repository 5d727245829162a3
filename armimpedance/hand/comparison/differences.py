"""Differences of two independent estimates, quantity by quantity, with 95 % intervals.

Elements of the symmetric part are compared by a difference, size and shape of the ellipse by a
ratio (on a log scale), the orientation by an angle in (-90, 90] degrees. Groups are independent:
variances add, with degrees of freedom after Welch and Satterthwaite.

Shape and orientation have asymmetric limits (`ellipses`), which the limits of their change combine
(G. Y. Zou and A. Donner 2008, Construction of confidence limits about effect measures, Stat Med
27:1693-1702), ``low = d - sqrt((x2 - low2)^2 + (high1 - x1)^2)``. If a circle cannot be excluded,
so that one of the two has no orientation, the limits of the change are -90 and 90 degrees.

The values of a single group (`sides`) are computed once, whatever the number of its pairs, and many
pairs are computed in one call (`change_numbers`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final, Literal, NamedTuple, Self

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.conventions import MATRICES, UNITS
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.comparison.matrix_test import upper_elements
from armimpedance.hand.ellipses import FIELDS, Ellipse, Which, ellipse_of, half_turn

# Values of a single group: elements, variances and the limits of its ellipse.

LEVEL: Final = 0.95


@dataclass(frozen=True, eq=False)
class EllipseSide:
    """Ellipses of G groups; nan if a matrix has none.

    `shape`, `shape_variance` (G,), `angle_variance` (G,).
    `size`, `size_variance` (G,): the variance is that of the logarithm, to first order; the same
    for the shape.
    `log_shape` (G, 3): logarithm of the shape and of its 95 % limits.
    `angle` (G, 3): orientation in rad and its 95 % limits.
    `circular` (G,): True if a circle cannot be excluded.
    """

    size: FloatArray
    size_variance: FloatArray
    shape: FloatArray
    shape_variance: FloatArray
    log_shape: FloatArray
    angle: FloatArray
    angle_variance: FloatArray
    circular: BoolArray

    def select(self, rows: IntArray) -> Self:
        """Select groups by their indices."""
        return type(self)(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True, eq=False)
class Side:
    """One matrix of G groups.

    `dof` (G,).
    `values`, `variances` (G, c): elements of the symmetric part, and their variances.
    `ellipse`: None for other than two axes.
    """

    values: FloatArray
    variances: FloatArray
    dof: FloatArray
    ellipse: EllipseSide | None

    def select(self, rows: IntArray) -> Self:
        """Select groups by their indices."""
        part = None if self.ellipse is None else self.ellipse.select(rows)
        return type(self)(self.values[rows], self.variances[rows], self.dof[rows], part)


def side_of(estimates: Sequence[ImpedanceEstimate]) -> tuple[Side, ...]:
    """Inertia, viscosity and stiffness of estimates of one level and number of axes."""
    return tuple(_side(estimates, field) for field in FIELDS)


def _side(estimates: Sequence[ImpedanceEstimate], field: Which) -> Side:
    k, i = estimates[0].k, FIELDS.index(field)
    C, block = upper_elements(k), slice(i * k * k, (i + 1) * k * k)
    values = np.array([C @ getattr(e, field).ravel() for e in estimates])
    variances = np.array([np.diag(C @ e.covariance[block, block] @ C.T) for e in estimates])
    dof = np.array([e.dof for e in estimates])
    planar = _ellipses([ellipse_of(e, field) for e in estimates]) if k == 2 else None
    return Side(values, variances, dof, planar)


def _ellipses(ellipses: Sequence[Ellipse | None]) -> EllipseSide:
    rows = [_ellipse(ellipse) for ellipse in ellipses]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return EllipseSide(*columns)


def _ellipse(of: Ellipse | None) -> tuple[float | FloatArray, ...]:
    """Entries of one group, in the order of `EllipseSide`."""
    if of is None:
        nan, three = float("nan"), np.full(3, np.nan)
        return nan, nan, nan, nan, three, three, nan, False
    limits = of.interval(LEVEL)
    with np.errstate(divide="ignore"):
        log_shape = np.log([of.shape, *limits[2]])
    return (
        of.size,
        _variance(of, 0) / of.size**2,
        of.shape,
        _variance(of, 2) / of.shape**2,
        log_shape,
        np.array([of.orientation_rad, *limits[1]]),
        _variance(of, 1),
        of.may_be_circular(LEVEL),
    )


def _variance(of: Ellipse, row: int) -> float:
    """Variance of size (0), orientation (1) or shape (2), to first order; nan of a circle."""
    covariance = of.covariance
    return float("nan") if covariance is None else float(max(covariance[row, row], 0.0))


Kind = Literal["difference", "ratio"]

#: Fields of a change that are angles for an orientation.
_ANGLES: Final = (
    *("first", "second", "value", "low", "high", "sd"),
    *("between_sd", "between_low", "between_high"),
)
#: Ratios of sizes and shapes are limited to e^300.
_LARGEST_EXPONENT: Final = 300.0
#: Largest number whose square is a finite float.
_LARGEST_ROOT: Final = 1e154


class InUnits:
    """A quantity whose angles can be converted to degrees."""

    quantity: str
    unit: str

    def in_degrees(self) -> Self:
        """Convert an orientation to degrees; return anything else unchanged."""
        if self.unit != "rad" or self.quantity != "orientation":
            return self
        turned: dict[str, Any] = {
            name: float(np.degrees(getattr(self, name)))
            for name in _ANGLES
            if isinstance(getattr(self, name, None), float)
        }
        return replace(self, unit="deg", **turned)  # type: ignore[type-var]


@dataclass(frozen=True)
class Change(InUnits):
    """Change of one quantity from the first to the second group.

    `quantity`: ``K_11`` (of the symmetric part), "size", "shape", "orientation".
    `unit`: unit of `first` and `second`; orientation is in rad.
    `kind`: second - first, or second / first.
    `value`, `low`, `high`: the change and its 95 % limits; nan if it does not exist.
    `sd`: standard error of the difference, or of the logarithm of the ratio.
    `dof`: degrees of freedom of t; inf = normal.
    """

    matrix: Which
    quantity: str
    unit: str
    kind: Kind
    first: float
    second: float
    value: float
    low: float
    high: float
    sd: float
    dof: float


class Label(NamedTuple):
    """Quantity of a change: the fields of the same names of `Change`."""

    matrix: Which
    quantity: str
    unit: str
    kind: Kind


def changes(first: ImpedanceEstimate, second: ImpedanceEstimate) -> tuple[Change, ...]:
    """All changes from the first to the second estimate.

    Parameters
    ----------
    first, second : ImpedanceEstimate
        Two independent estimates of the same level and number of axes.

    Returns
    -------
    tuple of Change
        For each of inertia, viscosity and stiffness the elements of the symmetric part; with two
        axes then size, shape and orientation of the ellipse (nan if there is none).

    Raises
    ------
    InputError
        Estimates of different levels or numbers of axes.
    """
    check_alike(first, second)
    pair = side_of((first, second))
    numbers = change_numbers(pair, np.array([0]), np.array([1]))[0]
    labels = labels_of(first)
    return tuple(Change(*label, *row) for label, row in zip(labels, numbers.tolist(), strict=True))


def check_alike(first: ImpedanceEstimate, second: ImpedanceEstimate) -> None:
    """Refuse two estimates that cannot be compared.

    Raises InputError: different levels or numbers of axes.
    """
    if (first.level, first.k) != (second.level, second.k):
        raise InputError(
            f"a {first.level} estimate of {first.k} axes and a {second.level} estimate of "
            f"{second.k}",
            expected="the same level and axes",
        )


def labels_of(estimate: ImpedanceEstimate) -> tuple[Label, ...]:
    """Labels of the changes of such estimates, in their order."""
    labels: list[Label] = []
    for field in FIELDS:
        symbol = MATRICES[field][0]
        unit = UNITS[estimate.level][symbol]
        names = [f"{symbol}_{i + 1}{j + 1}" for i, j in zip(*np.triu_indices(estimate.k))]  # noqa: B905
        labels += [Label(field, name, unit, "difference") for name in names]
        if estimate.k == 2:
            labels.append(Label(field, "size", f"({unit})^2", "ratio"))
            labels.append(Label(field, "shape", "", "ratio"))
            labels.append(Label(field, "orientation", "rad", "difference"))
    return tuple(labels)


def change_numbers(sides: Sequence[Side], first: IntArray, second: IntArray) -> FloatArray:
    """Compute the numbers of all changes of R pairs.

    `sides`: one for each matrix (`side_of`), of all groups.
    `first`, `second` (R,): indices of the groups of each pair.
    Returns: (R, n, 7): of the n changes of `labels_of`: first, second, value, low, high, sd, dof.
    """
    columns: list[FloatArray] = []
    # without an ellipse, all values are nan
    with np.errstate(all="ignore"):
        for side in sides:
            first_side, second_side = side.select(first), side.select(second)
            columns += [
                _element(first_side, second_side, j) for j in range(first_side.values.shape[1])
            ]
            if first_side.ellipse is not None and second_side.ellipse is not None:
                dof = first_side.dof, second_side.dof
                columns.append(_size(first_side.ellipse, second_side.ellipse, dof))
                columns.append(_shape(first_side.ellipse, second_side.ellipse, dof))
                columns.append(_turn(first_side.ellipse, second_side.ellipse, dof))
    return np.stack(columns, axis=1)


def welch_dof(variances: tuple[Any, Any], dof: tuple[Any, Any]) -> FloatArray:
    """Degrees of freedom of the sum of two variances, numbers or (R,)."""
    (v1, v2), (f1, f2) = variances, dof
    rate = _squared(v1) / f1 + _squared(v2) / f2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(rate > 0, _squared(np.add(v1, v2)) / rate, np.inf)


def _squared(values: Any) -> FloatArray:
    """Squares by the C library's ``pow``: bitwise equal for arrays and single numbers."""
    flat = np.ravel(values).tolist()
    squares = [np.inf if abs(value) >= _LARGEST_ROOT else value**2 for value in flat]
    return np.array(squares).reshape(np.shape(values))


def _reach(dof: FloatArray, sd: FloatArray) -> FloatArray:
    """Half-width of the 95 % interval."""
    return np.asarray(stdtrit(dof, 0.5 + LEVEL / 2) * sd)


def _element(first: Side, second: Side, j: int) -> FloatArray:
    x1, x2, v1, v2 = (
        first.values[:, j],
        second.values[:, j],
        first.variances[:, j],
        second.variances[:, j],
    )
    dof, sd = welch_dof((v1, v2), (first.dof, second.dof)), np.sqrt(np.maximum(v1 + v2, 0))
    d, reach = x2 - x1, _reach(dof, sd)
    return np.stack([x1, x2, d, d - reach, d + reach, sd, dof], axis=1)


def _size(
    first: EllipseSide, second: EllipseSide, dof: tuple[FloatArray, FloatArray]
) -> FloatArray:
    v1, v2 = first.size_variance, second.size_variance
    joint, sd = welch_dof((v1, v2), dof), np.sqrt(v1 + v2)
    ratio, factor = (
        second.size / first.size,
        np.exp(np.minimum(_reach(joint, sd), _LARGEST_EXPONENT)),
    )
    missing = np.isnan(ratio)
    ends = (first.size, second.size, ratio, ratio / factor, ratio * factor, sd, joint)
    return _absent(np.stack(ends, axis=1), missing)


def _shape(
    first: EllipseSide, second: EllipseSide, dof: tuple[FloatArray, FloatArray]
) -> FloatArray:
    d = second.log_shape[:, 0] - first.log_shape[:, 0]
    low, high = _combined(d, first.log_shape, second.log_shape)
    limit = _LARGEST_EXPONENT
    ends = [np.exp(np.clip(x, -limit, limit)) for x in (d, low, high)]
    v1, v2 = first.shape_variance, second.shape_variance
    joint = np.where(np.isfinite(v1 + v2), welch_dof((v1, v2), dof), np.nan)
    row = np.stack([first.shape, second.shape, *ends, np.sqrt(v1 + v2), joint], axis=1)
    return _absent(row, np.isnan(d))


def _turn(
    first: EllipseSide, second: EllipseSide, dof: tuple[FloatArray, FloatArray]
) -> FloatArray:
    d = half_turn(second.angle[:, 0] - first.angle[:, 0])
    low, high = _combined(d, first.angle, second.angle)
    unknown = first.circular | second.circular | (high - low >= np.pi)
    low, high = np.where(unknown, -np.pi / 2, low), np.where(unknown, np.pi / 2, high)
    v1, v2 = first.angle_variance, second.angle_variance
    sd = np.where(unknown, np.nan, np.sqrt(v1 + v2))
    joint = np.where(np.isfinite(v1 + v2), welch_dof((v1, v2), dof), np.nan)
    row = np.stack([first.angle[:, 0], second.angle[:, 0], d, low, high, sd, joint], axis=1)
    return _absent(row, np.isnan(d))


def _combined(
    d: FloatArray, first: FloatArray, second: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Limits of differences d (R,) from (value, low, high) of both groups, (R, 3)."""
    low = d - np.hypot(second[:, 0] - second[:, 1], first[:, 2] - first[:, 0])
    high = d + np.hypot(second[:, 2] - second[:, 0], first[:, 0] - first[:, 1])
    return low, high


def _absent(rows: FloatArray, missing: FloatArray) -> FloatArray:
    """Set rows to nan if an ellipse is missing."""
    return np.where(missing[:, None], np.nan, rows)
