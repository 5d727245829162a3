"""Two groups of people told apart by one number each, such as a shoulder's passive stiffness.

A mean difference that is "significant" says little about the next patient. What does: how far apart
the groups stand in units of the spread between people (effect size), how often a member of one has
the larger value (area under the ROC curve), and how many are put into the right group by a rule
that was made without them (leave-one-out).
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import sqrt
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from scipy.stats import mannwhitneyu

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.hand.comparison.two_samples import (
    Interval,
    hedges_g,
    leave_one_out,
    newcombe_auc,
    welch,
    wilson,
)

if TYPE_CHECKING:
    import pandas as pd

#: Fewer people in a group say nothing about the spread between them.
FEWEST: Final = 3


@dataclass(frozen=True, eq=False)
class Group(FrozenRecord):
    """One value a person, with its standard error where there is one.

    Attributes
    ----------
    name : str
    people : tuple of str
    values : (P,)
    sd : (P,) or None
        Standard error of each value as measured; for drawing, and to say how much of the spread it
        makes.
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


@dataclass(frozen=True, repr=False, eq=False)
class Discrimination(FrozenRecord):
    """How well one number tells two groups apart.

    Attributes
    ----------
    quantity : str
        Name of the values, with their unit.
    first, second : Group
    difference, difference_ci95 : float, (2,)
        Mean of the second less that of the first; Welch's interval.
    effect, effect_ci95 : float, (2,)
        Hedges' g: the difference over the pooled standard deviation, its small-sample bias taken
        off; interval from the noncentral t distribution.
    mann_whitney_u, p : float
        U of the second group; exact two-sided p where nobody ties.
    auc, auc_ci95 : float, (2,)
        Chance that a member of the second group has the larger value, ties counting half; the
        score interval of Newcombe (2006), method 5, which is not empty where all are told apart.
    threshold : float
        Midway between the groups' means.
    correct, people : int
        How many a threshold puts right that was made without them.
    accuracy_ci95 : (2,)
        Wilson's interval of correct/people.
    measurement_share : float or None
        Part of the variance within the groups that the values' own errors make up.
    warnings : tuple of str
    """

    quantity: str
    first: Group
    second: Group
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
        """Share of people that leave-one-out puts right."""
        return self.correct / self.people

    def to_frame(self) -> pd.DataFrame:
        """One row a measure: value and 95 % limits."""
        import pandas as pd

        rows = {
            "difference of means": (self.difference, *self.difference_ci95),
            "effect size": (self.effect, *self.effect_ci95),
            "area under the ROC curve": (self.auc, *self.auc_ci95),
            "accuracy": (self.accuracy, *self.accuracy_ci95),
        }
        frame = pd.DataFrame.from_dict(rows, "index", columns=["value", "ci_low", "ci_high"])
        return frame.rename_axis("measure")

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as the command writes them."""
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


def discriminate_groups(first: Group, second: Group, parameter: str = "") -> Discrimination:
    """Tell two groups apart by their values.

    Parameters
    ----------
    first, second : Group
    parameter : str
        Name of the values.

    Returns
    -------
    Discrimination

    Raises
    ------
    InputError
        Groups of one name or of different units, or of people who are all alike.
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


def _group_object(group: Group) -> dict[str, Any]:
    sds = [None] * len(group.people) if group.sd is None else group.sd.tolist()
    people = zip(group.people, group.values.tolist(), sds, strict=True)
    return {
        "name": group.name,
        "people": [{"id": who, "value": value, "sd": sd} for who, value, sd in people],
    }


def _measurement_share(first: Group, second: Group) -> float | None:
    if first.sd is None or second.sd is None:
        return None
    errors = np.concatenate([first.sd, second.sd])
    spread = [(g.values - g.values.mean()) / sqrt(1 - 1 / len(g.people)) for g in (first, second)]
    return float((errors**2).mean() / (np.concatenate(spread) ** 2).mean())


def _warnings(x: FloatArray, y: FloatArray, share: float | None) -> tuple[str, ...]:
    told = []
    if min(len(x), len(y)) < 8:
        told.append(
            f"{len(x)} and {len(y)} people: the intervals are wide, and those of the effect size "
            "and the difference take the values as normally distributed"
        )
    if share is not None and share > 0.5:
        told.append(
            f"{100 * share:.0f} % of the spread within the groups is the measurement's own error: "
            "more or longer recordings would part the groups better"
        )
    return tuple(told)
