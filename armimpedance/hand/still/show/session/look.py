"""What the pictures of a session share: panel letters, thin lines, the look of a direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, FORCE_UNIT, Kind
from armimpedance.show.plots import LINE_STYLES, OKABE_ITO, unit_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: More lines than this are stored as pixels in a vector file: it would take megabytes.
MOST_VECTOR_LINES = 120
GREY = "0.55"
MARKED = OKABE_ITO["vermillion"]
_COLORS = ("blue", "orange", "green", "purple")


def axis_name(kind: Kind, i: int) -> str:
    """x, y, z of the hand; joint 1, joint 2."""
    return AXES[i] if kind == "hand" else f"joint {i + 1}"


def motion_label(kind: Kind) -> tuple[str, float]:
    """Label of a displacement, and what SI is multiplied by for it."""
    return ("displacement (mm)", 1e3) if kind == "hand" else ("displacement (rad)", 1.0)


def force_label(kind: Kind) -> str:
    """Label of a force or torque."""
    return f"{'force' if kind == 'hand' else 'torque'} ({unit_text(FORCE_UNIT[kind])})"


def direction_look(number: int, count: int) -> dict[str, Any]:
    """Colour and line of a direction: opposite ones share a colour, and one of them is dashed."""
    half = max(1, count // 2) if count % 2 == 0 and count <= 2 * len(_COLORS) else count
    color = OKABE_ITO[_COLORS[(number % half) % len(_COLORS)]]
    if half < count:
        return {"color": color, "linestyle": LINE_STYLES[0] if number < half else (0, (3, 1.2))}
    return {"color": color, "linestyle": LINE_STYLES[(number // len(_COLORS)) % len(LINE_STYLES)]}


def draw_lines(ax: Axes, x: FloatArray, lines: FloatArray, label: str = "", **look: Any) -> None:
    """Many lines (n, S) over one x (S,), as one artist."""
    from matplotlib.collections import LineCollection

    if not len(lines):
        return
    points = np.stack([np.broadcast_to(x, lines.shape), lines], axis=-1)
    drawn = LineCollection(
        list(points),
        colors=look.get("color", GREY),
        linestyles=look.get("linestyle", "-"),
        linewidths=look.get("linewidth", 0.5),
        alpha=look.get("alpha"),
        zorder=look.get("zorder", 2),
        label=label or "_lines",
        rasterized=len(lines) > MOST_VECTOR_LINES,
    )
    ax.add_collection(drawn)
    ax.autoscale_view()


def zero_line(ax: Axes) -> None:
    """A faint line at zero."""
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)


def thin_line(count: int) -> float:
    """Width of one of many lines, points: a thousand of the usual width are a block of ink."""
    return float(np.clip(0.6 / np.sqrt(max(count, 1) / 40), 0.12, 0.6))


def short_list(numbers: Sequence[int], most: int = 6) -> str:
    """Trial numbers as a legend holds them."""
    shown = ", ".join(map(str, numbers[:most]))
    return shown + (f" and {len(numbers) - most} more" if len(numbers) > most else "")
