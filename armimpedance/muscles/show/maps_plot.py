"""A quantity over a plane (two joint angles, two activations, the workspace), as a map.

What a model says outside of what was measured is faded and hatched. Crosses stand where the
quantity does not exist.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
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
    known = np.isfinite(points.values)
    # a light ring around the dark one: seen on dark and on light ground
    ax.plot(points.x[known], points.y[known], "o", color="white", markersize=6.8, zorder=2.9)
    ax.scatter(
        points.x[known],
        points.y[known],
        s=26,
        c=points.values[known],
        cmap=filled.get_cmap(),
        norm=filled.norm,  # type: ignore[arg-type]
        edgecolors="black",
        linewidths=0.8,
        zorder=3,
    )
    ax.plot(points.x[~known], points.y[~known], "x", color="black", markersize=5, zorder=3)
