"""Rows of a table drawn: an ellipse and elements with 95 % intervals beside each row's name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import eq, le
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.show.plots.style import (
    TWO_COLUMNS_IN,
    element_text,
    new_axes,
    new_figure,
    print_style,
    unit_text,
)
from armimpedance.show.plots.surfaces import few_ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Rows closer together than this have no room for their names (inches).
_LEAST_ROW_IN: Final = 0.155
_ROW_IN: Final = 0.23
#: Height of a band of panels beside its rows: ticks, label, letter.
_BESIDE_IN: Final = 0.75
_HIGHEST_IN: Final = 8.2
#: Longer names take the panels' room: they are shortened in the middle.
_MOST_LETTERS: Final = 26


@dataclass(frozen=True)
class Series(FrozenRecord):
    """Matrices of all rows under one assumption.

    Attributes
    ----------
    label : str
        For the legend.
    matrices, half : (n, k, k)
        Values and half-widths of their 95 % intervals.
    color : str
    filled : bool
        Whether its marks are.
    faded : (n,) bool or None
        Rows that are extrapolated: drawn as squares.
    """

    label: str
    matrices: Annotated[FloatArray, "n k k"]
    half: Annotated[FloatArray, "n k k"]
    color: str
    filled: bool = True
    faded: Annotated[BoolArray, "n"] | None = None


def row_axes(
    rows: int, columns: int, bands: int = 1, narrow: int = 0
) -> tuple[Figure, list[list[Axes]]]:
    """A figure of `bands` times `columns` panels whose vertical axis are the rows.

    The first `narrow` panels of a band hold ellipses and are narrower.
    """
    height = min(bands * (_BESIDE_IN + _ROW_IN * max(rows, 2)) + 0.3, _HIGHEST_IN)
    figure = new_figure(TWO_COLUMNS_IN, height)
    ratios = [0.55] * narrow + [1.0] * (columns - narrow)
    grid = figure.subplots(bands, columns, sharey=True, squeeze=False, width_ratios=ratios)
    return figure, [list(band) for band in grid]


def name_rows(ax: Axes, names: Sequence[str], bands: int = 1) -> None:
    """Names of the rows from the top down; numbers where they would touch each other."""
    count = len(names)
    ax.set_ylim(count - 0.4, -0.6)
    room = min(_HIGHEST_IN / bands - _BESIDE_IN, _ROW_IN * max(count, 2))
    if room / count < _LEAST_ROW_IN:
        ax.set_ylabel("row of the table")
        ax.set_yticks(range(0, count, -(-count // 10)))
        ax.set_yticklabels([str(number + 1) for number in range(0, count, -(-count // 10))])
        return
    ax.set_yticks(range(count), [_short(name) for name in names], parse_math=False)


def _short(name: str) -> str:
    if len(name) <= _MOST_LETTERS:
        return name
    half = (_MOST_LETTERS - 1) // 2
    return f"{name[:half]}…{name[-half:]}"


def draw_elements(
    axes: Sequence[Axes],
    series: Sequence[Series],
    symbol: str,
    unit: str,
    *,
    part: Literal["all", "upper", "diagonal"] = "all",
) -> None:
    """Element by element, row by row: a dot with its interval for each series.

    Parameters
    ----------
    axes : sequence of Axes
        One for each element, row by row.
    series : sequence of Series
        Drawn a little above one another.
    symbol, unit : str
        Such as ``K``, ``N/m``.
    part : {"all", "upper", "diagonal"}
        Which elements.
    """
    k, count = series[0].matrices.shape[1], len(series[0].matrices)
    wanted = {"all": lambda *_: True, "upper": le, "diagonal": eq}[part]
    places = [(i, j) for i in range(k) for j in range(k) if wanted(i, j)]
    shift = 0.0 if len(series) == 1 else 0.14
    for ax, (i, j) in zip(axes, places, strict=True):
        ax.axvline(0.0, color="0.85", linewidth=0.6, zorder=0)
        for number, one in enumerate(series):
            at = np.arange(count, dtype=float) + shift * (2 * number - len(series) + 1)
            _draw_series(ax, at, one, one.matrices[:, i, j], one.half[:, i, j])
        ax.set_xlabel(f"{element_text(f'{symbol}_{i + 1}{j + 1}')} ({unit_text(unit)})")
        ax.xaxis.set_major_locator(few_ticks(2))
        ax.tick_params(axis="y", length=0)


def _draw_series(
    ax: Axes, at: FloatArray, one: Series, value: FloatArray, half: FloatArray
) -> None:
    faded = np.zeros(len(at), dtype=bool) if one.faded is None else one.faded
    small = 2.2 if len(at) > 30 else 3.2
    for rows, marker, label in ((~faded, "o", one.label), (faded, "s", "extrapolated")):
        if not rows.any():
            continue
        ax.errorbar(
            value[rows],
            at[rows],
            xerr=half[rows],
            fmt=marker,
            color=one.color,
            mfc=one.color if one.filled and marker == "o" else "white",
            markersize=small,
            mew=0.8,
            elinewidth=0.8,
            label=label,
        )


def draw_ellipses(ax: Axes, series: Sequence[Series], symbol: str) -> None:
    """The ellipse of each row in its own shape, all to one scale; a cross where there is none."""
    from matplotlib.collections import EllipseCollection

    # The outline is K_s u, |u| = 1, of the symmetric part: half-axes are its principal values.
    decompositions = [
        np.linalg.eigh((m + m.transpose(0, 2, 1)) / 2) for m in (s.matrices for s in series)
    ]
    # What is extrapolated may be a hundred times larger, and would make all others specks.
    kept = [np.ones(len(s.matrices), bool) if s.faded is None else ~s.faded for s in series]
    eigenvalues = [
        v[rows] if rows.any() else v for (v, _), rows in zip(decompositions, kept, strict=True)
    ]
    largest = max(float(np.abs(values).max()) for values in eigenvalues) or 1.0
    for one, (values, vectors) in zip(series, decompositions, strict=True):
        definite = values[:, 0] > 0
        width, height = 0.94 * values[definite].T / largest
        at = np.column_stack([np.zeros(len(values)), np.arange(len(values))])
        ax.add_collection(
            EllipseCollection(
                width,
                height,
                np.degrees(np.arctan2(vectors[definite, 1, 0], vectors[definite, 0, 0])),
                units="y",
                offsets=at[definite],
                offset_transform=ax.transData,
                facecolors="none",
                edgecolors=one.color,
                linewidths=0.9,
                linestyles="-" if one.filled else (0, (3, 1.2)),
            )
        )
        ax.plot(*at[~definite].T, "x", color=one.color, markersize=4)
    ax.set(xlim=(-1, 1), xticks=[])
    ax.set_xlabel(symbol)
    ax.spines["bottom"].set_visible(False)
    ax.tick_params(axis="y", length=0)


# A table as a figure, for print beside the figures that it belongs to.

ROW_IN: Final = 0.165
#: Part of the width that the rows' names take.
_NAMES: Final = 0.22


@dataclass(frozen=True)
class DrawnRow:
    """A row: its name, one text per column, and whether it is the one to read first."""

    name: str
    cells: tuple[str, ...]
    strong: bool = False


@dataclass(frozen=True)
class TableBlock:
    """Rows under one heading."""

    heading: str
    rows: tuple[DrawnRow, ...]


def plot_table(
    header: Sequence[str],
    blocks: Sequence[TableBlock],
    ax: Axes | None = None,
    widths: Sequence[float] | None = None,
) -> Axes:
    """Draw blocks of rows under a common header, numbers to the right.

    Parameters
    ----------
    header : sequence of str
        One per column of numbers.
    blocks : sequence of TableBlock
        The blocks, from the top down.
    ax : Axes, optional
        Where to draw; without it a new figure is made.
    widths : sequence of float, optional
        Of the columns, relative to each other; all alike by default.

    Returns
    -------
    Axes
        The axes that hold the table.

    Raises
    ------
    InputError
        A row with another number of cells than the header.
    """
    for block in blocks:
        for row in block.rows:
            if len(row.cells) != len(header):
                problem = f"{block.heading}, {row.name}: {len(row.cells)} cells"
                raise InputError(problem, expected=f"{len(header)}, as the header has")
    lines = 1.3 + sum(1.2 + len(block.rows) for block in blocks)
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, ROW_IN * lines + 0.1) if ax is None else ax
        ax.set(xlim=(0, 1), ylim=(lines, 0))
        ax.axis("off")
        shares = np.cumsum(np.ones(len(header)) if widths is None else widths)
        places = [_NAMES + (1 - _NAMES) * float(share / shares[-1]) for share in shares]
        points = _points()
        _rule(ax, 0.0, 1.0)
        for x, text in zip(places, header, strict=True):
            ax.text(x, 0.65, element_text(text), ha="right", va="center", fontsize=points)
        _rule(ax, 1.3, 0.8)
        at = 1.3
        for block in blocks:
            ax.text(0.0, at + 0.7, block.heading, va="center", weight="bold", fontsize=points)
            at += 1.2
            for row in block.rows:
                _draw_row(ax, row, at + 0.5, places)
                at += 1.0
            _rule(ax, at, 0.4)
        _rule(ax, at, 1.0)
    return ax


def _points() -> float:
    """Letters of a table: a little smaller than a figure's, so that its columns stay apart."""
    from matplotlib import rcParams

    return 0.92 * float(rcParams["font.size"])


def _draw_row(ax: Axes, row: DrawnRow, at: float, places: Sequence[float]) -> None:
    look: dict[str, Any] = {"weight": "bold" if row.strong else "normal", "fontsize": _points()}
    ax.text(0.015, at, row.name, va="center", **look)
    for x, text in zip(places, row.cells, strict=True):
        ax.text(x, at, text, ha="right", va="center", **look)


def _rule(ax: Axes, at: float, linewidth: float) -> None:
    ax.plot([0, 1], [at, at], color="black", linewidth=linewidth, clip_on=False)
