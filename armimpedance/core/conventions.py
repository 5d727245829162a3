"""Signs, frames, units and names that every room shares. Standard library only.

Inside: m, rad, s, kg, N, N m. Degrees, % MVC and mm appear only at the edges (files, figures,
command line) and their names say so (``_deg``, ``_percent``, ``_mm``).

Planar frame for a right arm: origin at the shoulder, x to the subject's right, y forward; angles
counter-clockwise from +x. Joint 1 is the shoulder, joint 2 the elbow relative to the upper arm
(0 = straight). Forces are those that the *limb exerts on the device*; a reader turns the sign of
a sensor that measures the other one, once.

Muscle length is positive in lengthening, tension positive in pulling, ``tau = -G^T f`` with
``G = dL/dtheta``: flexors have negative rows in G, extensors positive ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import pi
from typing import Any, Final, Literal, get_args

Level = Literal["hand", "joint", "muscle"]
Kind = Literal["hand", "joint"]

#: The quantity that a device imposes on the limb, whatever the limb does.
Imposed = Literal["position", "force", "torque", "both"]
IMPOSED: Final[tuple[Imposed, ...]] = get_args(Imposed)

#: Names of an arm's joints in the plane; those of an arm in space and others are numbered.
PLANAR_JOINTS: Final = ("shoulder", "elbow")
NUMBERED_JOINTS: Final = ("1", "2", "3", "4", "5", "6", "7")

#: Nominal posture of Tsuji (1997), section 3.2: shoulder, elbow (rad).
NOMINAL_POSTURE_RAD: Final = (1.04, 1.57)

#: No human joint turns further than this from its zero; degrees taken for radians do.
LARGEST_ANGLE_RAD: Final = 2.0 * pi

#: Mass of the cast between force sensor and hand in Tsuji (1997), section 3.2 (kg).
CAST_MASS_KG: Final = 0.164

#: The unit of hand force in the experiments of Tsuji (1997), "x 9.8 N".
FORCE_UNIT_N: Final = 9.8

#: Muscles in the order of Tsuji (1997), Fig. 4 and eq. (30).
MUSCLES: Final = (
    "pectoralis_major",
    "infraspinatus",
    "brachialis",
    "triceps_lateral",
    "biceps_long",
    "triceps_long",
)

#: Sign of the rows of G at shoulder and elbow, eq. (30): flexor -1, extensor +1, not spanned 0.
MUSCLE_SIGNS: Final = ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (1, 1))

#: The three matrices: field name -> (symbol, order of the derivative that it multiplies).
MATRICES: Final = {"inertia": ("M", 2), "viscosity": ("B", 1), "stiffness": ("K", 0)}

#: Units of M, B, K at each level.
UNITS: Final = {
    "hand": {"M": "kg", "B": "N s/m", "K": "N/m"},
    "joint": {"M": "kg m^2", "B": "N m s/rad", "K": "N m/rad"},
    "muscle": {"M": "kg", "B": "N s/m", "K": "N/m"},
}

#: Units of position and force at each level.
POSITION_UNIT: Final = {"hand": "m", "joint": "rad", "muscle": "m"}
FORCE_UNIT: Final = {"hand": "N", "joint": "N m", "muscle": "N"}

#: Names of the hand's axes, and the columns of a recording on disk for each kind.
AXES: Final = ("x", "y", "z")


def position_columns(kind: str, axes: int) -> tuple[str, ...]:
    """Names of the position columns in a recording on disk: ``x_m, y_m`` or ``q1_rad``."""
    if kind == "hand":
        return tuple(f"{axis}_m" for axis in AXES[:axes])
    return tuple(f"q{i}_rad" for i in range(1, axes + 1))


def force_columns(kind: str, axes: int) -> tuple[str, ...]:
    """Names of the force columns in a recording on disk: ``fx_N, fy_N`` or ``tau1_Nm``."""
    if kind == "hand":
        return tuple(f"f{axis}_N" for axis in AXES[:axes])
    return tuple(f"tau{i}_Nm" for i in range(1, axes + 1))


def command_columns(kind: str, axes: int) -> tuple[str, ...]:
    """Names of the commanded motion's columns: ``x_command_m, y_command_m``, ``q1_command_rad``.

    Optional in a recording: the commanded motion of the robot, on the clock of the samples.
    """
    places = [name.rpartition("_") for name in position_columns(kind, axes)]
    return tuple(f"{axis}_command_{unit}" for axis, _, unit in places)


def perturbation_columns(axes: int) -> tuple[str, ...]:
    """Names of the columns with the commanded perturbation torque: ``tau1_perturbation_Nm``.

    Optional in a recording of kind "joint"; on the clock of the samples, positive as the angle is.
    """
    return tuple(f"tau{i}_perturbation_Nm" for i in range(1, axes + 1))


def group_name(keys: Mapping[str, Any]) -> str:
    """Return a group's columns in words: the condition alone, or all columns by name."""
    if set(keys) == {"condition"}:
        return str(keys["condition"])
    return ", ".join(f"{name} {value}" for name, value in keys.items()) or "all trials"


@cache
def element_names(symbol: str, k: int) -> tuple[str, ...]:
    """Names of a matrix' elements, row by row, axes counted from 1: ``K_11, K_12, K_21, K_22``."""
    return tuple(f"{symbol}_{i}{j}" for i in range(1, k + 1) for j in range(1, k + 1))


def parameter_names(k: int) -> tuple[str, ...]:
    """Names of all 3 k^2 impedance parameters in the order of the covariance: M, then B, then K."""
    return tuple(name for symbol in "MBK" for name in element_names(symbol, k))


def axis_name(kind: Kind, i: int) -> str:
    """Name of axis `i`: x, y, z of the hand, or joint 1, joint 2."""
    return AXES[i] if kind == "hand" else f"joint {i + 1}"
