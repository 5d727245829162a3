"""Letters that a caption refers to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def panel_letters(axes: Sequence[Axes]) -> None:
    """(a), (b), ... in bold above the left upper corner of each panel.

    Parameters
    ----------
    axes : sequence of Axes
        In the order of the letters.
    """
    for number, ax in enumerate(axes):
        ax.annotate(
            f"({chr(ord('a') + number)})",
            (0.0, 1.0),
            (-2.0, 3.0),
            xycoords="axes fraction",
            textcoords="offset points",
            fontweight="bold",
            ha="right",
            va="bottom",
            annotation_clip=False,
        )
