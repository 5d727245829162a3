"""Arms whose muscles are known: two that come with the package, and any lab's table.

What an arm says of maximum tensions matters for one thing only: how static optimisation shares a
torque among muscles that could all make it. What one joint stiffness says of the muscles' does not
depend on it, the curvature term aside.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.arm.muscle_paths import STIFFNESS_PER_TENSION, MuscularArm
from armimpedance.arm.polynomial_paths import PolynomialPaths, constant_paths
from armimpedance.arm.table_paths_csv import read_moment_arm_table
from armimpedance.conventions import MUSCLE_SIGNS, MUSCLES
from armimpedance.errors import InputError
from armimpedance.records import ArmPosture

#: Shoulder and elbow (m) of the muscles in the order of `conventions.MUSCLES`: Selen, Franklin and
#: Wolpert 2009 (J Neurosci 29:12606-12616, PMC2784227), Table 1, without signs.
PLANAR6_ARMS_M: Final = (
    (0.0536, 0.0),
    (0.0536, 0.0),
    (0.0, 0.0316),
    (0.0, 0.0267),
    (0.0386, 0.0427),
    (0.0388, 0.0300),
)
#: N, all alike, so that moment arms alone decide how a torque is shared: their Table 1 has no
#: maxima; those that arm26 has of these muscles are 624 to 987 N.
PLANAR6_TENSION_N: Final = 800.0
#: Constant arms are an average around the posture of the experiments; 45 degrees to each side of
#: shoulder 60, elbow 90 degrees those of arm26 change by about a third at the elbow.
PLANAR6_RANGE_DEG: Final = ((15.0, 105.0), (45.0, 135.0))
#: Where arm26's polynomials were fitted.
ARM26_RANGE_DEG: Final = ((0.0, 90.0), (30.0, 120.0))


@dataclass(frozen=True)
class BuiltInArm:
    """A name on the command line, what it is, and how to make it."""

    name: str
    line: str
    make: Callable[[], MuscularArm]


def planar6() -> MuscularArm:
    """Six muscles of a horizontal planar arm, constant moment arms (Selen et al. 2009)."""
    return MuscularArm(
        name="planar6",
        paths=constant_paths(MUSCLES, np.array(MUSCLE_SIGNS) * np.array(PLANAR6_ARMS_M)),
        max_tension=np.full(len(MUSCLES), PLANAR6_TENSION_N),
        stiffness_per_tension=STIFFNESS_PER_TENSION,
        angle_range=np.deg2rad(PLANAR6_RANGE_DEG),
        source="Selen et al. 2009, Table 1; maximum tensions assumed",
    )


def arm26() -> MuscularArm:
    """OpenSim's arm26: six muscles, moment arms of order 2 fitted to the model's lengths.

    The model moves in the sagittal plane (shoulder elevation and elbow flexion, both positive in
    flexion), and it has no single-joint shoulder muscle: all shoulder torque comes from biceps and
    triceps, and many torques cannot be made at all. The short head of its biceps extends the
    shoulder from 10 degrees of elevation on, as the model has it. Stiffness per tension is not part
    of the model; it is taken from Selen et al. 2009.

    Fitted over shoulder 0-90, elbow 30-120 degrees; rms error in mm at shoulder / elbow: TRIlong
    1.19 / .34, TRIlat and TRImed 0 / .34, BIClong .24 / .55, BICshort .46 / .55, BRA 0 / .94. No
    polynomial of order 2 does better than 1.19 mm for TRIlong at the shoulder, which has a kink
    where it comes off the bone at 60 degrees (order 3: .52 mm).

    Credit: The OpenSim Development Team (Reinbolt, Seth, Habib, Hamner), adapted from Holzbaur,
    Murray and Delp 2005 (Ann Biomed Eng 33:829-840), CC BY 3.0; the file has all of it.
    """
    with (files("armimpedance.arm") / "muscles" / "arm26.csv").open(encoding="utf-8") as stream:
        terms = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    muscles = tuple(dict.fromkeys(term["muscle"] for term in terms))
    powers = sorted({(int(t["shoulder_power"]), int(t["elbow_power"])) for t in terms})
    coefficients = np.zeros((len(muscles), len(powers)))
    tension = np.zeros(len(muscles))
    for term in terms:
        row = muscles.index(term["muscle"])
        column = powers.index((int(term["shoulder_power"]), int(term["elbow_power"])))
        coefficients[row, column] = float(term["length_m"])
        tension[row] = float(term["max_tension_N"])
    box = np.deg2rad(ARM26_RANGE_DEG)
    return MuscularArm(
        name="arm26",
        paths=PolynomialPaths(muscles, np.array(powers), coefficients, box),
        max_tension=tension,
        stiffness_per_tension=STIFFNESS_PER_TENSION,
        angle_range=box,
        source="OpenSim arm26 (CC BY 3.0, sagittal plane, no single-joint shoulder muscle); "
        "stiffness per tension after Selen et al. 2009",
        sagittal=True,
    )


#: The arms that come with the package.
ARMS: Final = {
    arm.name: arm
    for arm in (
        BuiltInArm("planar6", "horizontal, six muscles, constant moment arms", planar6),
        BuiltInArm("arm26", "OpenSim's, sagittal, moment arms of order 2", arm26),
    )
}


def arm_named(name_or_path: MuscularArm | str | Path) -> MuscularArm:
    """A built-in arm by its name, or the arm of a table of moment arms (CSV).

    Parameters
    ----------
    name_or_path : str or path
        "planar6", "arm26", or the path of a table of moment arms. An arm is returned as it is.

    Returns
    -------
    MuscularArm
        The muscles with their moment arms, strength and stiffness.

    Raises
    ------
    InputError
        There is no such arm and no such file, or the table is not what it should be.

    Examples
    --------
    >>> from armimpedance.arm import arm_named
    >>> arm_named("planar6").paths.muscles[:2]
    ('pectoralis_major', 'infraspinatus')
    """
    if isinstance(name_or_path, MuscularArm):
        return name_or_path
    if str(name_or_path) in ARMS:
        return ARMS[str(name_or_path)].make()
    path = Path(name_or_path)
    if path.suffix.lower() != ".csv" and not path.is_file():
        raise InputError(
            f"no arm {str(name_or_path)!r}", expected=f"{', '.join(ARMS)} or a TABLE.csv"
        )
    return read_moment_arm_table(path)


def with_muscles(posture: ArmPosture, arm: MuscularArm) -> ArmPosture:
    """The posture with the arm's moment arms and the curvature of its lengths.

    Parameters
    ----------
    posture : ArmPosture
    arm : MuscularArm

    Returns
    -------
    ArmPosture

    Raises
    ------
    InputError
        Another number of joints, or a posture outside of a table.
    """
    q = posture.joint_angles
    return replace(
        posture,
        muscle_jacobian=arm.paths.moment_arms(q),
        muscle_curvature=arm.paths.curvature(q),
    )
