"""Force ellipses: one, those of one posture, and a rose of them over the hand's force.

An ellipse is the locus of the force in response to a unit of displacement (1 m), velocity (1 m/s)
or acceleration (1 m/s^2) in all directions, Tsuji (1997), section 4.2: N per m is N/m and so on. A
matrix that is not positive definite has no ellipse; it is shown as a cross.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which, locus
from armimpedance.hand.show.ellipse_plot_parts import (
    default_scale,
    draw_band,
    draw_scale_bar,
    is_positive_definite,
    legend_above,
    matrix_of,
    square_limits,
    unit_of,
)
from armimpedance.show.plots import (
    MODEL_LINE_STYLE,
    OKABE_ITO,
    label_axes,
    look,
    new_axes,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Line width for small ellipses: a line of the usual width would hide the band of its outline.
FINE_LINE = 0.6
_NOT_DEFINITE = "not positive definite"


def plot_ellipse(
    matrix_or_estimate: ArrayLike | ImpedanceEstimate,
    ax: Axes | None = None,
    centre: ArrayLike = (0.0, 0.0),
    scale: float = 1.0,
    which: Which = "stiffness",
    show_confidence: bool = False,
    color: str = OKABE_ITO["blue"],
    linestyle: Any = "-",
    linewidth: float = 1.2,
    label: str | None = None,
) -> Axes:
    """Draw the force ellipse of a (2, 2) matrix or of an estimate.

    Parameters
    ----------
    matrix_or_estimate : (2, 2) or ImpedanceEstimate
        The matrix, or the estimate that holds it.
    ax : Axes, optional
        Default: those of a new figure.
    centre : (2,)
        Its centre, in the axes' units.
    scale : float
        Axes' units per unit of the matrix; 1 draws the ellipse in its own units.
    which : {"stiffness", "viscosity", "inertia"}
        Matrix of an estimate that is drawn.
    show_confidence : bool
        Shade the 95 % band of the outline (estimates only).
    color : str
        The colour of the outline.
    linestyle : str or tuple
        The line style of the outline, as Matplotlib names it.
    linewidth : float
        The width of the outline, points.
    label : str, optional
        The name in the legend.

    Returns
    -------
    Axes
        The axes that hold the ellipse.

    Raises
    ------
    InputError
        When there are not two axes, or `which` is not one of the three.

    Examples
    --------
    >>> import armimpedance as ai
    >>> ax = ai.plot_ellipse([[400.0, 50.0], [50.0, 200.0]])
    >>> ax.get_xlabel()
    'K along x (N/m)'
    """
    matrix = matrix_of(matrix_or_estimate, which)
    with print_style():
        ax = new_axes() if ax is None else ax
        c = np.asarray(centre, dtype=float)
        if show_confidence and isinstance(matrix_or_estimate, ImpedanceEstimate):
            draw_band(ax, matrix_or_estimate, which, c, scale, color)
        if is_positive_definite(matrix):
            x, y = (c + scale * locus(matrix)).T
            ax.plot(x, y, color=color, linestyle=linestyle, linewidth=linewidth, label=label)
        else:
            ax.plot(*c, "x", color=color, markersize=5, label=_NOT_DEFINITE)
        ax.set_aspect("equal")
        if scale == 1.0:
            symbol, unit = MATRICES[which][0], unit_of(matrix_or_estimate, which)
            label_axes(ax, f"{symbol} along x ({unit})", f"{symbol} along y ({unit})")
        else:
            label_axes(ax, "x (m)", "y (m)")
    return ax


def draw_models(
    ax: Axes,
    reference: Sequence[ArrayLike | ImpedanceEstimate],
    centres: FloatArray,
    scale: float,
    which: Which,
    linestyle: Any,
    label: str,
) -> None:
    """Draw matrices of a model, black and dashed or dotted, each about its centre."""
    for item, centre in zip(reference, centres, strict=True):
        plot_ellipse(
            matrix_of(item, which),
            ax,
            centre,
            scale,
            which,
            color=OKABE_ITO["black"],
            linestyle=linestyle,
            label=label,
        )


# Force ellipses of one place: over levels of co-contraction, over directions of force.


def plot_ellipses_over_levels(
    estimates: Sequence[ImpedanceEstimate],
    which: Which = "stiffness",
    labels: Sequence[str] | None = None,
    ax: Axes | None = None,
    reference: ArrayLike | ImpedanceEstimate | None = None,
    reference_label: str = "model",
    show_confidence: bool = False,
    colors: Sequence[str] | None = None,
) -> Axes:
    """Draw the ellipses of one posture on top of each other, as in Tsuji (1997), Fig. 8.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        For example of rising co-contraction: solid, dashed, alternate long and short dashes, …
    which : {"stiffness", "viscosity", "inertia"}
        Matrix whose ellipse is drawn.
    labels : sequence of str, optional
        Names in the legend; default: the conditions.
    ax : Axes, optional
        Default: those of a new figure.
    reference : (2, 2) or ImpedanceEstimate, optional
        Drawn dotted.
    reference_label : str
        The name of the reference in the legend.
    show_confidence : bool
        Shade the 95 % band of each outline.
    colors : sequence of str, optional
        One for each estimate; default: a cycle that colour-blind readers can distinguish.

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
    with print_style():
        ax = new_axes() if ax is None else ax
        for i, (estimate, name) in enumerate(zip(estimates, names, strict=True)):
            style = look(i, None if colors is None else colors[i])
            plot_ellipse(
                estimate, ax, which=which, show_confidence=show_confidence, label=name, **style
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
        Matrix whose ellipse is drawn.
    ax : Axes, optional
        Default: those of a new figure.
    forces_N : (n, 2), optional
        Centre of each ellipse, for example the target force; default: the measured mean force.
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
