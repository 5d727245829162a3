"""Plots of joint matrices with and without the term of the hand's force, and of muscles' ranges."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from armimpedance.core.conventions import UNITS, group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.levels.muscle_map import MuscleEstimate
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    Series,
    draw_elements,
    draw_ellipses,
    few_ticks,
    name_rows,
    new_figure,
    panel_letters,
    print_style,
    row_axes,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: More conditions than this cannot be distinguished beside one muscle.
_MOST_RANGES: Final = 12


def plot_force_term(
    with_term: Sequence[ImpedanceEstimate], without_term: Sequence[ImpedanceEstimate]
) -> Figure:
    """Draw K of the joints, row by row, with the term of the hand's force and without it.

    Parameters
    ----------
    with_term, without_term : sequence of ImpedanceEstimate
        The same rows at the joints, mapped with and without the term.

    Returns
    -------
    Figure
        The ellipses (for two joints), then a panel for each element; for more joints those on and
        above the diagonal.

    Raises
    ------
    InputError
        Nothing to draw, or the two are not of the same rows.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.hand.levels.show import plot_force_term
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> hand = ai.estimate(recording)
    >>> both = [ai.to_joint(hand, recording=recording, force_term=term) for term in (True, False)]
    >>> [ax.get_xlabel() for ax in plot_force_term(*both).axes][:2]
    ['K', 'K₁₁ (N m/rad)']
    """
    if not with_term or len(with_term) != len(without_term):
        counts = f"{len(with_term)} rows with the term and {len(without_term)} without"
        raise InputError(counts, expected="as many, at least one")
    k = with_term[0].k
    series = [
        _series("with the force term", with_term, OKABE_ITO["blue"], filled=True),
        _series("without it", without_term, OKABE_ITO["vermillion"], filled=False),
    ]
    with print_style():
        bands = 2 if k == 3 else 1
        columns = (5 if k == 2 else k * (k + 1) // 2) // bands
        figure, grid = row_axes(len(with_term), columns, bands, narrow=int(k == 2))
        axes = panels = [ax for band in grid for ax in band]
        if k == 2:
            axes = panels[1:]
            draw_ellipses(panels[0], series, "K")
        part: Literal["all", "upper"] = "all" if k == 2 else "upper"
        draw_elements(axes, series, "K", UNITS[with_term[0].level]["K"], part=part)
        name_rows(panels[0], [group_name(e.keys) for e in with_term], bands)
        panel_letters(panels)
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def _series(label: str, rows: Sequence[ImpedanceEstimate], color: str, *, filled: bool) -> Series:
    low, high = np.array([e.interval()[:, 2] for e in rows]).transpose(1, 0, 2, 3)
    return Series(label, np.array([e.stiffness for e in rows]), (high - low) / 2, color, filled)


def plot_muscle_ranges(estimates: Sequence[MuscleEstimate]) -> Figure:
    """Draw the range of stiffness of each muscle: all K_m >= 0 that give the joints' K.

    Dark: the range for the measured joint matrix; light: with its 95 % interval.

    `estimates`: of one arm; of many the first twelve are drawn.
    Returns: a panel for each muscle, a bar for each row.
    Raises InputError: nothing to draw.
    """
    if not estimates:
        raise InputError("nothing to draw", expected="at least one row")
    shown, muscles = estimates[:_MOST_RANGES], estimates[0].muscles
    rows = -(-len(muscles) // 3)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, min(rows * (0.6 + 0.2 * len(shown)) + 0.2, 8.5))
        grid = figure.subplots(rows, 3, sharey=True, squeeze=False)
        for number, (ax, muscle) in enumerate(zip(grid.flat, muscles, strict=False)):
            at = np.arange(len(shown))
            ranges = [e.stiffness.single[number] for e in shown]
            wide = 1e-3 * np.array([(r.outer_low, r.outer_high) for r in ranges]).T
            own = 1e-3 * np.array([(r.low, r.high) for r in ranges]).T
            color = OKABE_ITO["blue"]
            ax.hlines(at, *wide, color=color, alpha=0.35, linewidth=4, label="with its 95 %")
            ax.hlines(at, *own, color=color, linewidth=1.6, label="as measured")
            ax.set_title(muscle.replace("_", " "), parse_math=False)
            ax.set_xlim(left=0.0)
            ax.xaxis.set_major_locator(few_ticks(2))
        for ax in grid.flat[len(muscles) :]:
            ax.set_visible(False)
        for ax in grid[-1]:
            ax.set_xlabel("K (kN/m)")
        name_rows(grid[0, 0], [group_name(e.keys) for e in shown])
        panel_letters(list(grid.flat[: len(muscles)]))
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure
