"""Places of many axes that come out the same, to the bit, whenever a figure is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Decimals of places in the figure; a hundred-thousandth of a pixel.
_DECIMALS: Final = 9


def settle(figure: Figure) -> None:
    """Round what the constrained layout finds.

    Its solver leaves last bits that depend on what was drawn before, and an SVG names its clipping
    boxes after all bits.
    """
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    class SettledLayout(ConstrainedLayoutEngine):
        def execute(self, fig: Figure) -> None:
            super().execute(fig)
            for ax in fig.axes:
                x, y, width, height = np.round(ax.get_position(original=True).bounds, _DECIMALS)
                ax.set_position((x, y, width, height))
                # an axes that is placed by hand leaves the layout
                ax.set_in_layout(True)

    figure.set_layout_engine(SettledLayout())
