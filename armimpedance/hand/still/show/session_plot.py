"""Plot of M and K over a session, block by block of its trials."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.departures import session_blocks
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import OKABE_ITO, ONE_COLUMN_IN, new_figure, print_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LOOKS = {"M": ("blue", "o", 0), "K": ("vermillion", "s", 2)}


def plot_session(recording: Recording, ax: Axes | None = None) -> Axes:
    """Draw inertia and stiffness of blocks of trials relative to the whole session's.

    All conditions together, each block with its 95 % interval. Inertia does not change while a
    person is measured: if M changes, a gain has changed, or the person. K may change.

    Parameters
    ----------
    recording : Recording
        Of a hand or of joints under disturbances that return.
    ax : Axes, optional
        Default: a figure of its own, as wide as a column of print.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        No condition has enough trials to be fitted.

    Examples
    --------
    >>> from armimpedance.hand.still.show import plot_session
    >>> from manipulandum_sim.hand import simulate
    >>> session, _ = simulate("cocontraction", seed=1, sets=1)
    >>> plot_session(session).get_xlabel()
    'trial in the order of the session'
    """
    blocks = session_blocks(recording)
    if blocks is None:
        raise InputError("no condition that can be fitted", expected="four trials of one or more")
    with print_style():
        if ax is None:
            ax = new_figure(ONE_COLUMN_IN, 2.2).subplots()
        middle = (blocks.first + blocks.last) / 2
        apart = 0.12 * float(np.median(blocks.last - blocks.first + 1))
        ax.axhline(100, color="0.75", linewidth=0.8, zorder=0)
        for symbol, (color, marker, row) in _LOOKS.items():
            ax.errorbar(
                middle + (apart if symbol == "K" else -apart),
                100 * blocks.sizes[:, row],
                100 * t_factor(np.inf) * blocks.sd[:, row],
                color=OKABE_ITO[color],
                marker=marker,
                markersize=3.5,
                linewidth=0.8,
                capsize=1.5,
                label=symbol,
            )
        ax.set_xlabel("trial in the order of the session")
        ax.set_ylabel("% of the whole session's")
        ax.legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1, 1), borderpad=0)
    return ax
