"""Figures of the plots room as SVG texts for a page."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING, Final

import numpy as np
import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.show.pages.page import Picture
from armimpedance.show.plots import print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.figure import Figure

#: Lines of more points than this together are drawn as an image: nobody tells them apart, and a
#: session's page would hold megabytes of them.
MOST_POINTS: Final = 4000
DOTS_PER_INCH: Final = 150
#: The points of a picture with more of them than this are not held beside it.
MOST_HELD: Final = 20_000


def picture(drawn: Figure | Axes, name: str, caption: str) -> Picture:
    """A drawing as it stands on the page.

    Parameters
    ----------
    drawn : Figure or Axes
        What a function of `plots` returned.
    name : str
        File name under which a reader saves it, without an ending.
    caption : str

    Returns
    -------
    Picture

    Raises
    ------
    InputError
        The axes belong to no figure.
    """
    from matplotlib.figure import Figure

    figure = drawn if isinstance(drawn, Figure) else drawn.get_figure(root=True)
    if not isinstance(figure, Figure):
        raise InputError("axes of no figure", expected="axes that a figure holds")
    _thin(figure)
    text = StringIO()
    with print_style():
        metadata = {"Date": None, "Creator": "armimpedance"}
        figure.savefig(text, format="svg", dpi=DOTS_PER_INCH, metadata=metadata)
    return Picture(name, text.getvalue(), caption, _points_of(figure))


def _points_of(figure: Figure) -> pd.DataFrame | None:
    """The points of every line with a name of its panel; None where there are very many."""
    rows = []
    for number, ax in enumerate(figure.axes, start=1):
        panel = f"{number}: {ax.get_ylabel()} over {ax.get_xlabel()}"
        for line in ax.lines:
            label = str(line.get_label())
            xy = np.asarray(line.get_xydata(), dtype=float)
            rows.append(
                pd.DataFrame({"x": xy[:, 0], "y": xy[:, 1]}).assign(panel=panel, line=label)
            )
    if not rows or sum(map(len, rows)) > MOST_HELD:
        return None
    return pd.concat(rows, ignore_index=True)[["panel", "line", "x", "y"]]


def _thin(figure: Figure) -> None:
    """Draw what has very many points as an image inside the drawing."""
    for ax in figure.axes:
        heavy = sum(np.size(line.get_xdata()) for line in ax.lines) > MOST_POINTS
        for line in ax.lines if heavy else ():
            line.set_rasterized(True)
        for collection in ax.collections:
            if _points(collection) > MOST_POINTS:
                collection.set_rasterized(True)


def _points(collection: Collection) -> int:
    """Points of all lines of a collection, or of its markers."""
    lines = sum(np.shape(path.vertices)[0] for path in collection.get_paths())
    return max(lines, np.shape(collection.get_offsets())[0])
