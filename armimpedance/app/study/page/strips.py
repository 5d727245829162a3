"""All people side by side: one panel a quantity, one strip a condition."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.show.pages import Picture, picture
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: One strip as `write_cohort` takes it.
Strip = Mapping[str, Any]
#: More people than this have no room for an interval each.
MOST_INTERVALS: Final = 80
ACROSS: Final = 3
ROW_IN: Final = 2.1
#: Names written into one panel.
MOST_NAMED: Final = 5
#: Half of a strip's width, of the way to its neighbour.
HALF: Final = 0.32
#: Numbers that span more than this are drawn over their logarithm.
DECADE: Final = 20
_SHAPES: Final = ("_size", "_shape", "_orientation_deg")


def strip_pictures(
    strips: Sequence[Strip], far: Mapping[tuple[str, str, str], Sequence[int]], names: Sequence[str]
) -> list[Picture]:
    """The pictures of every table: of ellipses first, then of the other numbers.

    `far`: (table, condition, quantity) -> the sessions that are far from the others.
    `names`: of the sessions, by number.
    """
    return [
        _picture(table, kind, panels, far, names)
        for table, kind, panels in _drawn(strips)
        if panels
    ]


def _drawn(strips: Sequence[Strip]) -> Iterator[tuple[str, str, dict[str, list[Strip]]]]:
    """Table, what of it, and quantity -> its strips."""
    for table in dict.fromkeys(strip["table"] for strip in strips):
        panels: dict[str, list[Strip]] = {}
        for strip in strips:
            if strip["table"] == table:
                panels.setdefault(strip["quantity"], []).append(strip)
        shapes = {name: own for name, own in panels.items() if name.endswith(_SHAPES)}
        # The lower half of a matrix is next to the same as the upper.
        rest = {n: own for n, own in panels.items() if n not in shapes and not n.endswith("_21")}
        yield table, "ellipses", shapes
        yield table, "numbers", rest


def _picture(
    table: str,
    kind: str,
    panels: Mapping[str, Sequence[Strip]],
    far: Mapping[tuple[str, str, str], Sequence[int]],
    names: Sequence[str],
) -> Picture:
    rows = -(-len(panels) // ACROSS)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, ROW_IN * rows + 0.5)
        axes = figure.subplots(rows, ACROSS, squeeze=False)
        for ax in axes.flat[len(panels) :]:
            ax.set_axis_off()
        conditions = list(dict.fromkeys(s["condition"] for own in panels.values() for s in own))
        labels = _short(conditions)
        for number, (ax, (quantity, own)) in enumerate(
            zip(axes.flat, panels.items(), strict=False)
        ):
            named: set[int] = set()
            for strip in own:
                at = conditions.index(strip["condition"])
                _draw(ax, at, strip, far.get(_key(strip), ()))
                _name(ax, at, strip, far.get(_key(strip), ()), names, named)
            _over_decades(ax, own)
            last = number + ACROSS >= len(panels)
            _label(ax, quantity, own[0], labels if last else [""] * len(labels))
    of = f"{table}: all sessions by condition"
    caption = (
        f"{of}. Each dot is one session"
        + (", with its 95 % interval" if _few(panels) else "")
        + "; the bar is the median. Triangles: far from the others, with their intervals."
    )
    drawn = picture(figure, f"{table.removesuffix('.csv')}_{kind}", caption)
    return Picture(drawn.name, drawn.svg, caption)


def _key(strip: Strip) -> tuple[str, str, str]:
    return strip["table"], strip["condition"], strip["quantity"]


def _few(panels: Mapping[str, Sequence[Strip]]) -> bool:
    return max(len(s["values"]) for own in panels.values() for s in own) <= MOST_INTERVALS


def _draw(ax: Axes, at: int, strip: Strip, far: Sequence[int]) -> None:
    sessions: IntArray = strip["sessions"]
    values: FloatArray = strip["values"]
    x = at + HALF * _spread(len(values))
    away = np.isin(sessions, far)
    ranges = [values - strip["low"], strip["high"] - values]
    errors = np.nan_to_num(np.maximum(ranges, 0))
    few = len(values) <= MOST_INTERVALS
    blue, red = OKABE_ITO["blue"], OKABE_ITO["vermillion"]
    if few and (~away).any():
        ax.errorbar(x[~away], values[~away], errors[:, ~away], fmt="none", ecolor="0.7", lw=0.5)
    size = 5 if few else 1.2
    # Thousands of dots are drawn as one image: as drawings they would take megabytes.
    dots = ax.scatter(x[~away], values[~away], s=size, c=blue, linewidths=0, zorder=3)
    dots.set_rasterized(not few)
    middle = float(np.median(values))
    ax.plot([at - HALF, at + HALF], [middle, middle], color="black", lw=1, zorder=4)
    if away.any():
        ms = 3.5 if few else 2.5
        ax.errorbar(x[away], values[away], errors[:, away], fmt="^", color=red, ms=ms, lw=0.8)


def _name(
    ax: Axes, at: int, strip: Strip, far: Sequence[int], names: Sequence[str], named: set[int]
) -> None:
    """Write who is far from the others, each once and few in a panel."""
    x = at + HALF * _spread(len(strip["values"]))
    for row in np.flatnonzero(np.isin(strip["sessions"], far)):
        session = int(strip["sessions"][row])
        if session in named or len(named) == MOST_NAMED:
            continue
        named.add(session)
        place = (x[row], strip["values"][row])
        ax.annotate(
            names[session][:16],
            place,
            xytext=(3, 2),
            textcoords="offset points",
            fontsize=6,
            color=OKABE_ITO["vermillion"],
        )


def _spread(count: int) -> FloatArray:
    """Places from -1 to 1 in an order in which neighbours are far apart, the same each time."""
    golden = (np.arange(count) * 0.6180339887498949) % 1
    return np.asarray(2 * golden - 1 if count > 1 else np.zeros(1))


def _over_decades(ax: Axes, strips: Sequence[Strip]) -> None:
    """A logarithmic axis for positive numbers that span more than a decade."""
    values = np.concatenate([strip["values"] for strip in strips])
    if strips[0]["kind"] == "ratio" and values.max() > DECADE * values.min():
        from matplotlib.ticker import FuncFormatter, NullFormatter

        ax.set_yscale("log")
        # Names of files are text and no formulas: so must these numbers be.
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())


def _label(ax: Axes, quantity: str, strip: Strip, labels: Sequence[str]) -> None:
    unit = f" ({strip['unit']})" if strip["unit"] else ""
    title = quantity.removesuffix("_deg").replace("_", " ")
    ax.set_title(f"{title}{unit}")
    ax.set_xlim(-0.6, len(labels) - 0.4)
    ax.set_xticks(range(len(labels)), labels)
    if max(map(len, labels)) > 3:
        ax.tick_params("x", labelrotation=45)


def _short(conditions: Sequence[str]) -> list[str]:
    """Names of the conditions without the beginning that they share."""
    words = [name.split("_") for name in conditions]
    while len(words) > 1 and all(len(w) > 1 for w in words) and len({w[0] for w in words}) == 1:
        words = [w[1:] for w in words]
    return ["_".join(w)[:18] for w in words]
