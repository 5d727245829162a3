"""The segments and markers of an arm on a trunk, as the elbow's examination needs them."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.hand import (
    FOREARM_HAND_COM,
    FOREARM_HAND_GYRATION,
    FOREARM_HAND_MASS,
    FOREARM_LENGTH,
    UPPER_ARM_COM,
    UPPER_ARM_GYRATION,
    UPPER_ARM_MASS,
)

# Winter, Table 4.1 and Fig. 4.1 (see `subjects`); trunk from the hips to the shoulders.
UPPER_ARM_LENGTH: Final = 0.186
TRUNK_MASS: Final = 0.497
TRUNK_COM: Final = 0.50
TRUNK_LENGTH: Final = 0.818 - 0.530
SHOULDER_HALF_BREADTH: Final = 0.129
HIP_HALF_BREADTH: Final = 0.0955
HAND_LENGTH: Final = 0.108
#: (mass, centre, radius of gyration) of forearm and hand apart.
FOREARM: Final = (0.016, 0.430, 0.303)
HAND: Final = (0.006, 0.506, 0.297)
# Winter gives no radius about the long axis; de Leva (1996), Table 4, men.
UPPER_ARM_LONG: Final = 0.158
FOREARM_LONG: Final = 0.121

SHOULDER: Final = (
    "right_shoulder_flexion",
    "right_shoulder_abduction",
    "right_shoulder_rotation",
)
ELBOW: Final = "right_elbow_flexion"
WRIST: Final = "right_wrist_flexion"


def arm_lengths(height_m: float) -> tuple[float, float]:
    """Lengths of the upper arm, and from the elbow to the middle of the hand, m."""
    return UPPER_ARM_LENGTH * height_m, (FOREARM_LENGTH + HAND_LENGTH / 2) * height_m


def rod(mass: float, length: float, centre: float, gyration: float, long: float) -> dict:
    """Mass, centre and inertia of a limb along -z, radii as fractions of its length."""
    square = mass * length**2 * np.array([gyration, gyration, long]) ** 2
    return {
        "mass_kg": mass,
        "com_m": np.array([0.0, 0.0, -centre * length]),
        "inertia_kgm2": np.diag(square),
    }


def _trunk(mass_kg: float, height_m: float) -> Segment:
    """A cylinder of the hips' breadth; its motion is prescribed, its inertia plays no part."""
    length, radius = TRUNK_LENGTH * height_m, HIP_HALF_BREADTH * height_m
    mass = TRUNK_MASS * mass_kg
    across = mass * (3 * radius**2 + length**2) / 12
    return Segment(
        "trunk",
        None,
        np.zeros(3),
        (),
        mass,
        np.array([0.0, 0.0, TRUNK_COM * length]),
        np.diag([across, across, mass * radius**2 / 2]),
    )


def _upper_arm(mass_kg: float, height_m: float) -> Segment:
    axes = ([0, -1, 0], [-1, 0, 0], [0, 0, 1])
    hinges = tuple(Hinge(n, np.array(a, float)) for n, a in zip(SHOULDER, axes, strict=True))
    place = np.array([0.0, -SHOULDER_HALF_BREADTH, TRUNK_LENGTH]) * height_m
    length, mass = UPPER_ARM_LENGTH * height_m, UPPER_ARM_MASS * mass_kg
    body = rod(mass, length, UPPER_ARM_COM, UPPER_ARM_GYRATION, UPPER_ARM_LONG)
    return Segment("right_upper_arm", "trunk", place, hinges, **body)


def _forearms(mass_kg: float, height_m: float, wrist: bool) -> tuple[Segment, ...]:
    """Forearm and hand as one body, or as two."""
    length = FOREARM_LENGTH * height_m
    elbow = np.array([0.0, 0.0, -UPPER_ARM_LENGTH * height_m])
    bend = np.array([0.0, -1.0, 0.0])
    hinge, upper = (Hinge(ELBOW, bend),), "right_upper_arm"
    if not wrist:
        mass = FOREARM_HAND_MASS * mass_kg
        body = rod(mass, length, FOREARM_HAND_COM, FOREARM_HAND_GYRATION, FOREARM_LONG)
        return (Segment("right_forearm", upper, elbow, hinge, **body),)
    share, centre, gyration = FOREARM
    alone = rod(share * mass_kg, length, centre, gyration, FOREARM_LONG)
    share, centre, gyration = HAND
    hand = rod(share * mass_kg, HAND_LENGTH * height_m, centre, gyration, FOREARM_LONG)
    end = np.array([0.0, 0.0, -length])
    return (
        Segment("right_forearm", upper, elbow, hinge, **alone),
        Segment("right_hand", "right_forearm", end, (Hinge(WRIST, bend),), **hand),
    )


def _markers(height_m: float, wrist: bool) -> tuple[MarkerSite, ...]:
    """The eight of the source's Fig. 3, on the skin some centimetres off the bones' axes."""
    upper, fore = UPPER_ARM_LENGTH * height_m, FOREARM_LENGTH * height_m
    top, side = TRUNK_LENGTH * height_m, SHOULDER_HALF_BREADTH * height_m
    knuckle = HAND_LENGTH / 2 * height_m
    hand = ("right_hand", -knuckle) if wrist else ("right_forearm", -fore - knuckle)
    sites: dict[str, tuple[str, list[float]]] = {
        "acromion_right": ("trunk", [0.0, -side, top + 0.03]),
        "acromion_left": ("trunk", [0.0, side, top + 0.03]),
        "upper_arm": ("right_upper_arm", [0.01, -0.045, -2 / 3 * upper]),
        "epicondyle": ("right_upper_arm", [0.0, -0.04, -upper]),
        "forearm": ("right_forearm", [-0.01, -0.035, -2 / 3 * fore]),
        "hand": (hand[0], [-0.02, 0.0, hand[1]]),
        "iliac_right": ("trunk", [0.05, -HIP_HALF_BREADTH * height_m, 0.08]),
        "iliac_left": ("trunk", [0.05, HIP_HALF_BREADTH * height_m, 0.08]),
    }
    return tuple(MarkerSite(n, segment, np.array(p)) for n, (segment, p) in sites.items())


def arm_skeleton(mass_kg: float, height_m: float, *, wrist: bool = False) -> Skeleton:
    """Trunk (floating), right upper arm, right forearm with hand, and the markers.

    Parameters
    ----------
    mass_kg, height_m : float
    wrist : bool
        Hand and forearm are two bodies.

    Raises
    ------
    InputError
        A number that no body has.
    """
    for name, value, most in (("mass in kg", mass_kg, 400.0), ("height in m", height_m, 3.0)):
        if not (np.isfinite(value) and 0 < value <= most):
            raise InputError(f"{name} is {value}", expected=f"more than 0 and at most {most:g}")
    segments = (
        _trunk(mass_kg, height_m),
        _upper_arm(mass_kg, height_m),
        *_forearms(mass_kg, height_m, wrist),
    )
    return Skeleton(segments, _markers(height_m, wrist))


#: Relaxed shoulder and wrist; the elbow-only subjects' shoulder has no friction.
