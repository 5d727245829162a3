"""Places of axes that are found once per figure and come out the same, to the bit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Decimals of places in the figure; a hundred-thousandth of a pixel.
_DECIMALS: Final = 9


@contextmanager
def settled(figure: Figure, dpi: float) -> Iterator[None]:
    """Inside the block the axes stay where the layout puts them on paper of this resolution.

    Matplotlib would lay a figure out anew, and draw it twice, for each format. Each format now
    shows the same places, whichever others are written.

    Parameters
    ----------
    figure : Figure
        Left as it is where it has no layout.
    dpi : float
        Dots per inch at which letters are measured.

    Returns
    -------
    context manager
    """
    engine = figure.get_layout_engine()
    if engine is None or not figure.axes:
        yield
        return
    before = [(ax, ax.get_position(original=True)) for ax in figure.axes if ax.get_in_layout()]
    # matplotlib, too, leaves the axes where they are where there is no room for them
    with _on_paper(figure, dpi), suppress(ValueError):
        engine.execute(figure)
    for ax, _ in before:
        # The solver leaves last bits that depend on what was drawn before, and an SVG names its
        # clipping boxes after all bits.
        _place(ax, np.round(ax.get_position(original=True).bounds, _DECIMALS))
    # the name "none" would leave an engine that does nothing, and the figure be drawn twice for it
    figure.set_layout_engine(None)
    try:
        yield
    finally:
        figure.set_layout_engine(engine)
        # from where the layout begins depends where it ends, a little
        for ax, place in before:
            _place(ax, place.bounds)


@contextmanager
def _on_paper(figure: Figure, dpi: float) -> Iterator[None]:
    """A canvas of its own: a window that shows the figure must not change its size."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas: Any = figure.canvas
    before = figure.dpi
    FigureCanvasAgg(figure)
    figure.set_dpi(dpi)
    try:
        yield
    finally:
        figure.set_dpi(before)
        figure.set_canvas(canvas)


def _place(ax: Axes, bounds: Sequence[float]) -> None:
    ax.set_position(tuple(bounds))  # type: ignore[arg-type]
    # an axes that is placed by hand leaves the layout
    ax.set_in_layout(True)
