"""Where markers sit on the model skeletons: a laboratory's first guess.

`limb.mocap.calibrate_sites` finds a subject's own places.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.skeleton import MarkerSite

#: Both sides and the sign of y there.
SIDES: Final = {"right": -1.0, "left": 1.0}

#: First guesses of the markers' places, fractions of the height.
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
#: On both sides; y counts outwards.
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
    """The eight markers of Venture's Fig. 3 on trunk, right upper arm and right forearm.

    Parameters
    ----------
    hip_half_m, shoulder_half_m : float
        Half of the breadth between the hips and between the shoulders.
    shoulder_m : float
        Height of the shoulders above the hips.
    upper_arm_m : float
    wrist_m, grip_m : float
        Distances from the elbow to the wrist and to the grip's centre, m.
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
    """The 35 markers of the whole body."""
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
