"""Words where a picture has room for them: names beside what they name, ticks that do not touch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import IdentityTransform

from armimpedance.core.arrays import FloatArray

#: Room for a tick's number (heights of a letter).
_ACROSS: Final = 5.5
_UP: Final = 2.5
#: Between a name and what it names, and steps outwards where there is no room (points).
_GAP_PT: Final = 3.0
_STEPS: Final = 5
_STEP_PT: Final = 8.0
#: Directions in which a name may stand, the usual ones first (degrees).
_DIRECTIONS: Final = (0, 180, 90, 270, 45, 135, 315, 225)


class RoomyLocator(MaxNLocator):
    """Round numbers along an axis, no more than there is room for."""

    def __call__(self) -> Any:
        """The places of the ticks, as long as the axis is now."""
        axis: Any = self.axis
        across = axis.axis_name == "x"
        box = axis.axes.bbox
        length_in = (box.width if across else box.height) / axis.axes.figure.dpi
        letters_in = axis.get_tick_params().get("labelsize", 8.0) / 72
        each = _ACROSS if across else _UP
        self.set_params(nbins=int(np.clip(length_in / (each * letters_in), 1, 6)))
        return super().__call__()


class NamesBeside(Artist):
    """Names beside outlines, where they cover neither one another nor other words.

    They are placed when the picture is drawn: its layout, size and limits are known only then.

    Parameters
    ----------
    texts : sequence of str
    outlines : sequence of (n, 2)
        What each names, in the unit of the axes.
    """

    def __init__(self, texts: Sequence[str], outlines: Sequence[FloatArray]) -> None:
        super().__init__()
        self._outlines = [np.asarray(outline, dtype=float) for outline in outlines]
        self.texts = [Text(0, 0, t, va="center", ha="center", parse_math=False) for t in texts]
        self.set_zorder(4)
        # the layout keeps room for what stands outside the axes; names stand inside
        self.set_in_layout(False)

    def get_children(self) -> list[Artist]:
        """The names themselves."""
        return list(self.texts)

    def draw(self, renderer: Any) -> None:
        """Place the names, then draw them."""
        ax: Any = self.axes
        if not self.get_visible() or ax is None:
            return
        point = ax.figure.dpi / 72
        taken = [np.array(text.get_window_extent(renderer).extents) for text in _others(ax)]
        drawn = [ax.transData.transform(outline) for outline in self._outlines]
        for text, outline in zip(self.texts, drawn, strict=True):
            if text.figure is None:
                text.set_figure(ax.get_figure(root=True))
            text.set_transform(IdentityTransform())
            half = _half(text, renderer)
            centre, start, step = _placed(half, outline, drawn, taken, ax.bbox, point)
            taken.append(np.concatenate([centre - half, centre + half]))
            text.set_position(tuple(centre))
            if step > 1:
                line = Line2D(*_lead(start, centre, half), color="0.6", linewidth=0.5)
                line.set_transform(IdentityTransform())
                line.set_figure(text.figure)
                line.draw(renderer)
            text.draw(renderer)


def _placed(
    half: FloatArray,
    outline: FloatArray,
    others: Sequence[FloatArray],
    taken: Sequence[FloatArray],
    inside: Any,
    point: float,
) -> tuple[FloatArray, FloatArray, int]:
    """Centre of a word of this half size, the point that it stands beside (pixels), how far.

    The first place that covers no word and no outline; else the one that covers least.
    """
    best, least = (outline[0], outline[0], 0), np.inf
    for step in range(_STEPS):
        for degrees in _DIRECTIONS:
            e = np.array([np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))])
            start = outline[int((outline @ e).argmax())]
            centre = start + e * (_GAP_PT + _STEP_PT * step) * point + np.sign(e.round(9)) * half
            box = np.concatenate([centre - half, centre + half])
            cost = _cost(box, taken, others, inside)
            if cost < least:
                best, least = (centre, start, step), cost
            if cost == 0:
                return best
    return best


def _cost(
    box: FloatArray, taken: Sequence[FloatArray], outlines: Sequence[FloatArray], inside: Any
) -> float:
    """Cost of a label in this box: overlaps with words and the axes' edge weigh more than lines."""
    out = max(inside.x0 + 2 - box[0], inside.y0 + 2 - box[1], 0.0)
    out = max(out, box[2] - inside.x1, box[3] - inside.y1)
    words = sum(_shared(box, other) for other in taken)
    covered = sum(int(((o > box[:2] - 1) & (o < box[2:] + 1)).all(axis=1).any()) for o in outlines)
    return 100.0 * (out > 0) + 10.0 * words + 0.1 * covered


def _shared(one: FloatArray, other: FloatArray) -> float:
    """The smaller box's share that two boxes have in common; 0 where they are apart."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    up = min(one[3], other[3]) - max(one[1], other[1])
    if across <= 0 or up <= 0:
        return 0.0
    least = min((b[2] - b[0]) * (b[3] - b[1]) for b in (one, other))
    return 0.1 + float(across * up / max(least, 1e-9))


def _lead(start: FloatArray, centre: FloatArray, half: FloatArray) -> FloatArray:
    """A line from the outline to the edge of the word's box, (2, 2): x and y of both ends."""
    way = start - centre
    inside = float(np.min(half / np.maximum(np.abs(way), 1e-9)))
    return np.array([start, centre + min(inside, 1.0) * way]).T


def _half(text: Text, renderer: Any) -> FloatArray:
    """Half the width and height of a word (pixels)."""
    box = text.get_window_extent(renderer)
    return np.array([box.width, box.height]) / 2


def _others(ax: Any) -> list[Any]:
    """Words that stand in the axes already."""
    from matplotlib.text import Text

    mine = {
        id(text) for names in ax.artists if isinstance(names, NamesBeside) for text in names.texts
    }
    drawn = [text for text in ax.findobj(Text) if id(text) not in mine]
    return [text for text in drawn if text.get_visible() and text.get_text().strip()]
