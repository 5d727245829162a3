"""Restless motion: every joint to and fro about a middle, as wide and fast as in people."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.body.draft import Draft
from manipulandum_sim.body.segments import SIDES

Waves = Mapping[str, tuple[float, float, float, float]]

#: Restless motion about a middle, by joint: middle, amplitude (rad), lowest and highest Hz.
ARM_WAVES: Final = {
    "shoulder_flexion": (0.60, 0.60, 0.2, 1.0),
    "shoulder_abduction": (0.55, 0.38, 0.2, 1.0),
    "shoulder_rotation": (0.10, 0.55, 0.2, 1.1),
    "elbow_flexion": (1.00, 0.60, 0.2, 1.2),
    "wrist_radial": (0.0, 0.32, 0.5, 1.8),
    "wrist_flexion": (0.0, 0.75, 0.4, 1.7),
}
LEG_WAVES: Final = {
    "hip_flexion": (0.62, 0.45, 0.2, 1.0),
    "hip_abduction": (0.28, 0.30, 0.2, 1.0),
    "hip_rotation": (0.0, 0.38, 0.3, 1.2),
    "knee_flexion": (1.10, 0.50, 0.3, 1.3),
    "ankle_dorsiflexion": (0.05, 0.38, 0.4, 1.7),
    "ankle_inversion": (0.0, 0.32, 0.4, 1.7),
}
TRUNK_WAVES: Final = {
    "flexion": (0.12, 0.24, 0.2, 0.9),
    "bend_right": (0.0, 0.24, 0.2, 0.9),
    "twist_left": (0.0, 0.38, 0.2, 1.0),
}
NECK_WAVES: Final = {
    "flexion": (0.0, 0.34, 0.2, 1.1),
    "bend_right": (0.0, 0.32, 0.2, 1.1),
    "twist_left": (0.0, 0.60, 0.2, 1.2),
}
PELVIS_WAVES: Final = {
    "rz": (0.0, 0.26, 0.2, 0.8),
    "ry": (0.02, 0.18, 0.2, 0.8),
    "rx": (0.0, 0.16, 0.2, 0.8),
}
#: Nobody holds a joint quite still: this part of the restless motion is in all others.
BACKGROUND_PART: Final = 0.10


def restless(d: Draft, on: FloatArray, part: str, waves: Waves, size: float = 1.0) -> None:
    """Every angle of a part of the body to and fro about its middle, scaled by `size`."""
    for name, (middle, amplitude, low_hz, high_hz) in waves.items():
        d.add(f"{part}_{name}", size * on * (middle + d.waves(amplitude, low_hz, high_hz)))


def restless_above(d: Draft, on: FloatArray) -> None:
    """Trunk, head and arms."""
    restless(d, on, "trunk", TRUNK_WAVES)
    restless(d, on, "neck", NECK_WAVES)
    for side in SIDES:
        restless(d, on, side, ARM_WAVES)


def background(d: Draft) -> None:
    """The small motions that go along with every motion."""
    on = d.during()
    parts: dict[str, Waves] = {"trunk": TRUNK_WAVES, "neck": NECK_WAVES, "pelvis": PELVIS_WAVES}
    parts |= dict.fromkeys(SIDES, ARM_WAVES)
    for part, waves in parts.items():
        restless(d, on, part, waves, BACKGROUND_PART)
