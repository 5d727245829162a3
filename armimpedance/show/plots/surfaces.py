"""A quantity over a plane (two joint angles, two activations), as a surface.

What a model says outside of what was measured is never drawn like the rest: it is a grey wire
frame. Nothing is drawn where the quantity does not exist.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.show.plots.style import new_figure, print_style

#: Light is much in print, dark is much on a screen for this one too; told apart without colour.
COLORS: Final = "viridis"
_LEVELS: Final = 9
#: Points along each side of an outline.
_EDGE_POINTS: Final = 16
#: Direction (rad) along which a surface is looked at: a little more along y than along x.
_LEAN: Final = np.deg2rad(55.0)


@dataclass(frozen=True)
class Surface:
    """Values over a grid.

    Attributes
    ----------
    x, y : (n,) and (m,), or both (m, n)
        Columns and rows of the grid, rising, or where each point of a bent grid lies.
    values : (m, n)
        nan where the quantity does not exist.
    extrapolated : (m, n) bool
    x_label, y_label, label : str
        Labels with units.
    outline : (V, 2) or None
        The polygon outside of which all is extrapolated, where there is one.
    """

    x: FloatArray
    y: FloatArray
    values: FloatArray
    extrapolated: BoolArray
    x_label: str
    y_label: str
    label: str
    outline: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        values = np.array(self.values, dtype=float)
        bent = np.ndim(self.x) == 2
        shape = values.shape if bent else (np.size(self.y), np.size(self.x))
        put(self, "x", frozen_array(self.x, "x", shape if bent else (None,)))
        put(self, "y", frozen_array(self.y, "y", shape if bent else (None,)))
        if values.shape != shape or np.isinf(values).any():
            raise InputError(
                f"a surface of shape {values.shape}", expected=f"{shape}, finite or nan"
            )
        values.flags.writeable = False
        put(self, "values", values)
        put(self, "extrapolated", frozen_array(self.extrapolated, "extrapolated", shape, np.bool_))
        if self.outline is not None:
            put(self, "outline", frozen_array(self.outline, "outline", (None, 2)))

    @property
    def grid(self) -> tuple[FloatArray, FloatArray]:
        """x and y of each point, (m, n) each."""
        if self.x.ndim == 2:
            return self.x, self.y
        x, y = np.meshgrid(self.x, self.y)
        return x, y

    @property
    def border(self) -> FloatArray:
        """Points once around the grid, (2 (m + n) - 4, 2)."""
        g = np.stack(self.grid, axis=-1)
        return np.concatenate([g[0, :-1], g[:-1, -1], g[-1, :0:-1], g[:0:-1, 0]])

    @property
    def inside(self) -> FloatArray:
        """Values (m, n) where they rest on measurements, else nan."""
        return np.where(self.extrapolated, np.nan, self.values)


@dataclass(frozen=True)
class MeasuredPoints:
    """Measured and predicted values at P places; NaN where one is missing.

    Attributes
    ----------
    x, y, values, predicted : (P,)
    """

    x: FloatArray
    y: FloatArray
    values: FloatArray
    predicted: FloatArray


def plot_surface(
    surface: Surface, points: MeasuredPoints | None = None, ax: Any | None = None
) -> Any:
    """Draw a surface in three dimensions, each measured point on a stem from the surface.

    Filled points lie above the surface, open ones below; a legend says so.

    Parameters
    ----------
    surface : Surface
    points : MeasuredPoints, optional
    ax : Axes3D, optional

    Raises
    ------
    InputError
        Nothing rests on measurements, or `ax` has no third dimension.
    """
    levels = surface_levels(surface, points)
    with print_style():
        ax = new_figure(3.2, 3.2).add_subplot(projection="3d") if ax is None else ax
        if getattr(ax, "name", "") != "3d":
            raise InputError("flat axes for a surface", expected="add_subplot(projection='3d')")
        ax.computed_zorder = False
        _draw_sheet(ax, surface, levels)
        if points is not None:
            _draw_stems(ax, points)
        ax.set(xlabel=surface.x_label, ylabel=surface.y_label, zlabel=surface.label)
        ax.set_zlim(levels[0], levels[-1])
        for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
            axis.set_major_locator(few_ticks())
            axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
            axis._axinfo["grid"].update(color="0.88", linewidth=0.5)
            axis.labelpad = -5
        ax.tick_params(pad=-3)
        ax.view_init(elev=33, azim=_azimuth_deg(surface))
        ax.set_box_aspect((1.0, 1.0, 0.8), zoom=1.05)
    return ax


def surface_levels(surface: Surface, points: MeasuredPoints | None = None) -> FloatArray:
    """Round numbers that span the values which rest on measurements, and the points.

    Raises
    ------
    InputError
        There are none.
    """
    from matplotlib.ticker import MaxNLocator

    held = surface.inside[np.isfinite(surface.inside)]
    if points is not None:
        held = np.append(held, points.values[np.isfinite(points.values)])
    if not held.size:
        raise InputError("nothing to draw: no value rests on measurements")
    low, high = float(held.min()), float(held.max())
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    return np.asarray(MaxNLocator(_LEVELS).tick_values(low, high))


def few_ticks(most: int = 4) -> Any:
    """About so many round numbers along an axis."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(most)


def _draw_sheet(ax: Any, surface: Surface, levels: FloatArray) -> None:
    from matplotlib import colormaps
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

    x, y = surface.grid
    whole = _cells(surface) if surface.outline is None else _triangles(surface, surface.outline)
    faces = colormaps[COLORS](level_norm(levels)(whole[:, :, 2].mean(axis=1)), alpha=0.75)
    ax.add_collection3d(Poly3DCollection(whole, facecolors=faces, linewidths=0, zorder=1))
    beyond = np.where(surface.extrapolated, surface.values, np.nan)
    beyond[~((beyond >= levels[0]) & (beyond <= levels[-1]))] = np.nan
    ax.plot_wireframe(x, y, beyond, rcount=12, ccount=12, color="0.6", linewidth=0.35, zorder=0)
    ax.set(xlim=(x.min(), x.max()), ylim=(y.min(), y.max()))


def level_norm(levels: FloatArray) -> Any:
    """Colours in equal steps from level to level, two kept for what is below and above."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm

    return BoundaryNorm(levels, colormaps[COLORS].N, extend="both")


def _corners(nodes: FloatArray) -> FloatArray:
    """Cells ((m - 1)(n - 1), 4, k) of a grid (m, n, k), corner after corner."""
    around = (nodes[:-1, :-1], nodes[:-1, 1:], nodes[1:, 1:], nodes[1:, :-1])
    return np.stack(around, axis=2).reshape(-1, 4, nodes.shape[-1])


def _cells(surface: Surface) -> FloatArray:
    """Whole cells only, (cells, 4, 3): plot_surface leaves parts of cells whose corners are nan."""
    corners = _corners(np.stack([*surface.grid, surface.inside], axis=-1))
    return corners[np.isfinite(corners).all(axis=(1, 2))]


def _triangles(surface: Surface, outline: FloatArray) -> FloatArray:
    """Triangles (n, 3, 3) that fill the outline to its edge."""
    from matplotlib.path import Path
    from matplotlib.tri import Triangulation
    from scipy.interpolate import LinearNDInterpolator

    places = np.stack(surface.grid, axis=-1)
    known, held = np.isfinite(surface.values), np.isfinite(surface.inside)
    ends = np.roll(outline, -1, axis=0)
    share = np.linspace(0, 1, _EDGE_POINTS, endpoint=False)[:, None, None]
    ring = ((1 - share) * outline + share * ends).reshape(-1, 2)
    edge = LinearNDInterpolator(places[known], surface.values[known])(ring)
    nodes = np.vstack(
        [
            np.column_stack([places[held], surface.values[held]]),
            np.column_stack([ring, edge])[np.isfinite(edge)],
        ]
    )
    if len(nodes) < 3:
        return _cells(surface)
    corners = nodes[Triangulation(nodes[:, 0], nodes[:, 1]).triangles]
    within = Path(outline).contains_points(corners[:, :, :2].mean(axis=1))
    # no triangle bridges a missing value: it would be longer than any cell is across
    sides = np.linalg.norm((corners - np.roll(corners, 1, axis=1))[:, :, :2], axis=2)
    cell = _corners(places)
    across = np.linalg.norm(cell[:, 2:] - cell[:, :2], axis=2).max()
    return np.asarray(corners[within & (sides.max(axis=1) < 1.05 * across)])


def _azimuth_deg(surface: Surface) -> float:
    """From where to look: from low x and y, or from the other side if the surface falls away."""
    rows, columns = surface.values.shape
    x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    finite = np.isfinite(surface.inside)
    near = -(np.cos(_LEAN) * x + np.sin(_LEAN) * y)[finite]
    z = surface.inside[finite]
    falls_away = float(((near - near.mean()) * (z - z.mean())).sum()) > 0
    return float(np.rad2deg(_LEAN)) + (0.0 if falls_away else -180.0)


def _draw_stems(ax: Any, points: MeasuredPoints) -> None:
    finite = np.isfinite(points.values) & np.isfinite(points.predicted)
    for fill, word in (("black", "above"), ("white", "below")):
        look: dict[str, Any] = {"color": "black", "mfc": fill, "mew": 0.7, "markersize": 3.5}
        ax.plot([], [], [], "o", label=f"measured, {word} the surface", **look)
    for x, y, value, model in zip(
        *(each[finite] for each in (points.x, points.y, points.values, points.predicted)),
        strict=True,
    ):
        fill = "black" if value >= model else "white"
        ax.plot([x, x], [y, y], [model, value], color="black", linewidth=0.8, zorder=2)
        ax.plot([x], [y], [value], "o", color="black", mfc=fill, mew=0.7, markersize=3.5, zorder=3)
