"""Relative errors of several methods: joints side by side, parameters one below the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.show import one_legend
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What the source calls reliable, %.
LIMIT_PERCENT: Final = 10.0
ROW_IN: Final = 1.55


def _look(color: str, marker: str, size: float, style: Any = "-") -> Mapping[str, Any]:
    return MappingProxyType(
        {
            **{"color": OKABE_ITO[color], "marker": marker, "ls": style, "lw": 1.1},
            **{"ms": size, "mfc": "none", "mew": 1.0},
        }
    )


#: Told apart by marker as well as by colour, and where they coincide too: open, of several sizes.
LOOKS: Final = (
    _look("black", "x", 4.5, (0, (4, 2))),
    _look("vermillion", "s", 4.0),
    _look("blue", "o", 6.5),
    _look("green", "^", 4.5),
    _look("purple", "v", 2.5, (0, (2, 1.5))),
    _look("sky", "d", 4.5, (0, (4, 2))),
)


@dataclass(frozen=True)
class Scale:
    """What all panels share.

    Attributes
    ----------
    label : str
        Of the horizontal axis.
    ticks : tuple of float
    log : bool
        Whether it is logarithmic; the errors always are.
    lowest, highest : float
        Of the errors, %.
    marks : mapping float -> str
        Places that the source names, and what to write there.
    """

    label: str
    ticks: tuple[float, ...]
    log: bool
    lowest: float
    highest: float
    marks: Mapping[float, str]


def draw_errors(
    titles: Sequence[str],
    names: Sequence[str],
    x: Sequence[FloatArray],
    percent: Sequence[Mapping[str, FloatArray]],
    scale: Scale,
) -> Figure:
    """Errors over a condition.

    Parameters
    ----------
    titles : P
        Of the columns, a joint each.
    names : R
        Of the rows, a parameter each.
    x : P of (S,)
    percent : P of mapping method -> (S, R)
        %; NaN leaves a gap.
    scale : Scale
    """
    figure = new_figure(TWO_COLUMNS_IN, ROW_IN * len(names) + 0.45)
    with print_style():
        axes = figure.subplots(len(names), len(titles), sharex=True, sharey=True, squeeze=False)
        for column, (title, at, errors) in enumerate(zip(titles, x, percent, strict=True)):
            axes[0, column].set_title(title, loc="left", fontsize=8)
            for row in range(len(names)):
                _lines(axes[row, column], at, {m: e[:, row] for m, e in errors.items()}, scale)
        for row, name in enumerate(names):
            axes[row, 0].set_ylabel(f"error of {name} (%)")
        for ax in axes[-1]:
            ax.set_xlabel(scale.label)
        for place, text in scale.marks.items():
            axes[0, 0].annotate(
                text, (place, scale.highest), (2, -1), fontsize=7, color="0.35", va="top",
                textcoords="offset points",
            )  # fmt: skip
        one_legend(figure, list(axes.flat), columns=6)
    return figure


def _lines(ax: Axes, x: FloatArray, percent: Mapping[str, FloatArray], scale: Scale) -> None:
    ax.set_yscale("log")
    if scale.log:
        ax.set_xscale("log")
    ax.set_xticks(scale.ticks, [f"{tick:g}" for tick in scale.ticks])
    ax.minorticks_off()
    ax.set_ylim(scale.lowest, scale.highest)
    ax.yaxis.set_major_formatter("{x:g}")
    ax.axhline(LIMIT_PERCENT, color="0.35", lw=0.8)
    for place in scale.marks:
        ax.axvline(place, color="0.35", lw=0.8, ls=(0, (1, 1.5)))
    for look, (method, values) in zip(LOOKS, percent.items(), strict=False):
        ax.plot(x, values, label=method, **look)
