"""Comparisons of groups as text for a terminal of 100 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from heapq import nsmallest
from typing import Any

import numpy as np

from armimpedance.core.shown import with_half_width, with_interval
from armimpedance.hand.comparison.discrimination import Discrimination, PeopleGroup
from armimpedance.hand.comparison.groups import Pair
from armimpedance.hand.comparison.subjects import SubjectsChange
from armimpedance.hand.ellipses import FIELDS
from armimpedance.numerics.regression import t_factor
from armimpedance.show.text import aligned_table, numbered_notes, short

_WIDTH = 100
_NAME = 30
#: With more pairs than this each has one line only.
_MOST_IN_FULL = 10
#: With more pairs than this only the first _SHOWN_OF_MANY of those that differ most are shown.
_MOST_SHOWN = 200
_SHOWN_OF_MANY = 20
_LEVEL = 0.05
_QUANTITIES = ("size", "shape", "orientation")
_LEGEND = (
    "Size and shape of the ellipse as ratios second/first, its orientation as a turn, elements of "
    "the symmetric part as differences second - first, all with 95 % intervals (independent "
    "groups; Welch). -90 to 90 deg: an ellipse may be a circle."
)
_BASIS = {
    "permutation": "p: trials exchanged between the groups within each direction",
    "covariance": "p: no trials at hand, from the estimates' covariances (T2 against F, the "
    "distance by simulation)",
    "first order": "p: so many pairs allow no exchanges or draws, from the estimates' covariances "
    "(T2 against F, the distance against its law to first order)",
}
_TESTS = (
    ", for the same M, B, K and for all three at once. T2 (Hotelling's, each group with its own "
    "errors) finds the most; distance is affine-invariant. Adjusted: Holm, over all pairs."
)
_SHORT = " Many pairs: single elements and unadjusted p values stand in --out only."
_SUBJECTS = (
    "Mean change over subjects with its 95 % interval (t, subjects - 1 degrees of freedom) and the "
    "standard deviation between subjects with its own (of a ratio: that of its logarithm). "
    "Adjusted p: Holm, over the pairs of groups."
)


def comparison_text(pairs: Sequence[Pair]) -> str:
    """Ellipses, elements and tests of all pairs, then notes.

    `pairs`: compared pairs of groups.
    Returns: a block of text per pair, and explanations at the end.
    """
    if len(pairs) > _MOST_SHOWN:
        shown = _most_different(pairs)
        return f"{_counted(pairs, len(shown))}\n\n{_text_of(shown)}"
    return _text_of(pairs)


def _text_of(pairs: Sequence[Pair]) -> str:
    many = len(pairs) > _MOST_IN_FULL
    blocks = [
        f"{field.capitalize()} {symbol}\n{_changes_table(pairs, field, many)}"
        for field, symbol in zip(FIELDS, "MBK", strict=True)
    ]
    blocks.append("Tests\n" + (_short_tests_table(pairs) if many else _tests_table(pairs)))
    bases = list(dict.fromkeys(pair.basis for pair in pairs))
    tests = "; ".join(_BASIS[basis] for basis in bases) + _TESTS
    legend = _LEGEND + (_SHORT if many else "")
    notes = [f"{pair.first} | {pair.second}: {note}" for pair in pairs for note in pair.notes]
    filled = [textwrap.fill(note, _WIDTH, subsequent_indent="  ") for note in notes]
    return "\n\n".join(
        [*blocks, textwrap.fill(legend, _WIDTH), textwrap.fill(tests, _WIDTH), *filled]
    )


def _most_different(pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs with the smallest p of T2 of all three matrices, then the largest T2."""

    def chance(pair: Pair) -> tuple[float, float]:
        test = pair.tests[-1]
        return (test.p_t2, -test.t2) if np.isfinite(test.p_t2) else (2.0, 0.0)

    return nsmallest(_SHOWN_OF_MANY, pairs, key=chance)


def _counted(pairs: Sequence[Pair], shown: int) -> str:
    """Sentence on the number of pairs that differ, and the place of the others."""
    differ, noted = [0] * 4, 0
    for pair in pairs:
        noted += bool(pair.notes)
        for i, test in enumerate(pair.tests):
            differ[i] += test.p_t2_adjusted <= _LEVEL
    counts = ", ".join(f"{s} in {n}" for s, n in zip("MBK", differ, strict=False))
    text = (
        f"{differ[-1]} of {len(pairs)} pairs differ in M, B and K taken together (adjusted p of T2 "
        f"at most {_LEVEL:g}); {counts}. The {shown} of least p stand here; all {len(pairs)} stand "
        "in --out; --against compares with one group only."
    )
    text += f" {noted} pairs have notes, which stand in --out too." if noted else ""
    return textwrap.fill(text, _WIDTH)


def subjects_text(changes: Sequence[SubjectsChange]) -> str:
    """Mean changes of each pair of groups, a table per pair.

    `found`: mean changes over subjects, one for each pair of groups.
    Returns: a table per pair, and an explanation at the end.
    """
    blocks = []
    for first, second in dict.fromkeys((c.first, c.second) for c in changes):
        rows = [_subjects_row(c) for c in changes if (c.first, c.second) == (first, second)]
        header = ["", "mean change", "sd between subjects", "subjects", "p", "adjusted"]
        blocks.append(f"{first} | {second}\n{aligned_table(header, rows)}")
    return "\n\n".join([*blocks, textwrap.fill(_SUBJECTS, _WIDTH)])


def pair_name(pair: Pair) -> str:
    """Name ``first | second``, cut to the width in tables."""
    half = _NAME // 2 - 1
    return f"{short(pair.first, half)} | {short(pair.second, half)}"


def shown_p(p: float) -> str:
    """p with three digits; ``-`` for nan."""
    return "-" if np.isnan(p) else f"{p:.3f}" if p >= 0.001 else f"{p:.0e}"


def _changes_table(pairs: Sequence[Pair], field: str, many: bool) -> str:
    quantities = [c.quantity for c in pairs[0].changes if c.matrix == field]
    ellipse = [q for q in _QUANTITIES if q in quantities]
    elements = [q for q in quantities if q not in _QUANTITIES]
    parts = [ellipse] if many and ellipse else [ellipse, elements]
    return "\n".join(_quantities_table(pairs, field, part) for part in parts if part)


def _quantities_table(pairs: Sequence[Pair], field: str, quantities: Sequence[str]) -> str:
    header = ["", *(_heading(pairs[0], field, q) for q in quantities)]
    rows = [[pair_name(p), *(shown_change(_of(p, field, q)) for q in quantities)] for p in pairs]
    return aligned_table(header, rows)


def _heading(pair: Pair, field: str, quantity: str) -> str:
    if quantity in ("size", "shape"):
        return f"{quantity} ratio"
    return f"{quantity} ({_of(pair, field, quantity).unit})"


def _of(pair: Pair, field: str, quantity: str) -> Any:
    """The change of a quantity of a matrix, angles in degrees."""
    chosen = (c for c in pair.changes if (c.matrix, c.quantity) == (field, quantity))
    return next(chosen).in_degrees()


def shown_change(change: Any) -> str:
    """Value with its 95 % interval; "-" if there is none."""
    return _interval(change.value, change.low, change.high)


def _interval(value: float, low: float, high: float) -> str:
    if not np.isfinite([value, low, high]).all():
        return "-"
    return with_interval(value, low, high) if high > low else f"{value:.4g}"


def _tests_table(pairs: Sequence[Pair]) -> str:
    header = ["", "matrix", "distance", "p", "adjusted", "T2", "p", "adjusted"]
    rows = []
    for pair in pairs:
        for test in pair.tests:
            name = pair_name(pair) if test is pair.tests[0] else ""
            cells = [test.matrix, "-" if np.isnan(test.distance) else f"{test.distance:.3f}"]
            cells += [shown_p(test.p_distance), shown_p(test.p_distance_adjusted)]
            cells += ["-" if np.isnan(test.t2) else f"{test.t2:.1f}"]
            rows.append([name, *cells, shown_p(test.p_t2), shown_p(test.p_t2_adjusted)])
    return aligned_table(header, rows)


def _short_tests_table(pairs: Sequence[Pair]) -> str:
    """One line for each pair: distances, then adjusted p of T2."""
    header = ["", *(f"distance {s}" for s in "MBK"), *(f"adjusted p {s}" for s in "MBK"), "all"]
    rows = []
    for pair in pairs:
        apart = ["-" if np.isnan(t.distance) else f"{t.distance:.3f}" for t in pair.tests[:3]]
        rows.append([pair_name(pair), *apart, *(shown_p(t.p_t2_adjusted) for t in pair.tests)])
    return aligned_table(header, rows)


def _subjects_row(change_rad: SubjectsChange) -> list[str]:
    change = change_rad.in_degrees()
    symbol = change.matrix[0].upper() if change.quantity in _QUANTITIES else ""
    symbol = {"I": "M ", "V": "B ", "S": "K "}.get(symbol, "")
    what = "ratio" if change.kind == "ratio" else change.unit
    between = _interval(change.between_sd, change.between_low, change.between_high)
    return [
        f"{symbol}{change.quantity} ({what})",
        _interval(change.value, change.low, change.high),
        between,
        str(change.n),
        shown_p(change.p),
        shown_p(change.p_adjusted),
    ]


# Discrimination of two groups, as text for a terminal.


def discrimination_text(result: Discrimination) -> str:
    """Table of the groups, then the measures of their separation.

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


def _group_cells(group: PeopleGroup) -> list[str]:
    values, count = group.values, len(group.people)
    sd = float(values.std(ddof=1))
    mean = with_half_width(float(values.mean()), t_factor(count - 1) * sd / np.sqrt(count))
    return [group.name, str(count), mean, f"{sd:.3g}", f"{values.min():.4g} to {values.max():.4g}"]


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
