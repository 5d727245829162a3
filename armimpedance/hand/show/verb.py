"""Drawings of results in one call, for notebooks."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which
from armimpedance.hand.show.ellipse_plot import (
    plot_ellipses_in_workspace,
    plot_ellipses_over_levels,
)
from armimpedance.hand.show.quantities import condition_of
from armimpedance.hand.show.results_csv import read_results

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Hands closer together than this stand at one place: their ellipses are drawn about one centre.
ONE_PLACE_M = 0.01


def plot_ellipses(
    estimates: Sequence[ImpedanceEstimate] | str | os.PathLike[str],
    *,
    which: Which = "stiffness",
    ax: Axes | None = None,
) -> Axes:
    """Draw the ellipses of estimates with their 95 % bands.

    Ellipses of hands at different places stand where the hands were, as in Tsuji (1997), Fig. 7.
    Those at one place, and those of joints, are drawn about one centre in their own units.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate, or path
        Of two axes each; a path is that of a RESULTS.csv.
    which : {"stiffness", "viscosity", "inertia"}
        The matrix that is drawn.
    ax : Axes, optional
        Where to draw; without it a new figure is made.

    Returns
    -------
    Axes
        With the drawing.

    Raises
    ------
    InputError
        The file cannot be read, or an estimate does not have two axes.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> ax = ai.plot_ellipses(ai.estimate(recording))
    >>> ax.get_xlabel()
    'K along x (N/m)'
    """
    given = read_results(estimates) if isinstance(estimates, str | os.PathLike) else list(estimates)
    hands = [e.position for e in given if e.level == "hand" and e.position is not None]
    if len(hands) == len(given) and np.ptp(hands, axis=0).max() > ONE_PLACE_M:
        return plot_ellipses_in_workspace(given, which, ax)
    labels = [condition_of(estimate) for estimate in given]
    return plot_ellipses_over_levels(given, which, labels, ax, show_confidence=True)
