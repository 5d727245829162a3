"""A drawn joint: inertia, viscosity, stiffness of a human elbow or ankle, told to nobody."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.lab.benchmark import Group

UNITS = {"I": "kg m^2", "B": "N m s/rad", "K": "N m/rad", "G": "N m s/rad"}
COLUMNS = """
Columns of `samples`: trial, time_s, q1_rad, tau1_Nm (torque **by the limb on the device**, so the
one on the limb is its negative); further columns of the device are named in `samples` itself.
"""


@dataclass(frozen=True)
class DrawnJoint:
    """I (kg m^2), B (N m s/rad), K (N m/rad) of a joint that swings at 1.5 to 4 Hz, half damped."""

    I: float  # noqa: E741
    B: float
    K: float

    @classmethod
    def of(cls, rng: np.random.Generator) -> DrawnJoint:
        """A joint of that kind."""
        inertia, own_hz, damping = (
            rng.uniform(0.05, 0.12),
            rng.uniform(1.5, 4.0),
            rng.uniform(0.2, 0.6),
        )
        omega = 2 * np.pi * own_hz
        return cls(inertia, 2 * damping * omega * inertia, omega**2 * inertia)

    @property
    def groups(self) -> tuple[Group, ...]:
        """I, B, K, each a group of its own."""
        return tuple(scalar(name, getattr(self, name)) for name in "IBK")


def scalar(name: str, value: float) -> Group:
    """One number of a joint."""
    return Group(name, UNITS[name], {name: value})
