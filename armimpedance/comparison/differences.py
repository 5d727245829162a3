"""What differs between two independent estimates, quantity by quantity, with 95 % intervals.

Elements of the symmetric part differ by a difference, size and shape of the ellipse by a ratio (on
a log scale), the orientation by an angle in (-90, 90] degrees. Groups are independent: variances
add, with degrees of freedom after Welch and Satterthwaite.

Shape and orientation have limits of their own that are not symmetric (`ellipses`): the limits of
their change combine those (G. Y. Zou and A. Donner 2008, Construction of confidence limits about
effect measures, Stat Med 27:1693-1702),
``low = d - sqrt((x2 - low2)^2 + (high1 - x1)^2)``. Where a circle cannot be ruled out, so that one
of the two has no orientation, the change may be anything: -90 to 90 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final, Literal, Self

import numpy as np
from scipy.special import stdtrit

from armimpedance.comparison.distance import upper_elements
from armimpedance.conventions import MATRICES, UNITS
from armimpedance.ellipses import FIELDS, Ellipse, Which, ellipse_of
from armimpedance.errors import InputError
from armimpedance.records import ImpedanceEstimate

Kind = Literal["difference", "ratio"]

LEVEL: Final = 0.95
#: Fields of a change that are angles where its quantity is one.
_ANGLES: Final = (
    *("first", "second", "value", "low", "high", "sd"),
    *("between_sd", "between_low", "between_high"),
)


class InUnits:
    """A quantity whose angles can be shown in degrees."""

    quantity: str
    unit: str

    def in_degrees(self) -> Self:
        """An orientation in degrees; anything else as it is."""
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
    """How one quantity changes from the first to the second group.

    Attributes
    ----------
    matrix : {"inertia", "viscosity", "stiffness"}
    quantity : str
        ``K_11`` (of the symmetric part), "size", "shape", "orientation".
    unit : str
        Unit of `first` and `second`; orientation is in rad.
    kind : {"difference", "ratio"}
        second - first, or second / first.
    first, second : float
    value, low, high : float
        The change and its 95 % limits; nan where it does not exist.
    sd : float
        Standard error of the difference, or of the logarithm of the ratio.
    dof : float
        Degrees of freedom of t; inf = normal.
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
        axes then size, shape and orientation of the ellipse (nan where there is none).

    Raises
    ------
    InputError
        Estimates of different levels or numbers of axes.
    """
    if (first.level, first.k) != (second.level, second.k):
        raise InputError(
            f"a {first.level} estimate of {first.k} axes and a {second.level} estimate of "
            f"{second.k}",
            expected="the same level and axes",
        )
    found: list[Change] = []
    for field in FIELDS:
        found += _elements(first, second, field)
        if first.k == 2:
            found += _ellipse(first, second, field)
    return tuple(found)


def welch_dof(variances: tuple[float, float], dof: tuple[float, float]) -> float:
    """Degrees of freedom of the sum of two variances."""
    rate = sum(v**2 / f for v, f in zip(variances, dof, strict=True))
    return float(sum(variances) ** 2 / rate) if rate > 0 else float("inf")


def wrap_half_turn(angle: float) -> float:
    """The same axis in (-pi/2, pi/2]."""
    return float(np.pi / 2 - np.mod(np.pi / 2 - angle, np.pi))


def _elements(first: ImpedanceEstimate, second: ImpedanceEstimate, field: Which) -> list[Change]:
    k, i, symbol = first.k, FIELDS.index(field), MATRICES[field][0]
    C, block = upper_elements(k), slice(i * k * k, (i + 1) * k * k)
    one, two = (C @ getattr(e, field).ravel() for e in (first, second))
    v1, v2 = (np.diag(C @ e.covariance[block, block] @ C.T) for e in (first, second))
    rows, columns = np.triu_indices(k)
    found = []
    for j in range(len(C)):
        dof = welch_dof((v1[j], v2[j]), (first.dof, second.dof))
        sd = float(np.sqrt(max(v1[j] + v2[j], 0)))
        d, reach = float(two[j] - one[j]), float(stdtrit(dof, 0.5 + LEVEL / 2)) * sd
        name = f"{symbol}_{rows[j] + 1}{columns[j] + 1}"
        ends = (float(one[j]), float(two[j]), d, d - reach, d + reach)
        unit = UNITS[first.level][symbol]
        found.append(Change(field, name, unit, "difference", *ends, sd, dof))
    return found


def _ellipse(first: ImpedanceEstimate, second: ImpedanceEstimate, field: Which) -> list[Change]:
    one, two = ellipse_of(first, field), ellipse_of(second, field)
    unit = f"({UNITS[first.level][MATRICES[field][0]]})^2"
    if one is None or two is None:
        nan = (float("nan"),) * 7
        return [
            Change(field, "size", unit, "ratio", *nan),
            Change(field, "shape", "", "ratio", *nan),
            Change(field, "orientation", "rad", "difference", *nan),
        ]
    return [_size(one, two, field, unit), _shape(one, two, field), _turn(one, two, field)]


def _size(one: Ellipse, two: Ellipse, field: Which, unit: str) -> Change:
    v1, v2 = (_variance(e, 0) / e.size**2 for e in (one, two))
    dof, sd = welch_dof((v1, v2), (one.dof, two.dof)), float(np.sqrt(v1 + v2))
    # sizes beyond e^300 of one another are no measurement
    reach = min(float(stdtrit(dof, 0.5 + LEVEL / 2)) * sd, 300.0)
    ratio, factor = two.size / one.size, float(np.exp(reach))
    ends = (one.size, two.size, ratio, ratio / factor, ratio * factor)
    return Change(field, "size", unit, "ratio", *ends, sd, dof)


def _shape(one: Ellipse, two: Ellipse, field: Which) -> Change:
    logs = [np.log([e.shape, *e.interval(LEVEL)[2]]) for e in (one, two)]
    d = logs[1][0] - logs[0][0]
    low, high = _combined(d, logs[0], logs[1])
    v1, v2 = (_variance(e, 2) / e.shape**2 for e in (one, two))
    value, low, high = (float(np.exp(np.clip(x, -300, 300))) for x in (d, low, high))
    dof = welch_dof((v1, v2), (one.dof, two.dof)) if np.isfinite(v1 + v2) else float("nan")
    sd = float(np.sqrt(v1 + v2))
    return Change(field, "shape", "", "ratio", one.shape, two.shape, value, low, high, sd, dof)


def _turn(one: Ellipse, two: Ellipse, field: Which) -> Change:
    angles = [np.array([e.orientation_rad, *e.interval(LEVEL)[1]]) for e in (one, two)]
    d = wrap_half_turn(angles[1][0] - angles[0][0])
    low, high = _combined(d, angles[0], angles[1])
    unknown = one.may_be_circular(LEVEL) or two.may_be_circular(LEVEL) or high - low >= np.pi
    if unknown:
        low, high = -np.pi / 2, np.pi / 2
    v1, v2 = _variance(one, 1), _variance(two, 1)
    sd = float("nan") if unknown else float(np.sqrt(v1 + v2))
    dof = welch_dof((v1, v2), (one.dof, two.dof)) if np.isfinite(v1 + v2) else float("nan")
    ends = (float(angles[0][0]), float(angles[1][0]), d, float(low), float(high))
    return Change(field, "orientation", "rad", "difference", *ends, sd, dof)


def _combined(d: float, one: np.ndarray, two: np.ndarray) -> tuple[float, float]:
    """Limits of a difference d from (value, low, high) of both."""
    low = d - np.hypot(two[0] - two[1], one[2] - one[0])
    high = d + np.hypot(two[2] - two[0], one[0] - one[1])
    return float(low), float(high)


def _variance(of: Ellipse, row: int) -> float:
    """Variance of size (0), orientation (1) or shape (2), to first order; nan of a circle."""
    covariance = of.covariance
    return float("nan") if covariance is None else float(max(covariance[row, row], 0.0))
