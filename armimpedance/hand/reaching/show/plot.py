"""Plot of the impedance along a reach: ellipses on the path, and elements with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import MATRICES, UNITS, group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.show.ellipse_plot import plot_ellipse
from armimpedance.hand.show.ellipse_plot_parts import draw_scale_bar, matrix_of, one_legend
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_figure,
    panel_letters,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_COLORS = ("blue", "vermillion", "green", "purple")
_MARKERS = ("o", "s", "^", "D")
_HEIGHT_IN = 2.9
#: More rows than this are drawn as a course.
MOST_MARKS: Final = 8
#: Smaller forces of the robot are not drawn (N).
LEAST_FORCE_N: Final = 0.5


def plot_movement(estimates: Sequence[ImpedanceEstimate], axes: Any = None) -> Any:
    """Draw K's ellipses along the path, and the elements of K and B over the way.

    `estimates`: of a moving hand or its joints, phase by phase or as a course; several conditions
    have colours of their own.
    `axes` (3,) of Axes: default: those of a new figure.
    Returns: `axes` (3,) array of Axes.
    Raises InputError: an estimate has no place.
    """
    if not estimates or any(e.level == "muscle" or e.position is None for e in estimates):
        raise InputError("no estimates of a moving hand", expected="rows of `movement`")
    with print_style():
        if axes is None:
            axes = new_figure(TWO_COLUMNS_IN, _HEIGHT_IN).subplots(1, 3, width_ratios=(1, 1.3, 1.3))
        _draw_path(axes[0], estimates)
        over, name = _abscissa(estimates)
        for ax, which in zip(axes[1:], ("stiffness", "viscosity"), strict=True):
            _draw_elements(ax, estimates, over, which)
            ax.set_xlabel(name)
        one_legend(axes[0].figure, [axes[1]], columns=4)
        panel_letters(axes)
    return axes


def _abscissa(estimates: Sequence[ImpedanceEstimate]) -> tuple[FloatArray, str]:
    """Abscissa of the elements and its label: time of a course, else distance on the line, cm."""
    phases = [str(e.keys.get("phase", "")) for e in estimates]
    if all(phase.endswith(" s") for phase in phases):
        return np.array([float(phase.removesuffix(" s")) for phase in phases]), "time (s)"
    place = np.array([e.position for e in estimates])
    line = place[-1] - place[0]
    length = float(np.hypot(*line))
    way = (place - place[0]) @ line / length if length > 0 else np.zeros(len(place))
    return np.asarray(100 * way), "way (cm)"


def _conditions(estimates: Sequence[ImpedanceEstimate]) -> dict[str, list[int]]:
    """Condition -> indices of its estimates."""
    rows_of: dict[str, list[int]] = {}
    for row, estimate in enumerate(estimates):
        keys = {name: value for name, value in estimate.keys.items() if name != "phase"}
        rows_of.setdefault(group_name(keys), []).append(row)
    return rows_of


def _draw_path(ax: Axes, estimates: Sequence[ImpedanceEstimate]) -> None:
    from matplotlib.ticker import MaxNLocator

    hands = np.array([e.position for e in estimates])
    at_hand = estimates[0].level == "hand"
    matrices = [matrix_of(e, "stiffness") for e in estimates]
    marked = [row for rows in _conditions(estimates).values() for row in _spread(rows)]
    largest = max(float(np.linalg.norm(matrices[row], 2)) for row in marked)
    # m a N/m: the largest ellipse reaches a fifth of the way to each side
    scale = 0.2 * _extent(hands) / largest
    for color, rows in zip(_cycled(_COLORS), _conditions(estimates).values(), strict=False):
        ax.plot(*hands[rows].T, "-", color="0.7", linewidth=1.0)
        few = _spread(rows)
        _draw_forces(ax, [estimates[row] for row in few], hands)
        for row in few if at_hand else ():
            plot_ellipse(
                *(estimates[row], ax, hands[row], scale, "stiffness", True),
                color=OKABE_ITO[color],
                linewidth=0.8,
            )
    middle, half = (hands.max(axis=0) + hands.min(axis=0)) / 2, 0.8 * _extent(hands)
    ax.set(xlim=middle[0] + half * np.array([-1, 1]), ylim=middle[1] + half * np.array([-1, 1.25]))
    ax.set_aspect("equal")
    ax.xaxis.set_major_locator(MaxNLocator(3))
    if at_hand:
        draw_scale_bar(ax, matrices, scale, UNITS["hand"]["K"])
    label_axes(ax, "x (m)", "y (m)")


def _extent(hands: FloatArray) -> float:
    """Longer side of the hands' area, m."""
    return max(float(np.ptp(hands, axis=0).max()), 0.06)


def _spread(rows: Sequence[int]) -> list[int]:
    """A few of a course's rows, including the first and the last."""
    if len(rows) <= MOST_MARKS:
        return list(rows)
    return [rows[round(k)] for k in np.linspace(0, len(rows) - 1, 5)]


def _draw_forces(ax: Axes, estimates: Sequence[ImpedanceEstimate], hands: FloatArray) -> None:
    """Draw the robot's forces on the undisturbed hand: the longest arrow is a sixth of the way."""
    at = np.array([e.position for e in estimates])
    force = -np.array([np.zeros(2) if e.force is None else e.force for e in estimates])
    most = float(np.hypot(*force.T).max())
    if most < LEAST_FORCE_N:
        return
    length = _extent(hands) / 6
    ax.quiver(
        *at.T,
        *(force * length / most).T,
        angles="xy",
        scale_units="xy",
        scale=1,
        color="0.35",
        width=0.008,
        zorder=1,
    )
    ax.annotate(
        f"robot's force: {most:.2g} N at most",
        (0.03, 0.97),
        xycoords="axes fraction",
        va="top",
        fontsize="small",
        color="0.35",
    )


def _draw_elements(
    ax: Axes, estimates: Sequence[ImpedanceEstimate], over: FloatArray, which: str
) -> None:
    """Draw the four elements of one matrix over the way, with 95 % intervals or bands."""
    symbol, level = MATRICES[which][0], estimates[0].level
    place = list(MATRICES).index(which)
    value = np.array([e.parameters.reshape(3, 4)[place] for e in estimates])
    limits = np.array([e.interval()[:, place].reshape(2, 4) for e in estimates])
    aside = 0.012 * float(np.ptp(over))
    names = ("xx", "xy", "yx", "yy") if level == "hand" else ("11", "12", "21", "22")
    for n, rows in enumerate(_conditions(estimates).values()):
        style: dict[str, Any] = {"linewidth": 0.9, "linestyle": "-" if n == 0 else "--"}
        for k, name in enumerate(names):
            look: dict[str, Any] = {
                **style,
                "color": OKABE_ITO[_COLORS[k]],
                "label": name if n == 0 else None,
            }
            low, high = limits[rows, :, k].T
            if len(rows) > MOST_MARKS:
                ax.plot(over[rows], value[rows, k], **look)
                ax.fill_between(over[rows], low, high, color=look["color"], alpha=0.2, linewidth=0)
                continue
            ax.errorbar(
                over[rows] + (k - 1.5) * aside,
                value[rows, k],
                yerr=np.abs(np.stack([low, high]) - value[rows, k]),
                marker=_MARKERS[k],
                markersize=3.5,
                capsize=2,
                **look,
            )
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
    label_axes(ax, "", f"{symbol} ({unit_text(UNITS[level][symbol])})")


def _cycled(names: Sequence[str]) -> Sequence[str]:
    return [*names] * 8
