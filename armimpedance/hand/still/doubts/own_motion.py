"""Does the hand move as it is disturbed? What moves it otherwise is the person's own force.

Where the robot yields, own force moves the hand, and the measured force is the robot's answer to
that: least squares then finds the robot, not the limb. It shows in trials of the same disturbance,
whose motions are not alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from armimpedance.core.findings import Finding
from armimpedance.hand.still.doubts.model import Model
from armimpedance.hand.still.weighing.expected_motion import mean_of_others

#: Part of the motion's energy that has to repeat. Of servos of 1000, 300 and 100 N/m under nominal
#: noise .97, .8 and .6 do, and K by least squares is 4, 24 and 40 % off; of a robot that imposes a
#: force while the person pushes by 1 N .8, and M comes out negative.
LEAST_REPEATED: Final = 0.9


def check_own_motion(models: Sequence[Model]) -> tuple[Finding, ...]:
    """The finding "own motion"; empty without trials of the same disturbance.

    Parameters
    ----------
    models : sequence of Model
        Of the conditions.

    Returns
    -------
    tuple of Finding
        None or one.
    """
    found = [part for model in models if (part := _repeated(model)) is not None]
    if not found:
        return ()
    part = float(np.median(found))
    text = f"{100 * part:.0f} % of the hand's motion is that of its disturbance"
    smallest = f"{100 * (1 - LEAST_REPEATED):.0f} % of other motion"
    if part >= LEAST_REPEATED:
        return (Finding("own motion", "ok", text, smallest=smallest),)
    text += (
        ", the rest the person's own: the robot yields to it, and least squares finds the robot "
        "instead of the limb; take --method instruments or frequency, and more trials of each "
        "direction"
    )
    return (Finding("own motion", "warning", text, smallest=smallest),)


def _repeated(model: Model) -> float | None:
    """Part of the displacement's energy that other trials of the disturbance share; None: none."""
    labels = model.equation.disturbance
    if labels is None:
        return None
    counts = np.bincount(labels)[labels]
    shared = counts > 1
    if not shared.any():
        return None
    x = model.equation.motion[:, 2]
    others = mean_of_others(x, labels)
    size = np.maximum((others**2).sum(axis=(1, 2)), 1e-300)
    # the same course at another amplitude is the same disturbance
    along = np.maximum((x * others).sum(axis=(1, 2)), 0.0) / size
    # a trial differs from the mean of n - 1 others by n / (n - 1) times its own variance
    own = ((x - along[:, None, None] * others) ** 2).sum(axis=(1, 2)) * (counts - 1) / counts
    return float(1 - own[shared].sum() / (x[shared] ** 2).sum())
