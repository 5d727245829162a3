"""Plot of compared groups: their ellipses at the hand's places, with bands; pairs that differ."""

from __future__ import annotations

from collections.abc import Sequence
from heapq import nsmallest
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.conventions import MATRICES
from armimpedance.hand.comparison.discrimination import Discrimination
from armimpedance.hand.comparison.groups import ComparedGroup, Pair
from armimpedance.hand.ellipses import Which
from armimpedance.hand.show.ellipse_map_plot import EllipseMap
from armimpedance.hand.show.ellipsoid_plot import plot_ellipsoids
from armimpedance.show.plots import (
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    new_axes,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Pairs with an adjusted p of at most this are joined by a line.
LEVEL = 0.05
#: Axes of a hand in space.
_IN_SPACE = 3
#: With more lines between pairs the ellipses could not be seen: the number of pairs is written
#: instead.
_MOST_JOINED = 4
#: Number of names in a column beside the drawing, its width (points) and length of a name
#: (letters).
_LISTED = 26
_COLUMN_PT = 130
_LONGEST = 22
#: Width of two such columns: the difference between two columns of print and one (inches).
_LIST_IN = TWO_COLUMNS_IN - ONE_COLUMN_IN
#: With more names than this, only the groups of the pairs that differ most are drawn.
_MOST_NAMED = 78
_FIRST_NAMED = 26


def plot_comparison(
    groups: Sequence[ComparedGroup],
    pairs: Sequence[Pair] = (),
    which: Which = "stiffness",
    ax: Axes | None = None,
    scale: float | None = None,
) -> Axes:
    """Draw each group's ellipse at the hand's place, with its 95 % band.

    Up to ten groups differ by line and colour, more by a number beside each. The legend gives the
    number of pairs that differ (adjusted p of T2 at most .05); if they are few, grey lines join
    them. Up to ten groups at one place are drawn on top of each other, without the shoulder; more
    of them side by side. Of more than 78 groups, the 26 of the pairs that differ most are drawn,
    and the legend says so. Groups of the same name are of several subjects: they are drawn on top
    of each other at their mean place, without bands. In space all groups are ellipsoids about one
    centre.

    Parameters
    ----------
    groups : sequence of ComparedGroup
        Of the hand, with two axes and a position.
    pairs : sequence of Pair
        The compared pairs of groups; without them no lines are drawn.
    which : {"stiffness", "viscosity", "inertia"}
        Matrix whose ellipse is drawn.
    ax : Axes, optional
        Default: those of a new figure.
    scale : float, optional
        Metres on paper per unit of the matrix; by default neighbours just do not touch.

    Returns
    -------
    Axes
        The axes that hold the ellipses, in metres.

    Raises
    ------
    InputError
        For an estimate of another level, without a position, or not of two axes.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> levels = ["cocontraction_10", "cocontraction_30"]
    >>> recording, _ = simulate("cocontraction", seed=1, sets=2, conditions=levels)
    >>> compared = ai.compare(recording, permutations=99)
    >>> ax = ai.plot_comparison(compared.groups, compared.pairs)
    >>> ax.get_xlabel()
    'x (m)'
    """
    all_groups, groups = groups, _drawn(groups, pairs, which)
    if groups and all(group.estimate.k == _IN_SPACE for group in groups) and ax is None:
        first: Axes = plot_ellipsoids([group.estimate for group in groups], which).axes[0]
        return first
    shown = EllipseMap.of(
        *([group.estimate for group in groups], [group.name for group in groups], which, scale),
        together=True,
    )
    with print_style():
        ax = shown.new_axes(0 if shown.styled else _LIST_IN) if ax is None else ax
        title = _join(ax, shown, pairs) if shown.single else ""
        shown.draw(ax, show_confidence=shown.single)
        if len(groups) < len(all_groups):
            part = f"{len(groups)} of {len(all_groups)} groups: where differences are clearest"
            title = "\n".join(filter(None, [title, part]))
        shown.finish(ax, show_confidence=shown.single, numbers=True, title=title)
        if not shown.styled:
            _list_names(ax, shown.once)
    return ax


def _drawn(
    groups: Sequence[ComparedGroup], pairs: Sequence[Pair], which: Which
) -> Sequence[ComparedGroup]:
    """Groups to draw: all, or of many those of the pairs with the smallest p of T2."""
    names = dict.fromkeys(group.name for group in groups)
    if len(names) <= _MOST_NAMED:
        return groups
    row = list(MATRICES).index(which)

    def chance(pair: Pair) -> tuple[float, float]:
        test = pair.tests[row]
        return (test.p_t2, -test.t2) if np.isfinite(test.p_t2) else (2.0, 0.0)

    # so many pairs contain at least as many groups
    first = nsmallest(_FIRST_NAMED**2 // 2, pairs, key=chance)
    names_of_pairs = dict.fromkeys(name for pair in first for name in (pair.first, pair.second))
    chosen = set(list(names_of_pairs or names)[:_FIRST_NAMED])
    return [group for group in groups if group.name in chosen]


def _join(ax: Axes, shown: EllipseMap, pairs: Sequence[Pair]) -> str:
    """Join groups that differ, if they are few and at different places; text with their number."""
    where = dict(zip(shown.names, shown.places, strict=True))
    row = list(MATRICES).index(shown.which)
    names = [(pair.first, pair.second) for pair in pairs if pair.tests[row].p_t2_adjusted <= LEVEL]
    drawn = [(first, second) for first, second in names if first in where and second in where]
    apart = [(first, second) for first, second in drawn if (where[first] != where[second]).any()]
    symbol = MATRICES[shown.which][0]
    joined = len(names) < len(pairs) and len(apart) <= _MOST_JOINED
    for first, second in apart if joined else []:
        x, y = np.array([where[first], where[second]]).T
        ax.plot(x, y, color="0.6", linewidth=0.8, linestyle="--", zorder=0, label="differ")
    return f"{symbol} differs in {len(names)} of {len(pairs)} pairs" if pairs else ""


def _list_names(ax: Axes, names: Sequence[str]) -> None:
    """Write numbers and names of the groups, right of the axes."""
    lines = [f"{number}  {_short(name)}" for number, name in enumerate(names, start=1)]
    for start in range(0, len(lines), _LISTED):
        ax.annotate(
            "\n".join(lines[start : start + _LISTED]),
            (1.02, 1.0),
            (_COLUMN_PT * (start // _LISTED), 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="top",
            linespacing=1.15,
        )


def _short(name: str) -> str:
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 1]}…"


# Two discriminated groups: every person's value with its interval, and the threshold.

_COLORS_OF_PEOPLE = (OKABE_ITO["blue"], OKABE_ITO["vermillion"])
_MARKERS = ("o", "s")
#: Width of the cloud of points of one group, in units of the distance between groups.
_SPREAD = 0.5


def plot_discrimination(
    result: Discrimination, ax: Axes | None = None, *, label: str | None = None
) -> Axes:
    """Draw each person's value (with 95 % interval if known), the groups' means, the threshold.

    Parameters
    ----------
    result : Discrimination
    ax : Axes, optional
        Where to draw; without it a new figure is made.
    label : str, optional
        The axis label; by default the quantity.

    Returns
    -------
    Axes
    """
    with print_style():
        ax = new_axes(ONE_COLUMN_IN, 0.85 * ONE_COLUMN_IN) if ax is None else ax
        for at, group in enumerate((result.first, result.second)):
            order = np.argsort(group.values)
            x = at + _SPREAD * (np.linspace(0, 1, len(order)) - 0.5)
            error = None if group.sd is None else 1.96 * group.sd[order]
            ax.errorbar(
                x,
                group.values[order],
                error,
                fmt=_MARKERS[at],
                ms=3.5,
                lw=0.8,
                color=_COLORS_OF_PEOPLE[at],
                label=group.name,
            )
            mean = float(group.values.mean())
            ax.plot(
                [at - 0.36, at + 0.36], [mean, mean], color=_COLORS_OF_PEOPLE[at], lw=1.6, alpha=0.6
            )
        ax.axhline(result.threshold, color="0.4", lw=0.8, ls=(0, (4, 2)))
        ax.text(0.5, result.threshold, "threshold", ha="center", va="bottom", fontsize=7)
        ax.set_xlim(-0.5, 1.5)
        names = [f"{g.name}\n(n = {len(g.people)})" for g in (result.first, result.second)]
        ax.set_xticks([0, 1], names)
        ax.set_ylabel(label or result.quantity)
        ax.set_title(
            f"area under ROC {result.auc:.2f} ({result.auc_ci95[0]:.2f} to "
            f"{result.auc_ci95[1]:.2f})\n{result.correct} of {result.people} in the right group, "
            "each left out",
            fontsize=8,
        )
    return ax
