"""The look of groups in a picture: colours, and line styles for prints without colour.

The number of a group in its results decides how it looks, so that a condition has the same colour
and line in every picture of these results.
"""

from __future__ import annotations

from typing import Any, Final

from armimpedance.show.plots.style import LINE_STYLES, OKABE_ITO

#: In this order two groups of one line differ by 12 in CIE lightness: they are told apart in grey.
_COLORS: Final = tuple(OKABE_ITO[name] for name in ("blue", "orange", "vermillion", "sky", "green"))
#: As many groups look different.
MOST_LOOKS: Final = len(_COLORS) * 2


def look(number: int, color: str | None = None) -> dict[str, Any]:
    """Colour and line of a group.

    `number`: from 0. `color`: instead of that of the cycle.
    """
    n = len(_COLORS)
    style = LINE_STYLES[(number + number // n) % len(LINE_STYLES)]
    return {"color": _COLORS[number % n] if color is None else color, "linestyle": style}
