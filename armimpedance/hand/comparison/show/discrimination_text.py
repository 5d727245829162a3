"""Two groups told apart, as text for a terminal."""

from __future__ import annotations

import numpy as np

from armimpedance.hand.comparison.discrimination import Discrimination, Group
from armimpedance.numerics.regression import t_factor
from armimpedance.show.text import aligned_table, numbered_notes, with_half_width, with_interval


def discrimination_text(result: Discrimination) -> str:
    """Groups, then how far apart they are.

    Parameters
    ----------
    result : Discrimination

    Returns
    -------
    str
    """
    rows = [_group_cells(group) for group in (result.first, result.second)]
    groups = aligned_table(("group", "people", f"mean {result.quantity}", "sd", "range"), rows)
    lines = [
        f"difference {with_interval(result.difference, *result.difference_ci95)} "
        f"({result.second.name} less {result.first.name}; Welch)",
        f"effect size {with_interval(result.effect, *result.effect_ci95)} "
        "(Hedges' g: in standard deviations between people)",
        f"Mann-Whitney U {result.mann_whitney_u:g}, p {result.p:.2g}",
        f"area under the ROC curve {with_interval(result.auc, *result.auc_ci95)} "
        f"(chance that one of {result.second.name} has the larger value)",
        f"leave-one-out: {result.correct} of {result.people} in the right group, "
        f"{_percent(result.accuracy)} ({_percent(result.accuracy_ci95[0])} to "
        f"{_percent(result.accuracy_ci95[1])}), threshold {result.threshold:.4g}",
    ]
    return "\n".join([groups, "", *lines, *numbered_notes(result.warnings)])


def _group_cells(group: Group) -> list[str]:
    values, count = group.values, len(group.people)
    sd = float(values.std(ddof=1))
    mean = with_half_width(float(values.mean()), t_factor(count - 1) * sd / np.sqrt(count))
    return [group.name, str(count), mean, f"{sd:.3g}", f"{values.min():.4g} to {values.max():.4g}"]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
