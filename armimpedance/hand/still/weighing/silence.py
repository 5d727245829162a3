"""Is there any noise to weigh by? Simulations may have none, a measurement always has some."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import by_axis
from armimpedance.core.records import Window

#: Force before the onset that changes by less than this part of the response is silent: the noise
#: of force sensors and of people is some hundreds of times as large.
SILENT: Final = 1e-4


def is_silent(window: Window) -> bool:
    """Whether force and rest show no noise at all.

    Weights from residuals would then follow what the model leaves unexplained, such as the
    curvature of the limb's law, as if it were noise.

    Parameters
    ----------
    window : Window

    Returns
    -------
    bool
        True where the force of every trial stays put before the onset.
    """
    rest = window.lag_s <= 0
    if rest.sum() < 3:
        return False
    force = by_axis(window.force)[np.tile(window.usable, window.axes)]
    force -= force[:, rest].mean(axis=1, keepdims=True)
    away = np.abs(force, out=force)
    return bool(away[:, rest].max() < SILENT * away.max())
