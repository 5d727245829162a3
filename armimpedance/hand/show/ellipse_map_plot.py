"""Ellipses of many groups in one picture: at the hand's places, concentric or side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which, locus
from armimpedance.hand.show.ellipse_plot import plot_ellipse, plot_ellipses_over_levels
from armimpedance.hand.show.ellipse_plot_parts import (
    ONE_PLACE_M,
    band_label,
    draw_arm,
    draw_scale_bar,
    draw_shoulders,
    fill_panel,
    hand_of,
    is_positive_definite,
    legend_above,
    matrix_of,
    unit_of,
    usual_scale,
)
from armimpedance.hand.show.estimates import GivenEstimates, estimates_of
from armimpedance.hand.show.quantities import condition_of
from armimpedance.show.plots import (
    MOST_LOOKS,
    OKABE_ITO,
    ONE_COLUMN_IN,
    label_axes,
    look,
    new_axes,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Most names, and most letters of a name, for names beside their ellipses; otherwise there is a
#: legend.
_MOST_BESIDE: Final = 6
_LONGEST_BESIDE: Final = 14
#: Height of a picture with a list of names beside it (inches).
_LISTED_HEIGHT_IN: Final = 4.6
#: Places closer than this fraction of the spread of all are one place.
_SAME_PLACE: Final = 0.02


def _check_one_for_each(count: int, **named: Sequence[Any] | None) -> None:
    for what, values in named.items():
        if values is not None and len(values) != count:
            raise InputError(f"{len(values)} {what} for {count} estimates", expected="one for each")


def _at_places(estimates: Sequence[ImpedanceEstimate], *, in_metres: bool) -> bool:
    """True if ellipses are drawn at the hands' places: all are known, and distinct or requested."""
    places = [e.position for e in estimates if e.level == "hand" and e.position is not None]
    if len(places) < len(estimates):
        return False
    return in_metres or float(np.ptp(np.array(places), axis=0).max()) > ONE_PLACE_M


def plot_ellipses(
    estimates: GivenEstimates,
    *,
    which: Which = "stiffness",
    ax: Axes | None = None,
    labels: Sequence[str] | None = None,
    colors: Sequence[str] | None = None,
    scale: float | None = None,
    show_confidence: bool = True,
    reference: Sequence[ArrayLike | ImpedanceEstimate] | None = None,
    reference_label: str = "model",
) -> Axes:
    """Draw the ellipses of estimates with their 95 % bands.

    Ellipses of hands at different places are drawn at these places, as in Tsuji (1997), Fig. 7. Up
    to ten groups differ in colour and line, in the order of the results; more of them look alike.
    Those at one place, and those of joints, are drawn about one centre in their own units; more
    than ten of them side by side, numbered in their order.

    Parameters
    ----------
    estimates : Estimates, sequence of ImpedanceEstimate, one of them, or path
        Of two axes each; a path is that of a RESULTS.csv.
    which : {"stiffness", "viscosity", "inertia"}
        The matrix that is drawn.
    ax : Axes, optional
        Default: those of a new figure.
    labels : sequence of str, optional
        Names; default: the groups' own.
    colors : sequence of str, optional
        One for each estimate, as Matplotlib names them; default: a cycle that colour-blind readers
        can distinguish.
    scale : float, optional
        Metres on paper per unit of the matrix, the same for all; default: most neighbours just do
        not touch. With a stated scale, ellipses at one place are in metres, too.
    show_confidence : bool
        Shade the 95 % band of each outline.
    reference : sequence of (2, 2) or ImpedanceEstimate, optional
        One for each estimate, drawn wide and grey below it, for example a model's.
    reference_label : str
        The name of the reference in the legend.

    Returns
    -------
    Axes
        Axes with the drawing.

    Raises
    ------
    InputError
        The file cannot be read, nothing to draw, not as many labels or colours as estimates, an
        estimate that does not have two axes, or places that are known for some only.
    TypeError
        Another type of `estimates`.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> ax = ai.plot_ellipses(ai.estimate(recording))
    >>> ax.get_xlabel()
    'K along x (N/m)'
    """
    rows = list(estimates_of(estimates))
    if not rows:
        raise InputError("nothing to draw", expected="at least one estimate")
    names = [condition_of(e) for e in rows] if labels is None else [str(name) for name in labels]
    _check_one_for_each(len(rows), labels=names, colors=colors, reference=reference)
    apart = _at_places(rows, in_metres=scale is not None or reference is not None)
    if not apart and len(rows) <= MOST_LOOKS and reference is None:
        return plot_ellipses_over_levels(
            rows, which, names, ax, show_confidence=show_confidence, colors=colors
        )
    shown = EllipseMap.of(rows, names, which, scale, colors, aside=not apart)
    with print_style():
        ax = shown.new_axes() if ax is None else ax
        if reference is not None:
            draw_references(ax, shown, reference, reference_label)
        shown.draw(ax, show_confidence)
        shown.finish(ax, show_confidence)
    return ax


def draw_references(
    ax: Axes,
    shown: EllipseMap,
    reference: Sequence[ArrayLike | ImpedanceEstimate],
    label: str,
) -> None:
    """Draw references wide and pale below the estimates, so that both are visible."""
    for item, place in zip(reference, shown.places, strict=True):
        matrix = matrix_of(item, shown.which)
        place_scale = (place, shown.scale, shown.which)
        plot_ellipse(matrix, ax, *place_scale, color="0.75", linewidth=2.4, label=label)


@dataclass(frozen=True)
class EllipseMap:
    """Ellipses, their places in metres, and the looks of their groups.

    Several estimates may have the same name, such as those of several subjects. `places` (n, 2).
    `aside`: True if all were at one place and are drawn side by side.
    """

    estimates: Sequence[ImpedanceEstimate]
    names: Sequence[str]
    places: FloatArray
    which: Which
    scale: float
    colors: Sequence[str] | None = None
    aside: bool = False

    @classmethod
    def of(
        cls,
        estimates: Sequence[ImpedanceEstimate],
        names: Sequence[str],
        which: Which,
        scale: float | None = None,
        colors: Sequence[str] | None = None,
        *,
        aside: bool = False,
        together: bool = False,
    ) -> EllipseMap:
        """Build a map of these estimates; many of one place are drawn side by side.

        `together`: True to draw estimates of one name, as of several subjects, at one place.
        """
        matrices = [matrix_of(estimate, which) for estimate in estimates]
        if not aside:
            hands = np.array([hand_of(estimate) for estimate in estimates])
            places = _places(hands, names if together else range(len(hands)))
            one_place = len(np.unique(places, axis=0)) == 1
            aside = one_place and len(set(names)) > MOST_LOOKS
        if aside:
            places = _side_by_side(names)
        scale = usual_scale(matrices, places) if scale is None else scale
        return cls(estimates, names, places, which, scale, colors, aside)

    @property
    def once(self) -> list[str]:
        """All names without repetition, in order."""
        return list(dict.fromkeys(self.names))

    @property
    def styled(self) -> bool:
        """True if the groups differ by colours and lines."""
        return len(self.once) <= MOST_LOOKS

    @property
    def single(self) -> bool:
        """True if each name belongs to one estimate."""
        return len(self.once) == len(self.names)

    @property
    def one_place(self) -> bool:
        """True if all are drawn about one centre."""
        return len(np.unique(self.places, axis=0)) == 1

    @property
    def _beside(self) -> bool:
        """True if the names are few, short and far enough apart to be written at the ellipses."""
        few = self.single and 1 < len(self.names) <= _MOST_BESIDE
        short = max(map(len, self.names)) <= _LONGEST_BESIDE
        return few and short and len(np.unique(self.places, axis=0)) == len(self.names)

    def look_of(self, number: int) -> dict[str, Any]:
        """Colour, line and label of an estimate."""
        name = self.names[number]
        color = None if self.colors is None else self.colors[number]
        if not self.styled:
            usual = OKABE_ITO["blue"] if color is None else color
            return {"color": usual, "linestyle": "-", "linewidth": 0.6, "label": None}
        width = 1.0 if self.single and len(self.names) < MOST_LOOKS else 0.6
        label = None if self._beside else name
        return {**look(self.once.index(name), color), "linewidth": width, "label": label}

    def new_axes(self, beside_in: float = 0.0) -> Axes:
        """Axes of a new figure of one column of print, with a height that fits the places.

        `beside_in`: width reserved on the right for a list of names, inches.
        """
        drawn = self._outlines()
        if not self.one_place and not self.aside:
            drawn += [e.shoulder_m[None] for e in self.estimates if e.shoulder_m is not None]
        across, up = np.ptp(np.concatenate(drawn), axis=0)
        shape = float(np.clip(up / max(across, 1e-9), 0.65, 1.2))
        rows = 2 + (0 if self._beside or not self.styled else len(self.once) / 2)
        height = max(ONE_COLUMN_IN * shape + 0.15 * rows, _LISTED_HEIGHT_IN if beside_in else 0.0)
        return new_axes(ONE_COLUMN_IN + beside_in, height)

    def _outlines(self) -> list[FloatArray]:
        """Outline of each ellipse on paper; a point if a matrix has none."""
        matrices = [matrix_of(estimate, self.which) for estimate in self.estimates]
        return [
            place + self.scale * locus(m) if is_positive_definite(m) else place[None]
            for m, place in zip(matrices, self.places, strict=True)
        ]

    def draw(self, ax: Axes, show_confidence: bool) -> None:
        """Draw all ellipses."""
        drawn = zip(self.estimates, self.places, strict=True)
        for number, (estimate, place) in enumerate(drawn):
            style = self.look_of(number)
            plot_ellipse(estimate, ax, place, self.scale, self.which, show_confidence, **style)

    def finish(
        self, ax: Axes, show_confidence: bool, *, numbers: bool | None = None, title: str = ""
    ) -> None:
        """Draw the surroundings: arm, shoulder, scale bar, names or numbers, legend.

        `numbers`: True to write a number beside each of many; default: if they are side by side.
        `title`: a line above the legend.
        """
        matrices = [matrix_of(estimate, self.which) for estimate in self.estimates]
        if not self.one_place and not self.aside:
            draw_arm(ax, self.estimates)
        from armimpedance.show.plots import NamesBeside, RoomyLocator

        label_axes(ax, "x (m)", "y (m)")
        if self.aside:
            ax.set(xticks=[], yticks=[], ylabel="")
            ax.set_xlabel("at one place, drawn side by side")
        else:
            ax.xaxis.set_major_locator(RoomyLocator())
            ax.yaxis.set_major_locator(RoomyLocator())
        words, outlines = self._words(self.aside if numbers is None else numbers)
        if not self.one_place and not self.aside:
            marks = draw_shoulders(ax, self.estimates)
            words += ["shoulder"] * len(marks)
            outlines += [np.array(mark)[None] for mark in marks]
        if show_confidence:
            label = band_label(ax, self.estimates, self.which, self.scale)
            ax.fill([], [], color="0.5", alpha=0.35, lw=0, label=label)
        draw_scale_bar(ax, matrices, self.scale, unit_of(self.estimates[0], self.which))
        fill_panel(ax)
        if words:
            ax.add_artist(NamesBeside(words, outlines))
        legend_above(ax, columns=3, title=title)

    def _words(self, numbers: bool) -> tuple[list[str], list[FloatArray]]:
        """Names, or numbers of many, with the outlines that they are written beside."""
        outlines = self._outlines()
        if self._beside:
            return list(self.names), outlines
        if self.styled or not numbers:
            return [], []
        # a name of several estimates is written once, at the last of them
        last = {name: number for number, name in enumerate(self.names)}
        words = [str(number) for number in range(1, len(last) + 1)]
        return words, [outlines[last[name]] for name in self.once]


def _places(hands: FloatArray, names: Sequence[object]) -> FloatArray:
    """Place of each ellipse, (n, 2).

    Estimates of one name are drawn at their mean place. Places that differ only by the hand's
    unsteadiness are merged.
    """
    labels = np.array(names)
    places = np.array([hands[labels == name].mean(axis=0) for name in labels])
    spread = max(float(np.ptp(places, axis=0).max()), 0.1)
    for i in range(len(places)):
        near = np.linalg.norm(places[:i] - places[i], axis=1) < _SAME_PLACE * spread
        if near.any():
            places[i] = places[int(np.argmax(near))]
    return places


def _side_by_side(names: Sequence[str]) -> FloatArray:
    """Place of each name in rows and columns, in tenths of a metre, (n, 2)."""
    once = list(dict.fromkeys(names))
    columns = int(np.ceil(np.sqrt(len(once))))
    number = np.array([once.index(name) for name in names])
    return 0.1 * np.column_stack([number % columns, -(number // columns)])
