"""Linked interactive pictures: the ellipses of every group beside their numbers.

The pictures are Vega-Lite, built by Altair, and read the page's data by name.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import wraps
from typing import TYPE_CHECKING, Any, Final, ParamSpec

import numpy as np
import pandas as pd

from armimpedance.core.conventions import MATRICES, UNITS
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, Which, ellipse_of, locus
from armimpedance.hand.show.ellipse_plot_parts import confidence_band, default_scale
from armimpedance.hand.show.quantities import condition_of, ellipse_values
from armimpedance.show.pages import Linked
from armimpedance.show.plots import MOST_LOOKS, look

if TYPE_CHECKING:
    import altair as alt

#: Points on each outline: straight pieces shorter than a pixel.
POINTS: Final = 37
#: Digits of an outline, relative to the largest value.
DIGITS: Final = 4
#: Hands closer together than this (m) are at one place.
ONE_PLACE_M: Final = 0.01
#: Visible on light and on dark paper.
BLUE: Final = "#3d8bd4"
#: Least and largest height of one group's row, and width of a panel, pixels.
ROW_PX: Final = (13, 28)
PANEL_PX: Final = 140
FIELD_PX: Final = 370
#: Quantities of each matrix of a group, with their headings.
QUANTITIES: Final = {
    "size": "size",
    "orientation_deg": "orientation (deg)",
    "shape": "shape, minor / major",
}
#: Quantity -> label format of its axis, in D3's notation, and number of ticks.
FORMATS: Final = {"size": (",d", 3), "orientation_deg": ("d", 4), "shape": (".1f", 4)}
#: Factor for ellipses at several places, compared with print, where neighbours must not touch: here
#: one can be chosen.
LARGER: Final = 1.7


def ellipse_outlines(estimates: Sequence[ImpedanceEstimate]) -> pd.DataFrame:
    """Outlines and bands of all ellipses, as drawn.

    `estimates`: of two axes each.
    Returns: columns group, matrix, part ("outline", "band", or for few groups "name": the place of
    their name), order, x, y. Units: metres if the hands were at several places, else the matrix'
    own.
    """
    rows = [row for which in FIELDS for row in _outlines_of(estimates, which)]
    return pd.DataFrame(rows, columns=["group", "matrix", "part", "order", "x", "y"])


def apart(estimates: Sequence[ImpedanceEstimate]) -> bool:
    """True if the estimates are of hands at several places."""
    hands = [e.position for e in estimates if e.level == "hand" and e.position is not None]
    return len(hands) == len(estimates) and float(np.ptp(hands, axis=0).max()) > ONE_PLACE_M


def _are_named(estimates: Sequence[ImpedanceEstimate]) -> bool:
    """True if names are written beside the ellipses: for few groups only."""
    return len(estimates) <= MOST_LOOKS


def _outlines_of(estimates: Sequence[ImpedanceEstimate], which: Which) -> Iterator[tuple[Any, ...]]:
    shown = [e for e in estimates if ellipse_of(e, which) is not None]
    if not shown:
        return
    centres, scale = np.zeros((len(shown), 2)), 1.0
    if apart(estimates):
        centres = np.array([e.position for e in shown])
        scale = LARGER * default_scale([getattr(e, which) for e in shown], centres)
    reach = scale * max(np.abs(getattr(e, which)).max() for e in shown)
    decimals = DIGITS - int(np.ceil(np.log10(reach)))
    named = _are_named(estimates)
    for estimate, centre in zip(shown, centres, strict=True):
        inner, outer = confidence_band(estimate, which, POINTS)
        outlines = {
            "band": np.concatenate([outer, inner[::-1]]),
            "outline": locus(getattr(estimate, which), POINTS),
        }
        for part, outline in outlines.items():
            for order, (x, y) in enumerate(np.round(centre + scale * outline, decimals)):
                yield condition_of(estimate), which, part, order, x, y
        if named:
            top = outlines["outline"][outlines["outline"][:, 1].argmax()]
            x, y = np.round(centre + scale * top, decimals)
            yield condition_of(estimate), which, "name", 0, x, y


def ellipse_numbers(estimates: Sequence[ImpedanceEstimate]) -> pd.DataFrame:
    """Size, orientation and shape of every ellipse with 95 % limits.

    Returns: columns group, matrix, quantity, value, low, high, unit.
    """
    rows = [
        (condition_of(e), which, name, *values, _unit(e, which, name))
        for e in estimates
        for which in FIELDS
        for name, values in ellipse_values(e, which).items()
    ]
    return pd.DataFrame(
        rows, columns=["group", "matrix", "quantity", "value", "low", "high", "unit"]
    )


def _unit(estimate: ImpedanceEstimate, which: Which, quantity: str) -> str:
    unit = UNITS[estimate.level][MATRICES[which][0]]
    return {"size": f"({unit})²", "orientation_deg": "deg", "shape": ""}[quantity]


Arguments = ParamSpec("Arguments")


def built_unchecked(build: Callable[Arguments, Linked]) -> Callable[Arguments, Linked]:
    """Build a picture without Altair's check of each part, which takes a fifth of a page's time.

    A test checks each whole picture against the schema of Vega-Lite.
    """

    @wraps(build)
    def built(*args: Arguments.args, **named: Arguments.kwargs) -> Linked:
        from altair.utils.schemapi import debug_mode

        with debug_mode(False):
            return build(*args, **named)

    return built


@built_unchecked
def linked_ellipses(estimates: Sequence[ImpedanceEstimate], outlines: str, numbers: str) -> Linked:
    """Ellipses of all groups beside their numbers; a choice is shown in every panel.

    `outlines`, `numbers`: names of the page's data from `ellipse_outlines` and `ellipse_numbers`.
    """
    import altair as alt

    alt.data_transformers.disable_max_rows()
    chosen = alt.param(name="chosen", value="")
    matrix = alt.param(
        name="matrix",
        value="stiffness",
        bind=alt.binding_select(options=list(reversed(FIELDS)), name="Matrix "),
    )
    groups = [condition_of(e) for e in estimates]
    panels = [_panel(groups, numbers, *quantity) for quantity in QUANTITIES.items()]
    picture = alt.hconcat(_field(estimates, outlines), *panels, spacing=18)
    frame = alt.param(name="frame", value=_frames(estimates))
    level = estimates[0].level
    unit = {which: f"({UNITS[level][MATRICES[which][0]]})²" for which in FIELDS}
    units = alt.param(name="units", value=unit)
    picture = picture.add_params(chosen, matrix, frame, units).resolve_scale(y="independent")
    where = "where the hands were" if apart(estimates) else "about one centre"
    return Linked(
        name="ellipses_and_numbers",
        spec=picture.to_dict(validate=False),
        description=f"Ellipses of {len(groups)} groups {where}, and their size, orientation and "
        "shape with 95 % intervals; the table below holds the same numbers.",
        caption="Point at a value to read it with its interval. Choose a group here or in the "
        "table: it is then dark in every panel. Shaded: 95 % band of the outline.",
        numbers=numbers,
    )


def _panel(groups: Sequence[str], numbers: str, quantity: str, title: str) -> Any:
    """One quantity of every group as a dot with its interval."""
    import altair as alt

    base = (
        alt.Chart(alt.NamedData(numbers))
        .transform_filter(f"datum.quantity == '{quantity}' && datum.matrix == matrix")
        .transform_calculate(text=_SENTENCE)
        .encode(
            y=alt.Y("group:N", sort=list(groups), title=None, axis=_groups_axis(quantity)),
            opacity=_PICKED(alt),
            color=_colored(groups),
            tooltip=alt.Tooltip("text:N"),
        )
    )
    form, ticks = FORMATS[quantity]
    axis = alt.Axis(tickCount=ticks, format=form, labelOverlap=True, labelSeparation=8)
    x = alt.X("value:Q", title=None, scale=alt.Scale(zero=False), axis=axis)
    low = alt.X("low:Q", title=None)
    rule = base.mark_rule(strokeWidth=2, opacity=0.6).encode(x=low, x2="high:Q")
    dot = base.mark_circle(size=34, opacity=1).encode(x=x)
    # the unit of the size is that of the chosen matrix, which an axis' title cannot follow
    words = alt.ExprRef("'size, ' + units[matrix]") if quantity == "size" else title
    head = alt.TitleParams(
        text=words, orient="bottom", anchor="middle", fontSize=11, fontWeight="normal"
    )
    height = _row_px(groups) * len(groups)
    return alt.layer(rule, dot).properties(width=PANEL_PX, height=height, title=head)


def _colored(groups: Sequence[str], channel: str = "Color") -> Any:
    """Colour of each group, the same in every picture; one colour for many groups."""
    import altair as alt

    if len(groups) > MOST_LOOKS:
        return alt.value(BLUE)
    colors = [str(look(number)["color"]) for number in range(len(groups))]
    scale = alt.Scale(domain=list(groups), range=colors)
    return getattr(alt, channel)("group:N", scale=scale, legend=None)


def _row_px(groups: Sequence[str]) -> int:
    """Height of a row: few groups fill the height of the ellipses, many are close together."""
    least, most = ROW_PX
    return min(most, max(least, FIELD_PX // len(groups)))


#: Text at the pointer for a value.
_SENTENCE: Final = (
    "datum.group + ': ' + datum.quantity + ' ' + format(datum.value, '.4~g') + ' ' + datum.unit"
    " + ' (95 %: ' + format(datum.low, '.4~g') + ' to ' + format(datum.high, '.4~g') + ')'"
)


def _groups_axis(quantity: str) -> alt.Axis:
    """Axis of the groups, with names at the first panel only."""
    import altair as alt

    first = quantity == next(iter(QUANTITIES))
    return alt.Axis(labels=first, ticks=first, domain=False, labelLimit=170, grid=True)


def _PICKED(alt: Any) -> Any:  # noqa: N802 - an encoding, used as a constant
    """Dark if nothing is chosen or this group is."""
    return alt.condition("chosen == '' || datum.group == chosen", alt.value(1), alt.value(0.12))


def _field(estimates: Sequence[ImpedanceEstimate], outlines: str) -> Any:
    """The ellipses, as wide as they are high."""
    import altair as alt

    unit = "m" if apart(estimates) else "unit of the matrix"
    x, y = (
        alt.Scale(
            domainMin=alt.ExprRef(f"frame[matrix][{2 * i}]"),
            domainMax=alt.ExprRef(f"frame[matrix][{2 * i + 1}]"),
            nice=False,
            zero=False,
        )
        for i in (0, 1)
    )
    base = (
        alt.Chart(alt.NamedData(outlines))
        .transform_filter("datum.matrix == matrix")
        .encode(
            x=alt.X("x:Q", title=f"x ({unit})", scale=x),
            y=alt.Y("y:Q", title=f"y ({unit})", scale=y),
            order="order:Q",
            detail="group:N",
            opacity=_PICKED(alt),
            tooltip=alt.Tooltip("group:N"),
        )
    )
    groups = [condition_of(e) for e in estimates]
    band = (
        base.transform_filter("datum.part == 'band'")
        .mark_line(filled=True, fillOpacity=0.3, strokeWidth=0)
        .encode(fill=_colored(groups, "Fill"))
    )
    line = (
        base.transform_filter("datum.part == 'outline'")
        .mark_line(strokeWidth=1.4)
        .encode(stroke=_colored(groups, "Stroke"))
    )
    layers = [band, line]
    if _are_named(estimates):
        name = base.transform_filter("datum.part == 'name'").mark_text(dy=-7)
        layers.append(name.encode(text="group:N"))
    return alt.layer(*layers).properties(width=FIELD_PX, height=FIELD_PX)


def _frames(estimates: Sequence[ImpedanceEstimate]) -> dict[str, list[float]]:
    """Limits of x and of y for each matrix, the same length for both."""
    outlines = ellipse_outlines(estimates)
    frames = {}
    for matrix, points in outlines.groupby("matrix"):
        low, high = points[["x", "y"]].min().to_numpy(), points[["x", "y"]].max().to_numpy()
        half, middle = 0.53 * float((high - low).max()), (low + high) / 2
        frames[str(matrix)] = [float(v) for m in middle for v in (m - half, m + half)]
    return frames
