"""The bones, masses, inertias and markers of a body of 15 segments, all from `table`.

The pelvis is the table's lower part of the trunk (omphalion to mid-hip), the thorax its middle and
upper parts together.

The hinges give 36 coordinates and 128 base parameters: 10 of the pelvis, 9 of each of the ten
segments with two or three hinges (their mass counts as their parent's), 7 of each of the four with
one.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from manipulandum_sim.body.table import (
    ANKLE_HEIGHT,
    AXES_OF,
    DE_LEVA,
    HEEL_BEHIND_ANKLE,
    HIP_HALF_WIDTH,
    SHOULDER_ABOVE_HIP_MM,
    SHOULDER_HALF_WIDTH,
    TABLE_HEIGHT_MM,
)

#: Sign of y on a side.
SIDES: Final = {"right": -1, "left": 1}

# Hinges of the right side and of the middle, from the parent outwards; where the sign of the left
# side's axis differs, flexion, abduction and turning inwards stay positive on both sides.
_TRUNK: Final = (("flexion", (0, 1, 0)), ("bend_right", (1, 0, 0)), ("twist_left", (0, 0, 1)))
_BALL: Final = (("flexion", (0, -1, 0)), ("abduction", (-1, 0, 0)), ("rotation", (0, 0, 1)))
_JOINTS: Final = {
    "shoulder": _BALL,
    "elbow": (("flexion", (0, -1, 0)),),
    "wrist": (("radial", (0, -1, 0)), ("flexion", (1, 0, 0))),
    "hip": _BALL,
    "knee": (("flexion", (0, 1, 0)),),
    "ankle": (("dorsiflexion", (0, -1, 0)), ("inversion", (1, 0, 0))),
}
#: Each limb from its root outwards: segment, its joint.
_LIMBS: Final = (
    ("thorax", (("upper_arm", "shoulder"), ("forearm", "elbow"), ("hand", "wrist"))),
    ("pelvis", (("thigh", "hip"), ("shank", "knee"), ("foot", "ankle"))),
)

# Markers: fractions of the height in the segment's frame; y counts outwards on the limbs. 35.
_MIDDLE_MARKERS: Final = {
    "pelvis": {
        "right_asis": (0.055, -0.070, 0.055),
        "left_asis": (0.055, 0.070, 0.055),
        "right_psis": (-0.055, -0.028, 0.058),
        "left_psis": (-0.055, 0.028, 0.058),
    },
    "thorax": {
        "c7": (-0.045, 0.0, 0.255),
        "sternum": (0.070, 0.0, 0.160),
        "right_acromion": (-0.005, -0.115, 0.235),
        "left_acromion": (-0.005, 0.115, 0.235),
    },
    "head": {
        "forehead": (0.058, 0.0, 0.105),
        "right_temple": (0.005, -0.045, 0.100),
        "left_temple": (0.005, 0.045, 0.100),
    },
}
_LIMB_MARKERS: Final = {
    "upper_arm": {"upper_arm": (0.005, 0.030, -0.085), "epicondyle": (0.0, 0.024, -0.162)},
    "forearm": {"radius": (0.020, 0.0, -0.148), "ulna": (-0.019, 0.004, -0.146)},
    "hand": {"knuckle_2": (0.022, 0.010, -0.048), "knuckle_5": (-0.020, 0.010, -0.043)},
    "thigh": {"thigh": (0.020, 0.046, -0.120), "knee": (0.0, 0.032, -0.243)},
    "shank": {"shank": (0.020, 0.028, -0.110), "malleolus": (0.0, 0.022, -0.248)},
    "foot": {"heel": (-0.034, -0.008, -0.016), "metatarsal_5": (0.062, 0.028, -0.026)},
}

#: Mass, centre of mass (3,) and inertia about it (3, 3) of a segment.
Body = tuple[float, FloatArray, FloatArray]


def table_skeleton(mass_kg: float, height_m: float) -> Skeleton:
    """The 15 segments with 35 markers, all numbers from the table.

    Raises
    ------
    RecordError
        A number that is not finite.
    """
    unit = height_m / TABLE_HEIGHT_MM
    waist, neck = _waist_m(unit), (DE_LEVA["middle_trunk"], DE_LEVA["upper_trunk"])
    neck_m = unit * sum(row.length_mm for row in neck)
    thorax, head = (_hinges(part, _TRUNK, 1) for part in ("trunk", "neck"))
    segments = [
        Segment("pelvis", None, np.zeros(3), (), *_pelvis(mass_kg, unit)),
        Segment("thorax", "pelvis", np.array([0, 0, waist]), thorax, *_thorax(mass_kg, unit)),
        Segment("head", "thorax", np.array([0, 0, neck_m]), head, *_head(mass_kg, unit)),
    ]
    for root, limb in _LIMBS:
        for side, sign in SIDES.items():
            parent = root
            for name, joint in limb:
                hinges = _hinges(f"{side}_{joint}", _JOINTS[joint], -sign)
                place = _joint_place(name, height_m) * np.array([1, sign, 1])
                body = _limb(name, mass_kg, height_m)
                segments.append(Segment(f"{side}_{name}", parent, place, hinges, *body))
                parent = f"{side}_{name}"
    return Skeleton(tuple(segments), _markers(height_m))


def inertial_parameters(skeleton: Skeleton) -> FloatArray:
    """(S, 10): m, m c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz about each segment's own origin.

    Pinocchio's order; m c in kg m, inertias in kg m^2, axes of the segment's frame.
    """
    rows = []
    for s in skeleton.segments:
        c = s.com_m
        # parallel axes: I_origin (3, 3) = I_com + m (c.c E - c c^T)
        I = s.inertia_kgm2 + s.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))  # noqa: E741
        inertias = I[0, 0], I[0, 1], I[1, 1], I[0, 2], I[1, 2], I[2, 2]
        rows.append([s.mass_kg, *(s.mass_kg * c), *inertias])
    return np.array(rows)


def _pelvis(mass_kg: float, unit: float) -> Body:
    row = DE_LEVA["lower_trunk"]
    above = (1 - row.com) * row.length_mm * unit
    return row.mass * mass_kg, np.array([0, 0, above]), _inertia("lower_trunk", mass_kg, unit)


def _thorax(mass_kg: float, unit: float) -> Body:
    """Middle and upper trunk as one body, from the waist upwards."""
    middle, upper = DE_LEVA["middle_trunk"], DE_LEVA["upper_trunk"]
    mass = np.array([middle.mass, upper.mass]) * mass_kg
    height = np.array(
        [
            (1 - middle.com) * middle.length_mm,
            middle.length_mm + (1 - upper.com) * upper.length_mm,
        ]
    )
    height = height * unit
    centre = float(mass @ height / mass.sum())
    lever = float(mass @ (height - centre) ** 2)
    own = _inertia("middle_trunk", mass_kg, unit) + _inertia("upper_trunk", mass_kg, unit)
    return float(mass.sum()), np.array([0, 0, centre]), own + lever * np.diag([1.0, 1.0, 0.0])


def _head(mass_kg: float, unit: float) -> Body:
    row = DE_LEVA["head"]
    above = (1 - row.com) * row.length_mm * unit
    return row.mass * mass_kg, np.array([0, 0, above]), _inertia("head", mass_kg, unit)


def _limb(name: str, mass_kg: float, height_m: float) -> Body:
    row, unit = DE_LEVA[name], height_m / TABLE_HEIGHT_MM
    along = row.com * row.length_mm * unit
    com = np.array([0, 0, -along])
    if name == "foot":
        com = np.array([along - HEEL_BEHIND_ANKLE * height_m, 0, -0.5 * ANKLE_HEIGHT * height_m])
    return row.mass * mass_kg, com, _inertia(name, mass_kg, unit)


def _inertia(name: str, mass_kg: float, unit: float) -> FloatArray:
    row = DE_LEVA[name]
    radii = np.array(row.gyration)[list(AXES_OF.get(name, (0, 1, 2)))] * row.length_mm * unit
    return np.diag(row.mass * mass_kg * radii**2)


def _waist_m(unit: float) -> float:
    return DE_LEVA["lower_trunk"].length_mm * unit


def _joint_place(name: str, height_m: float) -> FloatArray:
    """Where a left limb's joint lies in its parent's frame."""
    unit = height_m / TABLE_HEIGHT_MM
    if name == "upper_arm":
        above = SHOULDER_ABOVE_HIP_MM * unit - _waist_m(unit)
        return np.array([0, SHOULDER_HALF_WIDTH * height_m, above])
    if name == "thigh":
        return np.array([0, HIP_HALF_WIDTH * height_m, 0])
    before = {"forearm": "upper_arm", "hand": "forearm", "shank": "thigh", "foot": "shank"}[name]
    return np.array([0, 0, -DE_LEVA[before].length_mm * unit])


def _hinges(
    joint: str, axes: tuple[tuple[str, tuple[int, int, int]], ...], side: int
) -> tuple[Hinge, ...]:
    """Mirrored on the left (`side` -1): turns about y stay, those about x and z change sign."""
    mirror = np.array([side, 1, side])
    return tuple(Hinge(f"{joint}_{name}", mirror * np.array(axis) + 0.0) for name, axis in axes)


def _markers(height_m: float) -> tuple[MarkerSite, ...]:
    sites = [
        MarkerSite(name, segment, height_m * np.array(place))
        for segment, places in _MIDDLE_MARKERS.items()
        for name, place in places.items()
    ]
    for side, sign in SIDES.items():
        outwards = np.array([1, sign, 1])
        sites += [
            MarkerSite(f"{side}_{name}", f"{side}_{segment}", height_m * outwards * np.array(place))
            for segment, places in _LIMB_MARKERS.items()
            for name, place in places.items()
        ]
    return tuple(sites)
