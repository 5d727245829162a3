"""Discrimination of two groups of people by one number each: measures, intervals, threshold.

A "significant" mean difference says little about the next patient. The following measures do: the
difference of the groups in units of the spread between people (effect size), the probability that a
member of one has the larger value (area under the ROC curve), and the number assigned to the right
group by a rule that was made without them (leave-one-out).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from math import sqrt
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaln, nctdtrinc
from scipy.stats import mannwhitneyu, norm

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.numerics.regression import t_factor
from armimpedance.show.files import Content, Quantity, WrittenResult, table_content

if TYPE_CHECKING:
    import pandas as pd

# Separation of two samples: five measures, each with its 95 % interval.

_LEVEL: Final = 0.95
Interval = tuple[float, float]


def welch(x: FloatArray, y: FloatArray) -> tuple[float, Interval]:
    """Difference of means ``y - x`` and its 95 % interval for unequal variances."""
    vx, vy = x.var(ddof=1) / len(x), y.var(ddof=1) / len(y)
    dof = (vx + vy) ** 2 / (vx**2 / (len(x) - 1) + vy**2 / (len(y) - 1))
    difference, half = float(y.mean() - x.mean()), t_factor(float(dof)) * sqrt(vx + vy)
    return difference, (difference - half, difference + half)


def hedges_g(x: FloatArray, y: FloatArray) -> tuple[float, Interval]:
    """Standardised difference ``J (mean y - mean x)/s`` and its 95 % interval.

    ``J = Gamma(m/2)/(sqrt(m/2) Gamma((m - 1)/2))``, m degrees of freedom (Hedges 1981, J Educ Stat
    6:107-128). The interval inverts the noncentral t distribution of
    ``t = d sqrt(n1 n2/(n1 + n2))``.
    """
    m = len(x) + len(y) - 2
    pooled = ((len(x) - 1) * x.var(ddof=1) + (len(y) - 1) * y.var(ddof=1)) / m
    scale = sqrt(len(x) * len(y) / (len(x) + len(y)))
    t = float(y.mean() - x.mean()) / sqrt(pooled) * scale
    bias = float(np.exp(gammaln(m / 2) - gammaln((m - 1) / 2)) / sqrt(m / 2))
    tail = (1 - _LEVEL) / 2
    low, high = (float(nctdtrinc(m, p, t)) for p in (1 - tail, tail))
    return bias * t / scale, (bias * low / scale, bias * high / scale)


def newcombe_auc(auc: float, n_first: int, n_second: int) -> Interval:
    """95 % limits of an area under the ROC curve: ``|auc - A| = z sqrt(V(A))`` solved for A.

    ``V(A) = A (1 - A) [1 + (N - 1)((1 - A)/(2 - A) + A/(1 + A))]/(n1 n2)``, ``N = (n1 + n2)/2``
    (Newcombe 2006, Stat Med 25:559-573, method 5).
    """
    z = float(norm.ppf(0.5 + _LEVEL / 2))
    mean_size = (n_first + n_second) / 2

    def excess(area: float) -> float:
        spread = 1 + (mean_size - 1) * ((1 - area) / (2 - area) + area / (1 + area))
        variance = area * (1 - area) * spread / (n_first * n_second)
        return (auc - area) ** 2 - z**2 * variance

    # an area of 0 or 1 solves the equation too: the other root is the limit
    edge = 1e-9
    low = 0.0 if auc == 0 else float(brentq(excess, 0.0, min(auc, 1 - edge)))
    high = 1.0 if auc == 1 else float(brentq(excess, max(auc, edge), 1.0))
    return low, high


def leave_one_out(x: FloatArray, y: FloatArray) -> int:
    """Number of people on their own group's side of the midpoint of the others' means.

    A person exactly on the midpoint counts as wrong.
    """
    correct = 0
    for own, other in ((x, y), (y, x)):
        rest = (own.sum() - own) / (len(own) - 1)
        middle = (rest + other.mean()) / 2
        correct += int(((own - middle) * (rest - other.mean()) > 0).sum())
    return correct


def wilson(successes: int, trials: int) -> Interval:
    """95 % score interval of a proportion (Wilson 1927)."""
    z = float(norm.ppf(0.5 + _LEVEL / 2))
    share, weight = successes / trials, 1 + z**2 / trials
    middle = (share + z**2 / (2 * trials)) / weight
    half = z * sqrt(share * (1 - share) / trials + z**2 / (4 * trials**2)) / weight
    return max(middle - half, 0.0), min(middle + half, 1.0)


#: Fewest people in a group, for an estimate of the spread between them.
FEWEST: Final = 3


@dataclass(frozen=True, eq=False)
class PeopleGroup(FrozenRecord):
    """One value per person, with its standard error if there is one.

    Attributes
    ----------
    name : str
    people : tuple of str
    values : (P,)
    sd : (P,) or None
        Standard error of each measured value; for drawing, and for its share of the spread.
    unit : str
    """

    name: str
    people: Annotated[tuple[str, ...], "P"]
    values: Annotated[FloatArray, "P"]
    sd: Annotated[FloatArray, "P"] | None = None
    unit: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.people) < FEWEST:
            raise InputError(
                f"group {self.name} has {len(self.people)} people", expected=f"{FEWEST} or more"
            )


#: Meanings of the columns; all measures but the difference are pure numbers.
MEASURES: Final = {
    "measure": Meaning("how far the groups stand apart, by this measure"),
    "value": Meaning("value of the measure"),
    "ci_low": Meaning("lower 95 % limit"),
    "ci_high": Meaning("upper 95 % limit"),
}
_DIFFERENCE: Final = "difference of means"


def _measured(row: Mapping[str, Any]) -> Quantity:
    """Convert a row of the table to one number with its limits."""
    name, unit = row["measure"], "" if row["measure"] == _DIFFERENCE else "1"
    return Quantity({}, name, name, row["value"], row["ci_low"], row["ci_high"], unit=unit)


@dataclass(frozen=True, repr=False, eq=False)
class Discrimination(WrittenResult, FrozenRecord):
    """Separation of two groups by one number.

    Attributes
    ----------
    quantity : str
        Name of the values, with their unit.
    first, second : PeopleGroup
    difference, difference_ci95 : float, (2,)
        Mean of the second minus that of the first; Welch's interval.
    effect, effect_ci95 : float, (2,)
        Hedges' g: the difference over the pooled standard deviation, corrected for its small-sample
        bias; interval from the noncentral t distribution.
    mann_whitney_u, p : float
        U of the second group; exact two-sided p without ties.
    auc, auc_ci95 : float, (2,)
        Chance that a member of the second group has the larger value, ties counting half; the
        score interval of Newcombe (2006), method 5, which has a positive length even for complete
        separation.
    threshold : float
        Midway between the groups' means.
    correct, people : int
        Number of people classified correctly by a threshold that was made without them.
    accuracy_ci95 : (2,)
        Wilson's interval of correct/people.
    measurement_share : float or None
        Share of the errors of the values in the variance within the groups.
    warnings : tuple of str
    """

    DESCRIBED = MEASURES

    quantity: str
    first: PeopleGroup
    second: PeopleGroup
    difference: float
    difference_ci95: Interval
    effect: float
    effect_ci95: Interval
    mann_whitney_u: float
    p: float
    auc: float
    auc_ci95: Interval
    threshold: float
    correct: int
    people: int
    accuracy_ci95: Interval
    measurement_share: float | None
    warnings: tuple[str, ...] = ()

    @property
    def accuracy(self) -> float:
        """Share of people classified correctly by leave-one-out."""
        return self.correct / self.people

    def to_frame(self) -> pd.DataFrame:
        """One row per measure: value and 95 % limits."""
        import pandas as pd

        rows = {
            _DIFFERENCE: (self.difference, *self.difference_ci95),
            "effect size": (self.effect, *self.effect_ci95),
            "area under the ROC curve": (self.auc, *self.auc_ci95),
            "accuracy": (self.accuracy, *self.accuracy_ci95),
        }
        frame = pd.DataFrame.from_dict(rows, "index", columns=["value", "ci_low", "ci_high"])
        return frame.rename_axis("measure")

    @property
    def content(self) -> Content:
        """One row per measure; JSON also holds the value of each person."""
        table = self.to_frame().reset_index().to_dict("records")
        rows = [{str(name): cell for name, cell in row.items()} for row in table]
        return table_content(
            rows,
            keys=("measure",),
            objects=self.to_dict,
            described=self.DESCRIBED,
            quantities=lambda: [_measured(row) for row in rows],
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain values, for the command's JSON."""
        return {
            "quantity": self.quantity,
            "groups": [_group_object(group) for group in (self.first, self.second)],
            "difference": self.difference,
            "difference_ci95": self.difference_ci95,
            "effect_size": self.effect,
            "effect_size_ci95": self.effect_ci95,
            "mann_whitney_u": self.mann_whitney_u,
            "p": self.p,
            "auc": self.auc,
            "auc_ci95": self.auc_ci95,
            "threshold": self.threshold,
            "leave_one_out_correct": self.correct,
            "people": self.people,
            "accuracy_ci95": self.accuracy_ci95,
            "measurement_share": self.measurement_share,
            "warnings": list(self.warnings),
        }

    def __repr__(self) -> str:
        who = (f"{group.name} ({len(group.people)})" for group in (self.first, self.second))
        lines = [
            f"{name}: {value:.3g} (95 %: {low:.3g} to {high:.3g})"
            for name, value, low, high in self.to_frame().itertuples()
        ]
        right = f"leave-one-out: {self.correct} of {self.people} in the right group"
        head = f"{self.quantity or 'values'} of {' and '.join(who)}"
        return "\n".join([head, *lines, right, *self.warnings])

    def _repr_html_(self) -> str:
        head, *lines = repr(self).splitlines()
        return f"<p>{escape(head)}</p><ul>{''.join(f'<li>{escape(s)}</li>' for s in lines)}</ul>"


def discriminate_groups(
    first: PeopleGroup, second: PeopleGroup, parameter: str = ""
) -> Discrimination:
    """Measure how well two groups are separated by their values.

    Parameters
    ----------
    first, second : PeopleGroup
    parameter : str
        Name of the values.

    Returns
    -------
    Discrimination

    Raises
    ------
    InputError
        Groups of the same name or of different units, or without any spread.
    """
    if first.name == second.name:
        raise InputError(f"two groups of the name {first.name}", expected="a name each")
    if first.unit != second.unit:
        both = f"{parameter} in {first.unit} and in {second.unit}"
        raise InputError(both, expected="one unit")
    x, y = first.values, second.values
    if np.ptp(x) == 0 and np.ptp(y) == 0:
        raise InputError("all values within a group are equal", expected="a spread between people")
    test = mannwhitneyu(y, x, alternative="two-sided")
    auc = float(test.statistic) / (len(x) * len(y))
    effect, effect_ci = hedges_g(x, y)
    difference, difference_ci = welch(x, y)
    correct = leave_one_out(x, y)
    people = len(x) + len(y)
    share = _measurement_share(first, second)
    return Discrimination(
        quantity=f"{parameter} ({first.unit})" if first.unit else parameter,
        first=first,
        second=second,
        difference=difference,
        difference_ci95=difference_ci,
        effect=effect,
        effect_ci95=effect_ci,
        mann_whitney_u=float(test.statistic),
        p=float(test.pvalue),
        auc=auc,
        auc_ci95=newcombe_auc(auc, len(x), len(y)),
        threshold=float(x.mean() + y.mean()) / 2,
        correct=correct,
        people=people,
        accuracy_ci95=wilson(correct, people),
        measurement_share=share,
        warnings=_warnings(x, y, share),
    )


def _group_object(group: PeopleGroup) -> dict[str, Any]:
    sds = [None] * len(group.people) if group.sd is None else group.sd.tolist()
    people = zip(group.people, group.values.tolist(), sds, strict=True)
    return {
        "name": group.name,
        "people": [{"id": who, "value": value, "sd": sd} for who, value, sd in people],
    }


def _measurement_share(first: PeopleGroup, second: PeopleGroup) -> float | None:
    if first.sd is None or second.sd is None:
        return None
    errors = np.concatenate([first.sd, second.sd])
    spread = [(g.values - g.values.mean()) / sqrt(1 - 1 / len(g.people)) for g in (first, second)]
    return float((errors**2).mean() / (np.concatenate(spread) ** 2).mean())


def _warnings(x: FloatArray, y: FloatArray, share: float | None) -> tuple[str, ...]:
    warnings = []
    if min(len(x), len(y)) < 8:
        warnings.append(
            f"{len(x)} and {len(y)} people: the intervals are wide, and those of the effect size "
            "and the difference take the values as normally distributed"
        )
    if share is not None and share > 0.5:
        # a share above 1: the stated errors are larger than the spread
        part = "all" if share > 1 else f"{100 * share:.0f} %"
        larger = f" (the stated errors are {sqrt(share):.2g} times as large)" if share > 1 else ""
        warnings.append(
            f"{part} of the spread within the groups is the measurement's own error{larger}: more "
            "or longer recordings would part the groups better"
        )
    return tuple(warnings)
