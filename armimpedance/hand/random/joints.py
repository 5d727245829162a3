"""What of a joint has to be told and can be wrong: whose torque, degrees, units."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.findings import warnings_of
from armimpedance.core.records import Recording
from armimpedance.numerics.criticism import check_joint_size
from armimpedance.numerics.signals import refuse_degrees

#: What is told of a torque that is the commanded one.
COMMANDED: Final = (
    "commanded torque: it holds what the motor was told, so that M, B and K are those of limb and "
    "device together"
)


def check_joints(recording: Recording) -> tuple[str, ...]:
    """Refuse a recording of joints that does not say enough; what is to be warned of.

    Raises
    ------
    InputError
        Angles in degrees, or a recording that does not say which torque it holds.
    """
    if recording.kind != "joint":
        return ()
    refuse_degrees(recording.position, tuple(f"q{i + 1}" for i in range(recording.axes)))
    if recording.torque is None:
        raise InputError(
            "it does not say which torque it holds",
            column="torque",
            expected='"interaction" (measured between limb and device) or "commanded" (the '
            "motor's: of limb and device together)",
        )
    return (COMMANDED,) if recording.torque == "commanded" else ()


def unlikely_units(one: ImpedanceEstimate) -> tuple[str, ...]:
    """A warning where the inertia is that of no joint of a person: a unit that is another."""
    if one.level != "joint":
        return ()
    M, sd = np.diag(one.inertia), np.diag(one.sd[0])
    found = (check_joint_size("inertia", m, s) for m, s in zip(M, sd, strict=True))
    return warnings_of(found)[:1]
