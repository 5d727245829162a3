"""Model skeletons of a person: the trunk and arm of an elbow examination, and the whole body.

Elbow: masses and lengths as in `anthropometry` (Winter). Trunk, head and neck together: Winter,
Table 4.1 (.578 of the mass, centre at .66 of the way from the greater trochanter to the shoulder,
radius of gyration .503 of it); heights of shoulder and hip and breadths: Winter, Fig. 4.1 (.818,
.530; .259, .191 of the height). Winter gives no radius about a segment's long axis: de Leva's.

Body: P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J Biomech 29
(1996) 1223-1230, Table 4, men. The pelvis is the lower part of the trunk (mid-hip to omphalion),
the thorax its middle and upper parts (omphalion to xiphoid to cervicale), the head's joint lies at
the cervicale. The table has no breadths: .22 of the height between the shoulders' centres and .10
between the hips', .039 from the ankle to the sole, which is rounded from Winter's Fig. 4.1, moved
inwards from the skin.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from armimpedance.limb.arm.anthropometry import DE_LEVA, WINTER, SegmentRatios, two_link_arm

# Sites of the markers on the model skeletons: a first guess.
#
# `limb.mocap.calibrate_sites` estimates the sites of a subject.

#: Both sides, and the sign of y on each.
SIDES: Final = {"right": -1.0, "left": 1.0}

#: First guesses of the sites in the middle of the body, as fractions of the height.
_MIDDLE_SITES: Final = {
    "right_asis": ("pelvis", (0.055, -0.070, 0.055)),
    "left_asis": ("pelvis", (0.055, 0.070, 0.055)),
    "right_psis": ("pelvis", (-0.055, -0.028, 0.058)),
    "left_psis": ("pelvis", (-0.055, 0.028, 0.058)),
    "c7": ("thorax", (-0.045, 0.0, 0.255)),
    "sternum": ("thorax", (0.070, 0.0, 0.160)),
    "right_acromion": ("thorax", (-0.005, -0.115, 0.235)),
    "left_acromion": ("thorax", (-0.005, 0.115, 0.235)),
    "forehead": ("head", (0.058, 0.0, 0.105)),
    "right_temple": ("head", (0.005, -0.045, 0.100)),
    "left_temple": ("head", (0.005, 0.045, 0.100)),
}
#: First guesses on both sides; y is positive outwards.
_LIMB_SITES: Final = {
    "upper_arm": ("upper_arm", (0.005, 0.030, -0.085)),
    "epicondyle": ("upper_arm", (0.0, 0.024, -0.162)),
    "radius": ("forearm", (0.020, 0.0, -0.148)),
    "ulna": ("forearm", (-0.019, 0.004, -0.146)),
    "knuckle_2": ("hand", (0.022, 0.010, -0.048)),
    "knuckle_5": ("hand", (-0.020, 0.010, -0.043)),
    "thigh": ("thigh", (0.020, 0.046, -0.120)),
    "knee": ("thigh", (0.0, 0.032, -0.243)),
    "shank": ("shank", (0.020, 0.028, -0.110)),
    "malleolus": ("shank", (0.0, 0.022, -0.248)),
    "heel": ("foot", (-0.034, 0.0, -0.018)),
    "toe": ("foot", (0.085, 0.012, -0.022)),
}


def elbow_sites(
    *,
    hip_half_m: float,
    shoulder_half_m: float,
    shoulder_m: float,
    upper_arm_m: float,
    wrist_m: float,
    grip_m: float,
) -> tuple[MarkerSite, ...]:
    """Sites of the eight markers of Venture's Fig. 3 on trunk, right upper arm and forearm.

    `hip_half_m`, `shoulder_half_m`: half of the breadth between the hips and between the shoulders.
    `shoulder_m`: height of the shoulders above the hips.
    `wrist_m`, `grip_m`: distances from the elbow to the wrist and to the grip's centre, m.
    """
    sites = {
        "acromion_right": ("trunk", (0.0, -shoulder_half_m, shoulder_m + 0.03)),
        "acromion_left": ("trunk", (0.0, shoulder_half_m, shoulder_m + 0.03)),
        "upper_arm": ("right_upper_arm", (0.01, -0.045, -2.0 / 3.0 * upper_arm_m)),
        "epicondyle": ("right_upper_arm", (0.0, -0.04, -upper_arm_m)),
        "forearm": ("right_forearm", (-0.01, -0.035, -2.0 / 3.0 * wrist_m)),
        "hand": ("right_forearm", (-0.02, 0.0, -grip_m)),
        "iliac_right": ("trunk", (0.05, -hip_half_m, 0.08)),
        "iliac_left": ("trunk", (0.05, hip_half_m, 0.08)),
    }
    return tuple(MarkerSite(n, segment, np.array(p)) for n, (segment, p) in sites.items())


def body_sites(height_m: float) -> tuple[MarkerSite, ...]:
    """Sites of the 35 markers of the whole body."""
    sites = [
        MarkerSite(name, segment, height_m * np.array(place))
        for name, (segment, place) in _MIDDLE_SITES.items()
    ]
    for side, sign in SIDES.items():
        outwards = height_m * np.array([1.0, sign, 1.0])
        sites += [
            MarkerSite(f"{side}_{name}", f"{side}_{segment}", outwards * np.array(place))
            for name, (segment, place) in _LIMB_SITES.items()
        ]
    return tuple(sites)


#: Winter: trunk, head and neck; length from hip to shoulder.
_TRUNK: Final = SegmentRatios(0.578, 0.818 - 0.530, 0.66, 0.503)
_SHOULDER_BREADTH: Final = 0.259
_HIP_BREADTH: Final = 0.191

_MEAN_HEIGHT_MM: Final = 1741.0


def _row(
    mass: float, length_mm: float, com: float, sagittal: float, transverse: float, long: float
) -> SegmentRatios:
    return SegmentRatios(mass, length_mm / _MEAN_HEIGHT_MM, com, transverse, sagittal, long)


#: de Leva, men; centres from the upper or proximal end, the foot's from the heel.
BODY: Final = {
    "head": _row(0.0694, 242.9, 0.5002, 0.303, 0.315, 0.261),
    "upper_trunk": _row(0.1596, 242.1, 0.5066, 0.505, 0.320, 0.465),
    "middle_trunk": _row(0.1633, 215.5, 0.4502, 0.482, 0.383, 0.468),
    "lower_trunk": _row(0.1117, 145.7, 0.6115, 0.615, 0.551, 0.587),
    "upper_arm": DE_LEVA["male"].upper_arm,
    "forearm": DE_LEVA["male"].forearm,
    "hand": DE_LEVA["male"].hand,
    "thigh": _row(0.1416, 422.2, 0.4095, 0.329, 0.329, 0.149),
    "shank": _row(0.0433, 434.0, 0.4459, 0.255, 0.249, 0.103),
    "foot": _row(0.0137, 258.1, 0.4415, 0.257, 0.245, 0.124),
}
#: Mid-hip to mid-shoulder in the table.
_SHOULDER_HEIGHT: Final = 515.5 / _MEAN_HEIGHT_MM
_SHOULDER_HALF: Final = 0.110
_HIP_HALF: Final = 0.050
_ANKLE_HEIGHT: Final = 0.039
_HEEL_BEHIND: Final = 0.034

_FLEXION: Final = (0.0, -1.0, 0.0)
# Axes of the right side; on the left x and z are reversed, so that names mean the same.
_BALL: Final = (
    ("flexion", _FLEXION),
    ("abduction", (-1.0, 0.0, 0.0)),
    ("rotation", (0.0, 0.0, 1.0)),
)
_COLUMN: Final = (
    ("flexion", (0.0, 1.0, 0.0)),
    ("bend_right", (1.0, 0.0, 0.0)),
    ("twist_left", (0.0, 0.0, 1.0)),
)
_JOINTS: Final = {
    "trunk": _COLUMN,
    "neck": _COLUMN,
    "shoulder": _BALL,
    "elbow": (("flexion", _FLEXION),),
    "wrist": (("radial", _FLEXION), ("flexion", (1.0, 0.0, 0.0))),
    "hip": _BALL,
    "knee": (("flexion", (0.0, 1.0, 0.0)),),
    "ankle": (("dorsiflexion", _FLEXION), ("inversion", (1.0, 0.0, 0.0))),
}
_LIMBS: Final = (
    ("thorax", (("upper_arm", "shoulder"), ("forearm", "elbow"), ("hand", "wrist"))),
    ("pelvis", (("thigh", "hip"), ("shank", "knee"), ("foot", "ankle"))),
)


def elbow_skeleton(
    mass_kg: float,
    height_m: float,
    *,
    upper_arm_m: float | None = None,
    forearm_hand_m: float | None = None,
) -> Skeleton:
    """Build trunk (floating), right upper arm, right forearm with hand, and the eight markers.

    Three hinges in the shoulder, one in the elbow. The root is between the hips. Markers: Venture's
    Fig. 3 (`acromion_right, acromion_left, upper_arm, epicondyle, forearm, hand, iliac_right,
    iliac_left`).

    Parameters
    ----------
    mass_kg, height_m : float
    upper_arm_m, forearm_hand_m : float, optional
        Measured lengths: shoulder to elbow, elbow to the grip's centre.

    Returns
    -------
    Skeleton

    Raises
    ------
    InputError
        Mass or height is not possible for a person.
    """
    _check_person(mass_kg, height_m)
    arm = two_link_arm(mass_kg, height_m, upper_arm_m=upper_arm_m, forearm_hand_m=forearm_hand_m)
    long = DE_LEVA["male"]
    wrist = arm.forearm_hand_m * WINTER.forearm.length / WINTER.forearm_hand_length
    segments = (
        _elbow_trunk(mass_kg, height_m),
        Segment(
            "right_upper_arm",
            "trunk",
            height_m * np.array([0.0, -_SHOULDER_BREADTH / 2.0, _TRUNK.length]),
            _hinges("right_shoulder", _BALL, 1.0),
            arm.upper_arm_kg,
            np.array([0.0, 0.0, -arm.upper_arm_com_m]),
            _rod(
                arm.upper_arm_inertia_kgm2,
                arm.upper_arm_kg * (_long(long.upper_arm) * arm.upper_arm_m) ** 2,
            ),
        ),
        Segment(
            "right_forearm",
            "right_upper_arm",
            np.array([0.0, 0.0, -arm.upper_arm_m]),
            _hinges("right_elbow", _JOINTS["elbow"], 1.0),
            arm.forearm_hand_kg,
            np.array([0.0, 0.0, -arm.forearm_hand_com_m]),
            _rod(
                arm.forearm_hand_inertia_kgm2,
                arm.forearm_hand_kg * (_long(long.forearm) * wrist) ** 2,
            ),
        ),
    )
    sites = elbow_sites(
        hip_half_m=_HIP_BREADTH * height_m / 2.0,
        shoulder_half_m=_SHOULDER_BREADTH * height_m / 2.0,
        shoulder_m=_TRUNK.length * height_m,
        upper_arm_m=arm.upper_arm_m,
        wrist_m=wrist,
        grip_m=arm.forearm_hand_m,
    )
    return Skeleton(segments, sites)


def body_skeleton(mass_kg: float, height_m: float) -> Skeleton:
    """Build a body of 15 segments, 36 coordinates and 35 markers; the root is the pelvis.

    Six coordinates of the root (between the hips), three hinges in waist, neck, shoulders and hips,
    two in wrists and ankles, one in elbows and knees.

    Parameters
    ----------
    mass_kg, height_m : float

    Returns
    -------
    Skeleton

    Raises
    ------
    InputError
        Mass or height is not possible for a person.
    """
    _check_person(mass_kg, height_m)
    segments = [*_column(mass_kg, height_m)]
    for root, limb in _LIMBS:
        for side, sign in SIDES.items():
            parent = root
            for name, joint in limb:
                hinges = _hinges(f"{side}_{joint}", _JOINTS[joint], -sign)
                position = height_m * _joint_place(name) * np.array([1.0, sign, 1.0])
                body = _limb_body(name, mass_kg, height_m)
                segments.append(Segment(f"{side}_{name}", parent, position, hinges, *body))
                parent = f"{side}_{name}"
    return Skeleton(tuple(segments), body_sites(height_m))


def _check_person(mass_kg: float, height_m: float) -> None:
    for quantity, value, most in (
        ("body mass in kg", mass_kg, 400.0),
        ("height in m", height_m, 3.0),
    ):
        if not (np.isfinite(value) and 0 < value <= most):
            raise InputError(f"{quantity} is {value}", expected=f"more than 0 and at most {most:g}")


_Body = tuple[float, FloatArray, FloatArray]


def _hinges(
    joint: str, axes: tuple[tuple[str, tuple[float, float, float]], ...], side: float
) -> tuple[Hinge, ...]:
    mirror = np.array([side, 1.0, side])
    return tuple(Hinge(f"{joint}_{name}", mirror * np.array(axis)) for name, axis in axes)


def _long(row: SegmentRatios) -> float:
    return float(row.gyration_long or 0.0)


def _rod(across: float, along: float) -> FloatArray:
    return np.diag([across, across, along])


def _elbow_trunk(mass_kg: float, height_m: float) -> Segment:
    """The trunk; about its long axis, which the table lacks, a cylinder as wide as the hips."""
    mass, length = mass_kg * _TRUNK.mass, height_m * _TRUNK.length
    across = mass * (_TRUNK.gyration * length) ** 2
    along = mass * (_HIP_BREADTH * height_m / 2.0) ** 2 / 2.0
    centre = np.array([0.0, 0.0, _TRUNK.com * length])
    return Segment("trunk", None, np.zeros(3), (), mass, centre, _rod(across, along))


def _column(mass_kg: float, height_m: float) -> tuple[Segment, Segment, Segment]:
    """Pelvis, thorax and head; the table's centres of mass are measured from above."""
    lower, middle, upper = BODY["lower_trunk"], BODY["middle_trunk"], BODY["upper_trunk"]
    waist = np.array([0.0, 0.0, lower.length * height_m])
    neck = np.array([0.0, 0.0, (middle.length + upper.length) * height_m])
    thorax = _merged(
        _upwards(middle, mass_kg, height_m, 0.0),
        _upwards(upper, mass_kg, height_m, middle.length * height_m),
    )
    trunk_hinges, neck_hinges = (_hinges(n, _JOINTS[n], 1.0) for n in ("trunk", "neck"))
    pelvis = _upwards(lower, mass_kg, height_m, 0.0)
    head = _upwards(BODY["head"], mass_kg, height_m, 0.0)
    return (
        Segment("pelvis", None, np.zeros(3), (), *pelvis),
        Segment("thorax", "pelvis", waist, trunk_hinges, *thorax),
        Segment("head", "thorax", neck, neck_hinges, *head),
    )


def _upwards(row: SegmentRatios, mass_kg: float, height_m: float, base_m: float) -> _Body:
    """Mass, centre and inertia of a part of the trunk whose lower end is at `base_m`."""
    length = row.length * height_m
    centre = np.array([0.0, 0.0, base_m + (1.0 - row.com) * length])
    return row.mass * mass_kg, centre, _inertia(row, mass_kg, length)


def _inertia(row: SegmentRatios, mass_kg: float, length_m: float) -> FloatArray:
    """Inertia about the centre of mass: sagittal axis x, transverse y, longitudinal z."""
    radii = np.array([row.gyration_sagittal or 0.0, row.gyration, _long(row)]) * length_m
    return np.diag(row.mass * mass_kg * radii**2)


def _merged(lower: _Body, upper: _Body) -> _Body:
    """Mass, centre and inertia of two bodies that are joined rigidly."""
    mass = lower[0] + upper[0]
    centre = (lower[0] * lower[1] + upper[0] * upper[1]) / mass
    inertia = np.zeros((3, 3))
    for m, c, inertia_part in (lower, upper):
        d = c - centre
        # parallel axes: I = I_own + m (d.d 1 - d d^T)
        inertia += inertia_part + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, centre, inertia


def _limb_body(name: str, mass_kg: float, height_m: float) -> _Body:
    row = BODY[name]
    length = row.length * height_m
    mass, inertia = row.mass * mass_kg, _inertia(row, mass_kg, length)
    if name == "hand":
        # it hangs with the palm to the thigh: its sagittal axis (through the palm) points sideways
        inertia = np.diag(np.diag(inertia)[[1, 0, 2]])
    if name == "foot":
        # its length lies forward, from the heel
        inertia = np.diag(np.diag(inertia)[[2, 1, 0]])
        forward = row.com * length - _HEEL_BEHIND * height_m
        return mass, np.array([forward, 0.0, -_ANKLE_HEIGHT * height_m / 2.0]), inertia
    return mass, np.array([0.0, 0.0, -row.com * length]), inertia


def _joint_place(name: str) -> FloatArray:
    """Joint centre in the parent's frame, as fractions of the height; y is positive outwards."""
    if name == "upper_arm":
        waist = BODY["lower_trunk"].length
        return np.array([0.0, _SHOULDER_HALF, _SHOULDER_HEIGHT - waist])
    if name == "thigh":
        return np.array([0.0, _HIP_HALF, 0.0])
    parent = {"forearm": "upper_arm", "hand": "forearm", "shank": "thigh", "foot": "shank"}[name]
    return np.array([0.0, 0.0, -BODY[parent].length])
