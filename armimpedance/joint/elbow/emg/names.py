"""Does each muscle pull the way its name says? The torque that the subject holds tells.

A limb that is held still pushes against the device by what its muscles and its weight do, so the
muscles' mean torque, trial by trial, is linear in their activation: it rises with a flexor's and
falls with an extensor's. Names that were exchanged change only whose slope is whose in K and B,
where both are positive; here the signs are exchanged.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.joint.elbow.emg.law_result import LinearLaw
from armimpedance.joint.elbow.emg.roles import Action, roles_of
from armimpedance.numerics.regression import t_factor

#: Level at which a slope's sign is sure.
SURE: Final = 0.998
_NAME: Final = "muscles"
_WHAT_TO_DO: Final = (
    "look at which electrode is on which muscle, and whether flexion is the positive direction of "
    "angle and torque"
)


def check_names(law: LinearLaw, roles: Mapping[str, Action] | None = None) -> Finding:
    """Hold the muscles' names against the signs of a law of their torque.

    Parameters
    ----------
    law : LinearLaw
        Of the limb's mean torque on the device, N m, flexion positive.
    roles : mapping of muscle to "flexor" or "extensor", optional
        For muscles whose names do not say it.

    Returns
    -------
    Finding
        "muscles".
    """
    try:
        sign = np.array([role.sign for role in roles_of(law.muscles, roles)], dtype=float)
    except InputError as error:
        return Finding(_NAME, "cannot tell", f"the names are not held against the torque: {error}")
    half = t_factor(law.parameters.dof, SURE) * law.parameters.sd[1:]
    smallest = f"{half.max():.2g} N m at the maximum contraction"
    pull = sign * law.slopes
    against = [
        _said(name, slope)
        for name, slope, sure in zip(law.muscles, law.slopes, pull < -half, strict=True)
        if sure
    ]
    if len(against) == len(pull):
        said = f"the muscles' names are exchanged: {', '.join(against)}; {_WHAT_TO_DO}"
        return Finding(_NAME, "warning", said, smallest)
    if against:
        said = f"not every electrode is on the muscle that it is named by: {', '.join(against)}"
        return Finding(_NAME, "warning", f"{said}; {_WHAT_TO_DO}", smallest)
    if (pull > half).all():
        return Finding(_NAME, "ok", "the torque that is held has the signs of the names", smallest)
    said = (
        "the subject holds too little torque to tell which electrode is on which muscle; add "
        "trials with the flexor, and with the extensor, held against a load"
    )
    return Finding(_NAME, "cannot tell", said, smallest)


def _said(name: str, slope: float) -> str:
    way = "flexion" if slope > 0 else "extension"
    return f"the torque that is held goes into {way} with {name} ({slope:+.3g} N m)"
