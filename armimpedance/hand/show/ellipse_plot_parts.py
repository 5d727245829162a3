"""Parts of the drawings of ellipses: bands, arms, scale bars, legends."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, UNITS
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Which, locus
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import unit_text

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The outline of a force ellipse in polar form, with its confidence band, without matplotlib.


def outline_radius(
    matrix: ArrayLike, covariance: ArrayLike, angle_rad: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Distance of a force ellipse's outline from its centre, and its standard error.

    `matrix` (2, 2): its symmetric part A is positive definite; the outline is the locus of ``A u``,
    |u| = 1.
    `covariance` (4, 4): of the matrix, row by row.
    `angle_rad` (n,): directions from the centre.
    Returns: `radius`, `sd` (n,).
    """
    a = np.asarray(matrix, dtype=float)
    inverse = np.linalg.inv((a + a.T) / 2)
    angle = np.asarray(angle_rad, dtype=float)
    e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    w = e @ inverse
    # |A^-1 e| r = 1, w = A^-1 e (n, 2)
    radius = 1 / np.linalg.norm(w, axis=-1)
    # dr = r^3 (A^-1 w)^T dA w, dA the symmetric part of the matrix' change
    weights = radius[:, None, None] ** 3 * np.einsum("ni,nj->nij", w @ inverse, w)
    weights = ((weights + weights.transpose(0, 2, 1)) / 2).reshape(-1, 4)
    variance = np.einsum("ni,ij,nj->n", weights, np.asarray(covariance, dtype=float), weights)
    return radius, np.sqrt(np.maximum(variance, 0.0))


def confidence_band(
    estimate: ImpedanceEstimate, which: Which, n: int = 361
) -> tuple[FloatArray, FloatArray]:
    """Inner and outer outline of the 95 % band of an estimate's ellipse, (n, 2) each, closed.

    The band is pointwise along each direction from the centre, to first order; the inner outline
    does not cross the centre.

    Parameters
    ----------
    estimate : ImpedanceEstimate
        Estimate of two axes.
    which : {"stiffness", "viscosity", "inertia"}
        The matrix of the ellipse.
    n : int
        Points on each outline.

    Returns
    -------
    inner, outer : (n, 2) ndarray
        From the centre, in the unit of the matrix.
    """
    i = list(MATRICES).index(which)
    # directions of the locus' points: close together where a thin ellipse is most curved
    x, y = locus(getattr(estimate, which), n).T
    angle = np.arctan2(y, x)
    covariance = estimate.covariance[4 * i : 4 * i + 4, 4 * i : 4 * i + 4]
    radius, sd = outline_radius(getattr(estimate, which), covariance, angle)
    half = t_factor(estimate.dof) * sd
    e = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.maximum(radius - half, 0.0)[:, None] * e, (radius + half)[:, None] * e


#: Hands closer together than this (m) are at one place: no person holds still to less.
ONE_PLACE_M = 0.01
#: Factor by which ellipses may extend into their neighbours' cells: most are thin and similar.
OVERLAP = 1.3
#: Opacity of a 95 % band, and the smallest width at which it is visible beside a line (points).
BAND_ALPHA = 0.35
_SEEN_PT = 1.6
#: Approximate widths (in): a legend's line sample with its gaps, a letter, and the space left of a
#: panel.
_SAMPLE_IN, _LETTER_IN, _MARGIN_IN = 0.45, 0.062, 0.5


def default_scale(
    matrices: Sequence[FloatArray], centres: FloatArray, one_place: float = ONE_PLACE_M
) -> float:
    """The scale at which the largest ellipse reaches 0.45 of the usual distance between centres.

    With all centres at one place the distance is a tenth of the axes' unit.

    `matrices` sequence of (2, 2): the matrices whose ellipses are drawn.
    `centres` (n, 2): the centres of the ellipses, in the unit of the axes.
    `one_place`: centres closer than this are one place, whatever the spread of all.
    Returns: the scale, in units of the axes per unit of the matrix.
    """
    largest = _largest(matrices)
    apart = np.linalg.norm(centres[:, None] - centres[None], axis=-1)
    # places closer than a tenth of the whole spread are one place, measured twice
    apart[apart <= max(0.1 * apart.max(), one_place)] = np.inf
    nearest = apart.min(axis=1)
    finite = nearest[np.isfinite(nearest)]
    return 0.45 * float(np.median(finite) if finite.size else 0.1) / largest


def usual_scale(matrices: Sequence[FloatArray], centres: FloatArray) -> float:
    """The scale at which three quarters of the ellipses just reach into their neighbours' cells.

    Those of an outstretched arm would make the others very small.
    """
    ordered = sorted(matrices, key=lambda m: float(np.linalg.eigvalsh(m + m.T)[-1]))
    return OVERLAP * default_scale(ordered[: max(1, 3 * len(ordered) // 4)], centres)


def matrix_of(item: ArrayLike | ImpedanceEstimate, which: Which) -> FloatArray:
    """The (2, 2) matrix to draw; raise InputError if there is none."""
    if which not in MATRICES:
        raise InputError(f"unknown matrix {which!r}", expected=" or ".join(MATRICES))
    matrix = getattr(item, which) if isinstance(item, ImpedanceEstimate) else item
    array = np.asarray(matrix, dtype=float)
    if array.shape != (2, 2):
        raise InputError(f"no ellipse of a matrix of shape {array.shape}", expected="(2, 2)")
    return array


def unit_of(item: ArrayLike | ImpedanceEstimate, which: Which) -> str:
    """Unit of the matrix; a plain matrix is taken as that of the hand."""
    level = item.level if isinstance(item, ImpedanceEstimate) else "hand"
    return unit_text(UNITS[level][MATRICES[which][0]])


def hand_of(estimate: ImpedanceEstimate) -> FloatArray:
    """Hand position (2,) of an estimate of the hand; raise InputError if there is none."""
    if estimate.level != "hand":
        raise InputError(f"an estimate of level {estimate.level}", expected="level hand")
    if estimate.position is None:
        raise InputError("an estimate without a hand position", expected="position_i_m")
    return estimate.position


def is_positive_definite(matrix: FloatArray) -> bool:
    """True if the symmetric part is positive definite and has an ellipse."""
    return bool(np.linalg.eigvalsh((matrix + matrix.T) / 2).min() > 0)


def draw_band(
    ax: Axes,
    estimate: ImpedanceEstimate,
    which: Which,
    centre: FloatArray,
    scale: float,
    color: str,
) -> None:
    """Shade the 95 % band of the outline, if there is an outline."""
    if not is_positive_definite(getattr(estimate, which)):
        return
    from matplotlib.patches import Polygon

    inner, outer = confidence_band(estimate, which)
    corners = centre + scale * np.concatenate([outer, inner[::-1]])
    # `Axes.fill` would search for extremes on each of the 722 sides as if they were curves
    ax.add_artist(Polygon(corners, color=color, alpha=BAND_ALPHA, linewidth=0))
    ax.update_datalim(corners)
    ax.autoscale_view()


def draw_arm(ax: Axes, estimates: Sequence[ImpedanceEstimate]) -> None:
    """Draw the arm of the central hand as sticks, if its posture is known."""
    elbows = [(e, elbow_of(e)) for e in estimates]
    arms = [(e, elbow) for e, elbow in elbows if elbow is not None]
    if not arms:
        return
    hands = np.array([hand_of(e) for e, _ in arms])
    estimate, elbow = arms[int(np.linalg.norm(hands - hands.mean(axis=0), axis=1).argmin())]
    x, y = np.array([estimate.shoulder_m, elbow, hand_of(estimate)]).T
    ax.plot(x, y, "-o", color="0.8", linewidth=2.5, markersize=4, zorder=0)


#: Smallest length of both links of an arm, m; a straight arm does not determine the elbow's place.
_LEAST_LINK_M = 0.1


def elbow_of(estimate: ImpedanceEstimate) -> FloatArray | None:
    """Place of the elbow (2,) from shoulder, hand and joint angles; None if undetermined."""
    angles, shoulder = estimate.joint_angles, estimate.shoulder_m
    if angles is None or shoulder is None or len(angles) != 2 or abs(np.sin(angles[1])) < 0.1:
        return None
    turned = np.cumsum(angles)
    # hand - shoulder = [e(q1) e(q1 + q2)] (l1, l2), (2,) = (2, 2) (2,)
    links = np.linalg.solve(
        np.stack([np.cos(turned), np.sin(turned)]), hand_of(estimate) - shoulder
    )
    if links.min() < _LEAST_LINK_M:
        return None
    return np.asarray(shoulder + links[0] * np.array([np.cos(turned[0]), np.sin(turned[0])]))


def draw_shoulders(ax: Axes, estimates: Sequence[ImpedanceEstimate]) -> list[tuple[float, ...]]:
    """Mark each place of a shoulder once, and return the places."""
    shoulders = [tuple(e.shoulder_m.tolist()) for e in estimates if e.shoulder_m is not None]
    places = list(dict.fromkeys(shoulders))
    for place in places:
        ax.plot(*place, "s", color="black", markersize=5)
    return places


def fill_panel(ax: Axes) -> None:
    """Set one scale for x and y, and limits as wide as the panel allows.

    A column of places would otherwise give a strip without room for its text.
    """
    both_shared = all(
        len(list(group(ax))) > 1
        for group in (
            ax.get_shared_x_axes().get_siblings,
            ax.get_shared_y_axes().get_siblings,
        )
    )
    ax.set_aspect("equal", adjustable="box" if both_shared else "datalim")


def band_label(ax: Axes, estimates: Sequence[ImpedanceEstimate], which: Which, scale: float) -> str:
    """Legend entry of the band; it says so if the band cannot be seen beside its line."""
    low, high = np.array(ax.axis()).reshape(2, 2).T
    width, height = (_panel_in(ax) * 72, ax.figure.get_figure(root=True).get_size_inches()[1] * 50)
    point = float(max((high[0] - low[0]) / width, (high[1] - low[1]) / height))
    widths = [
        float(np.linalg.norm(outer - inner, axis=1).max())
        for inner, outer in (
            confidence_band(e, which, 61)
            for e in estimates
            if is_positive_definite(getattr(e, which))
        )
    ]
    if widths and scale * np.median(widths) < _SEEN_PT * point:
        return "95 % band within the line"
    return "95 % band"


def draw_scale_bar(ax: Axes, matrices: Sequence[FloatArray], scale: float, unit: str) -> None:
    """Draw a bar below the ellipses: a round number near the largest principal value."""
    from mpl_toolkits.axes_grid1.anchored_artists import (  # type: ignore[import-untyped]
        AnchoredSizeBar,
    )

    value = _round_number(_largest(matrices))
    x0, x1, low, high = ax.axis()
    if ax.get_autoscaley_on():
        # the limits stay free, so that the panel can be filled
        ax.update_datalim([(x0, low - 0.1 * (high - low)), (x1, high)])
        ax.autoscale_view()
    else:
        ax.set_ylim(low - 0.13 * (high - low), high)
    ax.add_artist(
        AnchoredSizeBar(
            ax.transData,
            scale * value,
            f"{value:g} {unit}",
            "lower right",
            frameon=False,
            pad=0.4,
            sep=3,
            size_vertical=0,
        )
    )


def _largest(matrices: Sequence[FloatArray]) -> float:
    """Largest principal value of all matrices; 1 if all are zero."""
    if not len(matrices):
        raise InputError("nothing to draw", expected="at least one estimate")
    return float(max(np.abs(np.linalg.eigvalsh((m + m.T) / 2)).max() for m in matrices)) or 1.0


def _round_number(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above the value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1, 2, 5) if step * power <= value * (1 + 1e-9)))


def square_limits(ax: Axes) -> None:
    """Set the same limits for x and y about the origin, so that panels can be compared."""
    reach = float(np.abs([*ax.get_xlim(), *ax.get_ylim()]).max())
    ax.set(xlim=(-reach, reach), ylim=(-reach, reach))


def legend_above(ax: Axes, columns: int = 3, title: str = "") -> None:
    """Draw a legend above the axes with each label once, in fewer columns if names are long.

    It is inside the axes if no layout reserves space above.
    """
    handles, labels = ax.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if not once and not title:
        return
    entry_in = _SAMPLE_IN + _LETTER_IN * max((len(label) for label in once), default=0)
    columns = max(1, min(columns, int(_panel_in(ax) / entry_in)))
    room = ax.figure.get_figure(root=True).get_layout_engine() is not None and not ax.get_title()
    place: dict[str, Any] = (
        {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 0.2, "ncols": columns}
        if room
        else {"loc": "best"}
    )
    ax.legend([*once.values()], [*once], title=title or None, alignment="left", **place)


def _panel_in(ax: Axes) -> float:
    """Approximate width of a panel (in), before the figure is laid out."""
    spec, width_in = ax.get_subplotspec(), ax.figure.get_figure(root=True).get_size_inches()[0]
    return float(width_in) / (spec.get_gridspec().ncols if spec is not None else 1) - _MARGIN_IN


def one_legend(figure: Figure, axes: Sequence[Axes], columns: int = 4) -> None:
    """Replace the panels' legends by one legend above all of them, with each label once.

    Parameters
    ----------
    figure : Figure
    axes : sequence of Axes
    columns : int
    """
    once: dict[str, Artist] = {}
    for ax in axes:
        legend = ax.get_legend()
        if legend is not None:
            legend.remove()
        handles, labels = ax.get_legend_handles_labels()
        once |= dict(zip(labels, handles, strict=True))
    entry_in = _SAMPLE_IN + _LETTER_IN * max((len(label) for label in once), default=0)
    columns = max(1, min(columns, int(figure.get_figwidth() / entry_in)))
    figure.legend(list(once.values()), list(once), loc="outside upper center", ncols=columns)
