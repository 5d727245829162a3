"""Groups compared: their ellipses where the hand was, with bands, and which pairs differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from heapq import nsmallest
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, UNITS
from armimpedance.hand.comparison.discrimination import Discrimination
from armimpedance.hand.comparison.groups import ComparedGroup, Pair
from armimpedance.hand.ellipses import Which
from armimpedance.hand.show.ellipse_plot import plot_ellipse
from armimpedance.hand.show.ellipse_plot_parts import (
    BAND_ALPHA,
    draw_scale_bar,
    draw_shoulders,
    hand_of,
    legend_above,
    matrix_of,
    usual_scale,
)
from armimpedance.hand.show.ellipsoid_plot import plot_ellipsoids
from armimpedance.show.plots import (
    LINE_STYLES,
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    few_ticks,
    label_axes,
    new_axes,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Pairs whose adjusted p is at most this are joined by a line.
LEVEL = 0.05
#: With more groups than this they are told apart by number, not by line.
_MOST_STYLED = 10
#: Axes of a hand in space.
_IN_SPACE = 3
_COLORS = tuple(OKABE_ITO[name] for name in ("blue", "vermillion", "green", "purple", "orange"))
#: With more lines between pairs nobody sees the ellipses: their number is said instead.
_MOST_JOINED = 4
#: Names in a column beside the drawing, its width (points) and that of a name (letters).
_LISTED = 26
_COLUMN_PT = 130
_LONGEST = 22
#: Of longer names one stands in a row of the legend.
_SHORT_NAME = 9
#: Of more names than these, those of the pairs that differ most are drawn.
_MOST_NAMED = 78
_FIRST_NAMED = 26
#: Places closer than this fraction of the spread of all are one place.
_SAME_PLACE = 0.02


def plot_comparison(
    groups: Sequence[ComparedGroup],
    pairs: Sequence[Pair] = (),
    which: Which = "stiffness",
    ax: Axes | None = None,
    scale: float | None = None,
) -> Axes:
    """Draw each group's ellipse at the hand's place, with its 95 % band.

    Up to ten groups are told apart by line and colour, more by a number beside each. The legend
    says how many pairs differ (adjusted p of T2 at most .05); where they are few, grey lines join
    them. Up to ten groups that all stand in one place are drawn over one another, without the
    shoulder; more of them side by side. Of more than 78 groups the 26 of the pairs that differ most
    are drawn, and the legend says so. Groups of one name are of several subjects: drawn over one
    another at their mean place, without bands. In space all groups are ellipsoids about one centre.

    Parameters
    ----------
    groups : sequence of ComparedGroup
        Of the hand, with two axes and a position.
    pairs : sequence of Pair
        The pairs of groups and how they differ; without them no lines are drawn.
    which : {"stiffness", "viscosity", "inertia"}
        Whose ellipse is drawn.
    ax : Axes, optional
        Where to draw; without it a new figure is made.
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
    everybody, groups = groups, _drawn(groups, pairs, which)
    if groups and all(group.estimate.k == _IN_SPACE for group in groups) and ax is None:
        first: Axes = plot_ellipsoids([group.estimate for group in groups], which).axes[0]
        return first
    matrices = [matrix_of(group.estimate, which) for group in groups]
    places = _places(groups)
    one_place = len(np.unique(places, axis=0)) == 1
    if aside := one_place and len({group.name for group in groups}) > _MOST_STYLED:
        places = _side_by_side([group.name for group in groups])
    scale = usual_scale(matrices, places) if scale is None else scale
    shown = _Shown(groups, places, which, scale)
    with print_style():
        ax = _new_axes(shown) if ax is None else ax
        _draw_groups(ax, shown, pairs, len(everybody))
        if not one_place:
            draw_shoulders(ax, [group.estimate for group in groups])
        draw_scale_bar(ax, matrices, scale, UNITS["hand"][MATRICES[which][0]])
        _name_axes(ax, aside)
        _name_groups(ax, shown)
    return ax


def _draw_groups(ax: Axes, shown: _Shown, pairs: Sequence[Pair], of: int) -> None:
    """All groups, and what the legend says of them; `of`: how many there are in all."""
    if shown.once:
        _join(ax, shown, pairs)
    for group, hand in zip(shown.groups, shown.places, strict=True):
        _draw_group(ax, shown, group, hand)
    if shown.once:
        ax.fill([], [], color="0.5", alpha=BAND_ALPHA, lw=0, label="95 % band")
    if len(shown.groups) < of:
        label = f"{len(shown.groups)} of {of} groups: where differences are clearest"
        ax.plot([], [], linestyle="", label=label)


def _name_axes(ax: Axes, aside: bool) -> None:
    if aside:
        ax.set(xticks=[], yticks=[], xlabel="at one place, drawn side by side", ylabel="")
        return
    label_axes(ax, "x (m)", "y (m)")
    ax.xaxis.set_major_locator(few_ticks())
    ax.yaxis.set_major_locator(few_ticks())


def _name_groups(ax: Axes, shown: _Shown) -> None:
    longest = max(map(len, shown.names))
    legend_above(ax, columns=2 if longest <= _SHORT_NAME or not shown.styled else 1)
    if not shown.styled:
        _list_names(ax, shown.names)


def _drawn(
    groups: Sequence[ComparedGroup], pairs: Sequence[Pair], which: Which
) -> Sequence[ComparedGroup]:
    """The groups that are drawn: all, or of many those of the pairs with the least p of T2."""
    names = dict.fromkeys(group.name for group in groups)
    if len(names) <= _MOST_NAMED:
        return groups
    row = list(MATRICES).index(which)

    def chance(pair: Pair) -> tuple[float, float]:
        test = pair.tests[row]
        return (test.p_t2, -test.t2) if np.isfinite(test.p_t2) else (2.0, 0.0)

    # so many pairs hold as many groups at least
    first = nsmallest(_FIRST_NAMED**2 // 2, pairs, key=chance)
    found = dict.fromkeys(name for pair in first for name in (pair.first, pair.second))
    chosen = set(list(found or names)[:_FIRST_NAMED])
    return [group for group in groups if group.name in chosen]


def _new_axes(shown: _Shown) -> Axes:
    """One column of print; two where names are listed beside the drawing."""
    if shown.styled:
        rows = len(shown.names) + 2
        two = max(map(len, shown.names)) <= _SHORT_NAME
        return new_axes(ONE_COLUMN_IN, ONE_COLUMN_IN + 0.17 * (rows / 2 if two else rows))
    return new_axes(TWO_COLUMNS_IN, 4.6)


def _side_by_side(names: Sequence[str]) -> FloatArray:
    """A place for each name in rows and columns, in tenths of a metre, (n, 2)."""
    once = list(dict.fromkeys(names))
    columns = int(np.ceil(np.sqrt(len(once))))
    number = np.array([once.index(name) for name in names])
    return 0.1 * np.column_stack([number % columns, -(number // columns)])


@dataclass(frozen=True)
class _Shown:
    """What a figure shows, and how its groups are told apart.

    `places` (n, 2).
    """

    groups: Sequence[ComparedGroup]
    places: FloatArray
    which: Which
    scale: float

    @property
    def names(self) -> list[str]:
        """Every name once, in order."""
        return list(dict.fromkeys(group.name for group in self.groups))

    @property
    def styled(self) -> bool:
        """Whether lines and colours tell the groups apart, and not numbers."""
        return len(self.names) <= _MOST_STYLED

    @property
    def once(self) -> bool:
        """Whether each name is that of one group."""
        return len(self.names) == len(self.groups)

    def style(self, name: str) -> dict[str, Any]:
        """Colour, line and label of a group."""
        if not self.styled:
            return {"color": _COLORS[0], "linestyle": "-", "linewidth": 0.6, "label": None}
        number = self.names.index(name)
        return {
            "color": _COLORS[number % len(_COLORS)],
            # the second round of colours has other lines than the first
            "linestyle": LINE_STYLES[(number + number // 5) % 5],
            "linewidth": 1.0 if self.once else 0.6,
            "label": name,
        }


def _draw_group(ax: Axes, shown: _Shown, group: ComparedGroup, hand: FloatArray) -> None:
    """A group's ellipse, and its number where numbers tell the groups apart."""
    which, scale = shown.which, shown.scale
    style = shown.style(group.name)
    plot_ellipse(group.estimate, ax, hand, scale, which, show_confidence=shown.once, **style)
    if not shown.styled and (shown.once or group is _last_of(shown.groups, group.name)):
        number = shown.names.index(group.name) + 1
        _number(ax, number, matrix_of(group.estimate, which), hand, scale)


def _places(groups: Sequence[ComparedGroup]) -> FloatArray:
    """Where each ellipse stands, (n, 2).

    A group stands at the mean of its subjects' hands; groups whose places differ by the hand's
    unsteadiness alone share one.
    """
    hands = np.array([hand_of(group.estimate) for group in groups])
    names = np.array([group.name for group in groups])
    places = np.array([hands[names == name].mean(axis=0) for name in names])
    spread = max(float(np.ptp(places, axis=0).max()), 0.1)
    for i in range(len(places)):
        near = np.linalg.norm(places[:i] - places[i], axis=1) < _SAME_PLACE * spread
        if near.any():
            places[i] = places[int(np.argmax(near))]
    return places


def _last_of(groups: Sequence[ComparedGroup], name: str) -> ComparedGroup:
    """The last group of a name, so that a name is written once."""
    return [group for group in groups if group.name == name][-1]


def _join(ax: Axes, shown: _Shown, pairs: Sequence[Pair]) -> None:
    """Join groups that differ, where they stand apart and are few enough to read."""
    where = {group.name: place for group, place in zip(shown.groups, shown.places, strict=True)}
    row = list(MATRICES).index(shown.which)
    names = [(pair.first, pair.second) for pair in pairs if pair.tests[row].p_t2_adjusted <= LEVEL]
    drawn = [(one, two) for one, two in names if one in where and two in where]
    apart = [(one, two) for one, two in drawn if (where[one] != where[two]).any()]
    symbol = MATRICES[shown.which][0]
    label = f"{symbol} differs in {len(names)} of {len(pairs)} pairs"
    joined = apart if len(apart) <= _MOST_JOINED else []
    if pairs and not joined:
        ax.plot([], [], linestyle="", label=label)
    for one, two in joined:
        x, y = np.array([where[one], where[two]]).T
        ax.plot(x, y, color="0.6", linewidth=0.8, linestyle="--", zorder=0, label=label)


def _number(ax: Axes, number: int, matrix: FloatArray, hand: FloatArray, scale: float) -> None:
    """A group's number beyond the upper end of its ellipse's major axis."""
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    axis = vectors[:, 1] * (1 if vectors[1, 1] >= 0 else -1)
    ax.annotate(
        str(number),
        tuple(hand + scale * values[1] * axis),
        (7 * axis[0], 7 * axis[1]),
        textcoords="offset points",
        ha="center",
        va="center",
    )


def _list_names(ax: Axes, names: Sequence[str]) -> None:
    """Numbers and names of the groups, right of the axes."""
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


# Two groups told apart: every person's value with its interval, and the threshold.

_COLORS_OF_PEOPLE = (OKABE_ITO["blue"], OKABE_ITO["vermillion"])
_MARKERS = ("o", "s")
#: Width of the cloud of points of one group, in units of the distance between groups.
_SPREAD = 0.5


def plot_discrimination(
    result: Discrimination, ax: Axes | None = None, *, label: str | None = None
) -> Axes:
    """Draw each person's value (95 % interval where known), the groups' means, the threshold.

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
