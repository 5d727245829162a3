"""Ellipsoids in three orthogonal views and one perspective drawing, all of lines.

An outline is the edge of the ellipsoid's projection: along the direction n of a view it reaches
``h(n) = |A n|``. Its 95 % band is that of h, along n.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.conventions import AXES, MATRICES, UNITS, group_name
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import Ellipsoid, Which, ellipsoid_of
from armimpedance.hand.show.ellipse_plot_parts import BAND_ALPHA, one_legend
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import (
    LINE_STYLES,
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_figure,
    panel_letters,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Axes across and up for each view: from above, from behind, from the right.
VIEWS: Final = (("from above", 0, 1), ("from behind", 0, 2), ("from the right", 1, 2))
_COLORS: Final = ("blue", "vermillion", "green", "purple", "orange")
#: Camera of the perspective drawing: azimuth and elevation (rad), and distance in largest
#: half-axes.
_AZIMUTH: Final = np.radians(-60.0)
_ELEVATION: Final = np.radians(22.0)
_DISTANCE: Final = 5.0


def plot_ellipsoids(estimates: Sequence[ImpedanceEstimate], which: Which = "stiffness") -> Figure:
    """Draw the ellipsoids of estimates in space about one centre.

    `estimates`: of three axes; those not positive definite are left out, and named in the legend.
    `which`: matrix whose ellipsoid is drawn.
    Returns: three views with 95 % bands, and a perspective drawing with the principal axes.
    """
    symbol = MATRICES[which][0]
    unit = UNITS[estimates[0].level][symbol]
    ellipsoids = [ellipsoid_of(e, which) for e in estimates]
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 2.6)
        axes = list(figure.subplots(1, 4))
        for i, (ellipsoid, estimate) in enumerate(zip(ellipsoids, estimates, strict=True)):
            color = OKABE_ITO[_COLORS[i % len(_COLORS)]]
            style = LINE_STYLES[(i // len(_COLORS)) % len(LINE_STYLES)]
            name = group_name(estimate.keys)
            if ellipsoid is None:
                axes[0].plot([], [], "x", color=color, label=f"{name}: not positive definite")
                continue
            for ax, (_, across, up) in zip(axes, VIEWS, strict=False):
                _draw_shadow(ax, ellipsoid, (across, up), color, style, name)
        _draw_perspective(axes[3], [ellipsoid for ellipsoid in ellipsoids if ellipsoid is not None])
        reach = max((abs(value) for ax in axes[:3] for value in ax.axis()), default=1.0)
        for ax, (title, across, up) in zip(axes, VIEWS, strict=False):
            ax.set_aspect("equal")
            ax.set(xlim=(-reach, reach), ylim=(-reach, reach))
            ax.set_title(title, pad=10)
            label_axes(ax, f"{symbol} along {AXES[across]} ({unit})", f"along {AXES[up]}")
        panel_letters(axes)
        one_legend(figure, axes[:1], columns=3)
    return figure


def _shadow(
    ellipsoid: Ellipsoid, view: tuple[int, int]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Outline (n, 2), its normals (n, 2), and half the 95 % band along them (n,)."""
    turn = np.linspace(0.0, 2 * np.pi, 181)
    flat = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    n = np.zeros((len(turn), 3))
    n[:, view] = flat
    reached = n @ ellipsoid.matrix
    h = np.linalg.norm(reached, axis=1)
    outline = (reached / h[:, None]) @ ellipsoid.matrix
    # dh = (A n / h)^T dA n
    by = np.einsum("pi,pj->pij", reached / h[:, None], n)
    by = ((by + by.transpose(0, 2, 1)) / 2).reshape(len(turn), 9)
    sd = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", by, ellipsoid.covariance, by), 0.0))
    return outline[:, list(view)], flat, t_factor(ellipsoid.dof) * sd


def _draw_shadow(
    ax: Axes, ellipsoid: Ellipsoid, view: tuple[int, int], color: str, style: object, name: str
) -> None:
    from matplotlib.patches import Polygon

    outline, normals, half = _shadow(ellipsoid, view)
    outer, inner = (outline + sign * half[:, None] * normals for sign in (1, -1))
    corners = np.concatenate([outer, inner[::-1]])
    ax.add_artist(Polygon(corners, color=color, alpha=BAND_ALPHA, linewidth=0))
    ax.update_datalim(corners)
    ax.autoscale_view()
    ax.plot(*outline.T, color=color, linestyle=style, linewidth=1.0, label=name)


def _draw_perspective(ax: Axes, ellipsoids: Sequence[Ellipsoid]) -> None:
    """Draw meridians and parallels, pale on the far side, and the principal axes."""
    ax.set_aspect("equal")
    ax.set_axis_off()
    if not ellipsoids:
        return
    largest = max(float(ellipsoid.semi_axes[0]) for ellipsoid in ellipsoids)
    for i, ellipsoid in enumerate(ellipsoids):
        color = OKABE_ITO[_COLORS[i % len(_COLORS)]]
        for line in _lines(ellipsoid):
            seen = _faces_camera(ellipsoid, line, largest)
            flat = _seen(line, largest)
            for part, alpha in ((seen, 0.9), (~seen, 0.2)):
                drawn = np.where(part[:, None], flat, np.nan)
                ax.plot(*drawn.T, color=color, linewidth=0.5, alpha=alpha)
        for v, length in zip(ellipsoid.axes.T, ellipsoid.semi_axes, strict=True):
            ends = np.outer([-length, length], v)
            ax.plot(*_seen(ends, largest).T, color=color, linewidth=1.0)
    for axis, name in zip(np.eye(3), AXES, strict=True):
        ends = _seen(np.outer([0.0, 0.9 * largest], axis), largest)
        ax.plot(*ends.T, color="0.4", linewidth=0.6)
        ax.annotate(name, ends[1], color="0.3", ha="center", va="center")


def _lines(ellipsoid: Ellipsoid) -> list[FloatArray]:
    """Closed lines (n, 3) on the ellipsoid: parallels and meridians about its longest axis."""
    turn = np.linspace(0.0, 2 * np.pi, 121)
    along = [
        np.stack(
            [np.full_like(turn, np.sin(p)), np.cos(p) * np.cos(turn), np.cos(p) * np.sin(turn)]
        )
        for p in np.radians([-60.0, -30.0, 0.0, 30.0, 60.0])
    ]
    round_ = [
        np.stack([np.sin(turn), np.cos(turn) * np.cos(m), np.cos(turn) * np.sin(m)])
        for m in np.radians([0.0, 45.0, 90.0, 135.0])
    ]
    return [((ellipsoid.axes * ellipsoid.semi_axes) @ unit).T for unit in (*along, *round_)]


def _camera() -> FloatArray:
    """Rows: the directions to the right, up, and towards the camera."""
    c, s, ce, se = np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.cos(_ELEVATION), np.sin(_ELEVATION)
    towards = np.array([ce * c, ce * s, se])
    right = np.array([-s, c, 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def _seen(points: FloatArray, largest: float) -> FloatArray:
    """Project points (n, 3) to the camera's image, (n, 2)."""
    turned = points @ _camera().T
    far = _DISTANCE * largest
    return np.asarray(turned[:, :2] * (far / (far - turned[:, 2]))[:, None])


def _faces_camera(ellipsoid: Ellipsoid, points: FloatArray, largest: float) -> BoolArray:
    """True if the surface at points (n, 3) faces the camera."""
    eye = _DISTANCE * largest * _camera()[2]
    normal = np.linalg.solve(ellipsoid.matrix @ ellipsoid.matrix, points.T).T
    return np.asarray(((eye - points) * normal).sum(axis=1) > 0)
