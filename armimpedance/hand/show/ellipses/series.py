"""Force ellipses of one place: over levels of co-contraction, over directions of force."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which
from armimpedance.hand.show.ellipses.ellipse import FINE_LINE, draw_models, plot_ellipse
from armimpedance.hand.show.ellipses.parts import (
    default_scale,
    draw_scale_bar,
    legend_above,
    matrix_of,
    square_limits,
    unit_of,
)
from armimpedance.show.plots import (
    LINE_STYLES,
    MODEL_LINE_STYLE,
    OKABE_ITO,
    label_axes,
    new_axes,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_ellipses_over_levels(
    estimates: Sequence[ImpedanceEstimate],
    which: Which = "stiffness",
    labels: Sequence[str] | None = None,
    ax: Axes | None = None,
    reference: ArrayLike | ImpedanceEstimate | None = None,
    reference_label: str = "model",
    show_confidence: bool = False,
) -> Axes:
    """Draw the ellipses of one posture over one another, as in Tsuji (1997), Fig. 8.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        For example of rising co-contraction: solid, dashed, alternate long and short dashes, …
    which : {"stiffness", "viscosity", "inertia"}
        Whose ellipse is drawn.
    labels : sequence of str, optional
        For the legend; without it the conditions.
    ax : Axes, optional
        Where to draw; without it a new figure is made.
    reference : (2, 2) or ImpedanceEstimate, optional
        Drawn dotted.
    reference_label : str
        The name of the reference in the legend.
    show_confidence : bool
        Shade the 95 % band of each outline.

    Returns
    -------
    Axes
        The axes that hold the ellipses.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> levels = ["cocontraction_10", "cocontraction_30"]
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=levels)
    >>> ax = ai.plot_ellipses_over_levels([*ai.estimate(recording)])
    >>> [text.get_text() for text in ax.get_legend().get_texts()]
    ['cocontraction_10', 'cocontraction_30']
    """
    names = [str(e.keys.get("condition", "")) for e in estimates] if labels is None else labels
    colors = [OKABE_ITO[name] for name in ("blue", "vermillion", "green", "purple", "orange")]
    with print_style():
        ax = new_axes() if ax is None else ax
        for i, (estimate, name) in enumerate(zip(estimates, names, strict=True)):
            plot_ellipse(
                estimate,
                ax,
                which=which,
                show_confidence=show_confidence,
                color=colors[i % len(colors)],
                linestyle=LINE_STYLES[i % len(LINE_STYLES)],
                label=name,
            )
        if reference is not None:
            place = np.zeros((1, 2))
            draw_models(ax, [reference], place, 1.0, which, MODEL_LINE_STYLE, reference_label)
        square_limits(ax)
        legend_above(ax, columns=2)
    return ax


def plot_ellipse_rose(
    estimates: Sequence[ImpedanceEstimate],
    which: Which = "stiffness",
    ax: Axes | None = None,
    forces_N: ArrayLike | None = None,
    scale: float | None = None,
    show_confidence: bool = True,
) -> Axes:
    """Arrange the ellipses by the force of the hand, as in Tsuji (1997), Fig. 9.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        The estimates of the hand, with two axes.
    which : {"stiffness", "viscosity", "inertia"}
        Whose ellipse is drawn.
    ax : Axes, optional
        Where to draw; without it a new figure is made.
    forces_N : (n, 2), optional
        Where each stands, for example the target forces; without it the measured mean force.
    scale : float, optional
        N on the axes per unit of the matrix; by default neighbours just do not touch.
    show_confidence : bool
        Shade the 95 % band of each outline.

    Returns
    -------
    Axes
        The axes that hold the ellipses.

    Raises
    ------
    InputError
        When a force is not known.
    """
    matrices = [matrix_of(estimate, which) for estimate in estimates]
    measured = [estimate.force for estimate in estimates]
    if forces_N is None and any(force is None for force in measured):
        raise InputError("an estimate without a force", expected="forces_N for each estimate")
    forces = np.array(measured if forces_N is None else forces_N, dtype=float)
    scale = default_scale(matrices, forces) if scale is None else scale
    with print_style():
        ax = new_axes() if ax is None else ax
        label_axes(ax, "hand force x (N)", "hand force y (N)")
        for estimate, force in zip(estimates, forces, strict=True):
            ax.plot(*np.array([[0, 0], force]).T, color="0.8", linewidth=0.8, zorder=0)
            plot_ellipse(estimate, ax, force, scale, which, show_confidence, linewidth=FINE_LINE)
        draw_scale_bar(ax, matrices, scale, unit_of(estimates[0], which))
    return ax
