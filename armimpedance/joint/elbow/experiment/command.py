"""Does the joint follow the recorded command? One that it does not follow is no instrument."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.joint.elbow.experiment.local_fit import explained_motion
from armimpedance.joint.elbow.stationary.band import Band, band_of
from armimpedance.joint.elbow.stationary.preparation import Prepared

#: A command that explains less of the angle's power is left out.
LEAST: Final = 0.1


def with_usable_command(prepared: Prepared) -> Prepared:
    """The same, without a command that the joint does not follow; a note says so.

    Parameters
    ----------
    prepared : Prepared

    Returns
    -------
    Prepared
    """
    samples = prepared.source
    if samples.command is None:
        return prepared
    share = follows(band_of(prepared, "command"))
    if share >= LEAST:
        return prepared
    note = f"the commanded angle explains {100 * max(share, 0.0):.0f} % of the motion: not used"
    return replace(prepared, source=replace(samples, command=None, notes=(*samples.notes, note)))


def follows(band: Band) -> float:
    """Part of the angle's power in the band that the command explains."""
    left = whole = 0.0
    for bins in band.trials:
        if bins.command is not None:
            error = bins.angle - explained_motion(bins.angle, bins.command)
            left += float((np.abs(error) ** 2).sum())
            whole += float((np.abs(bins.angle) ** 2).sum())
    return 1 - left / whole if whole else 0.0
