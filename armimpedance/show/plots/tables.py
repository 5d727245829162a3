"""A table as a figure, for print beside the figures that it belongs to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.show.plots.style import TWO_COLUMNS_IN, new_axes, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROW_IN: Final = 0.165
#: Part of the width that the rows' names take.
_NAMES: Final = 0.22


@dataclass(frozen=True)
class TableRow:
    """A row: its name, one text per column, and whether it is the one to read first."""

    name: str
    cells: tuple[str, ...]
    strong: bool = False


@dataclass(frozen=True)
class TableBlock:
    """Rows under one heading."""

    heading: str
    rows: tuple[TableRow, ...]


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
            ax.text(x, 0.65, text, ha="right", va="center", fontsize=points)
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


def _draw_row(ax: Axes, row: TableRow, at: float, places: Sequence[float]) -> None:
    look: dict[str, Any] = {"weight": "bold" if row.strong else "normal", "fontsize": _points()}
    ax.text(0.015, at, row.name, va="center", **look)
    for x, text in zip(places, row.cells, strict=True):
        ax.text(x, at, text, ha="right", va="center", **look)


def _rule(ax: Axes, at: float, linewidth: float) -> None:
    ax.plot([0, 1], [at, at], color="black", linewidth=linewidth, clip_on=False)
