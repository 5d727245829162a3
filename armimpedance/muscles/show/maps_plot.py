"""A quantity over a plane (two joint angles, two activations, the workspace), as a map.

What a model says outside of what was measured is faded and hatched. Crosses stand where the
quantity does not exist.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Ellipse, ellipse_of, half_turn
from armimpedance.muscles.models import HandPrediction, matrix
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import (
    COLORS,
    MeasuredPoints,
    Surface,
    few_ticks,
    level_norm,
    new_axes,
    print_style,
    surface_levels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.contour import QuadContourSet

#: How much white covers what is extrapolated.
_FADED: Final = 0.6


def plot_map(
    surface: Surface,
    points: MeasuredPoints | None = None,
    ax: Axes | None = None,
    levels: FloatArray | None = None,
    *,
    bar: bool = True,
) -> Axes:
    """Draw filled contours, measured points in the same colours, what is extrapolated hatched.

    Parameters
    ----------
    surface : Surface
    points : MeasuredPoints, optional
    ax : Axes, optional
    levels : (L,), optional
        Borders of the colours; without it round numbers over what was measured.
    bar : bool
        Draw the bar of colours.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        Nothing rests on measurements.
    """
    levels = surface_levels(surface, points) if levels is None else np.asarray(levels)
    with print_style():
        ax = new_axes() if ax is None else ax
        least = np.nanmin(surface.values)
        filled = ax.contourf(
            *(surface.x, surface.y, np.ma.masked_invalid(surface.values), levels),
            cmap=COLORS,
            norm=level_norm(levels),
            extend="both" if least < levels[0] else "max",
        )
        _mark_extrapolated(ax, surface)
        _mark_missing(ax, surface)
        if points is not None:
            _draw_points(ax, points, filled)
        ax.set(xlabel=surface.x_label, ylabel=surface.y_label)
        low, high = surface.border.min(axis=0), surface.border.max(axis=0)
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        ax.xaxis.set_major_locator(few_ticks())
        ax.yaxis.set_major_locator(few_ticks())
        if bar:
            made = ax.figure.colorbar(filled, ax=ax, location="bottom", aspect=16, pad=0.02)
            made.set_label(surface.label)
            made.set_ticks(levels[:: max(1, -(-(len(levels) - 1) // 4))].tolist())
    return ax


def _mark_extrapolated(ax: Axes, surface: Surface) -> None:
    if not surface.extrapolated.any():
        return
    from matplotlib import rc_context

    with rc_context({"hatch.linewidth": 0.5, "hatch.color": "0.45"}):
        if surface.outline is None:
            _mark_grid(ax, surface)
        else:
            _mark_outside(ax, surface, surface.outline)


def _mark_grid(ax: Axes, surface: Surface) -> None:
    outside = surface.extrapolated.astype(float)
    ax.contourf(surface.x, surface.y, outside, [0.5, 1.5], colors=["white"], alpha=_FADED)
    ax.contourf(surface.x, surface.y, outside, [0.5, 1.5], colors="none", hatches=["////"])
    if not outside.all():
        ax.contour(surface.x, surface.y, outside, [0.5], colors="black", linewidths=0.8)


def _mark_outside(ax: Axes, surface: Surface, outline: FloatArray) -> None:
    """All of the grid but the polygon."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    # one clockwise, one the other way: what is within both is a hole
    rings = (_turning(surface.border, -1.0), _turning(outline, 1.0))
    paths = [Path(np.vstack([ring, ring[:1]]), closed=True) for ring in rings]
    hole = Path.make_compound_path(*paths)
    ax.add_patch(PathPatch(hole, facecolor="white", alpha=_FADED, linewidth=0))
    ax.add_patch(PathPatch(hole, facecolor="none", edgecolor="0.45", hatch="////", linewidth=0))
    ax.plot(*np.vstack([outline, outline[:1]]).T, color="black", linewidth=0.8)


def _turning(ring: FloatArray, sense: float) -> FloatArray:
    """The same polygon, counter-clockwise for a sense of 1, clockwise for -1."""
    x, y = ring.T
    area = float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    return ring if area * sense > 0 else ring[::-1]


def _mark_missing(ax: Axes, surface: Surface) -> None:
    """Crosses where there is no ellipse."""
    missing = np.isnan(surface.values)
    step = max(1, missing.shape[1] // 16)
    thin = np.zeros_like(missing)
    thin[::step, ::step] = True
    x, y = surface.grid
    chosen = missing & thin
    if chosen.any():
        ax.plot(x[chosen], y[chosen], "x", color="0.4", markersize=3, mew=0.6)


def _draw_points(ax: Axes, points: MeasuredPoints, filled: QuadContourSet) -> None:
    finite = np.isfinite(points.values)
    # a light ring around the dark one: seen on dark and on light ground
    ax.plot(points.x[finite], points.y[finite], "o", color="white", markersize=6.8, zorder=2.9)
    ax.scatter(
        points.x[finite],
        points.y[finite],
        s=26,
        c=points.values[finite],
        cmap=filled.get_cmap(),
        norm=filled.norm,  # type: ignore[arg-type]
        edgecolors="black",
        linewidths=0.8,
        zorder=3,
    )
    ax.plot(points.x[~finite], points.y[~finite], "x", color="black", markersize=5, zorder=3)


# Size, orientation and shape of the hand's ellipses in many places. Without matplotlib.

Predicted = Literal["stiffness", "viscosity"]


@dataclass(frozen=True)
class EllipseField:
    """Ellipses in P places; nan where a matrix is not positive definite.

    `size` (P,): area, in the matrix' unit squared.
    `orientation_deg` (P,): major axis, counter-clockwise from the line shoulder -> hand, in (-90,
    90].
    `shape` (P,): minor over major axis.
    `size_half_width` (P,): half the 95 % interval of the size as a part of it: of its logarithm, to
    first order.
    """

    size: FloatArray
    orientation_deg: FloatArray
    shape: FloatArray
    size_half_width: FloatArray


def predicted_field(hand: HandPrediction, which: Predicted) -> EllipseField:
    """Ellipses of predicted stiffness or viscosity."""
    A, covariance = matrix(getattr(hand, which)), hand.element_covariance(which)
    a, b, c = A[:, 0, 0], A[:, 1, 1], (A[:, 0, 1] + A[:, 1, 0]) / 2
    mean, radius = (a + b) / 2, np.hypot((a - b) / 2, c)
    # where `ellipse` refuses
    anisotropic = mean - radius > 1e-13 * mean
    major, minor = (np.where(anisotropic, axis, np.nan) for axis in (mean + radius, mean - radius))
    size, axis = np.pi * major * minor, half_turn(np.arctan2(c, (a - b) / 2) / 2)
    turned = half_turn(axis - hand.reference_angle_rad)
    sd = _sd_of_size(a, b, c, np.asarray(covariance))
    return EllipseField(
        size=size,
        orientation_deg=np.where(anisotropic, np.rad2deg(turned), np.nan),
        shape=minor / major,
        size_half_width=t_factor(hand.dof) * sd / size,
    )


def measured_field(estimates: Sequence[ImpedanceEstimate], which: Predicted) -> EllipseField:
    """Ellipses of estimates of the hand.

    Raises InputError: an estimate of another level.
    """
    for estimate in estimates:
        if estimate.level != "hand":
            raise InputError(f"an estimate of level {estimate.level}", expected="level hand")
    return _field([ellipse_of(estimate, which) for estimate in estimates])


def turned_near(angle_deg: FloatArray, centre_deg: float) -> FloatArray:
    """The same axes as angles within 90 degrees of a centre: no jumps where they wrap round."""
    return np.asarray(centre_deg + 90 - np.mod(90 - (angle_deg - centre_deg), 180))


def mean_axis_deg(angle_deg: FloatArray) -> float:
    """Mean direction of axes (which repeat after 180 degrees), nan left out."""
    finite = angle_deg[np.isfinite(angle_deg)]
    return float(np.rad2deg(np.angle(np.exp(2j * np.deg2rad(finite)).sum())) / 2)


def _sd_of_size(a: FloatArray, b: FloatArray, c: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard deviation (P,) of ``pi (a b - c^2)``, to first order.

    The covariance (P, 4, 4) is that of the matrix' elements, row by row.
    """
    gradient = np.pi * np.stack([b, -c, -c, a], axis=-1)
    variance = np.einsum("pi,pij,pj->p", gradient, covariance, gradient)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _field(ellipses: Sequence[Ellipse | None]) -> EllipseField:
    rows = [_numbers(one) for one in ellipses]
    columns = np.array(rows, dtype=float).reshape(-1, 4).T
    names = ("size", "orientation_deg", "shape", "size_half_width")
    return EllipseField(**dict(zip(names, columns, strict=True)))


def _numbers(one: Ellipse | None) -> tuple[float, float, float, float]:
    if one is None:
        return (np.nan,) * 4
    half = np.nan
    if one.element_covariance is not None:
        C = frozen_array(one.element_covariance, "covariance", (3, 3))
        half = t_factor(one.dof) * np.sqrt(max(one.gradient[0] @ C @ one.gradient[0], 0)) / one.size
    return one.size, float(np.rad2deg(one.orientation_rad)), one.shape, float(half)
