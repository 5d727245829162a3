"""Arms with muscles: four that come with the package, and any lab's table.

The maximum tensions of an arm matter only for static optimisation, which shares a torque among
muscles that could all produce it. The muscles' stiffness from a joint stiffness does not depend on
them, except for the curvature term.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import MUSCLE_SIGNS, MUSCLES
from armimpedance.core.errors import InputError
from armimpedance.limb.arm.polynomial_paths import (
    STIFFNESS_PER_TENSION,
    MuscularArm,
    PolynomialPaths,
    constant_paths,
)
from armimpedance.limb.arm.rods import LOCKED_WRIST
from armimpedance.limb.arm.table_paths import read_moment_arm_table

# Arms of published models that come with the package: tables of polynomial lengths.


@dataclass(frozen=True)
class PathTable(FrozenRecord):
    """The muscles of a table ``arm/muscles/NAME.csv``.

    `max_tension` (m,): maximum tensions, N."""

    paths: PolynomialPaths
    max_tension: Annotated[FloatArray, "m"]


def path_table(name: str, angles: tuple[str, ...], box: ArrayLike) -> PathTable:
    """Read a table of the package, with a row for each muscle and term.

    `angles` (n,) tuple of str: names; the table has the power of each as ``{angle}_power``.
    `box` (n, 2): angles that are scaled to -1 and 1, rad.
    """
    with (files("armimpedance.limb.arm") / "muscles" / f"{name}.csv").open(
        encoding="utf-8"
    ) as stream:
        terms = list(csv.DictReader(line for line in stream if not line.startswith("#")))
    powers = [tuple(int(term[f"{angle}_power"]) for angle in angles) for term in terms]
    muscles = tuple(dict.fromkeys(term["muscle"] for term in terms))
    distinct = sorted(set(powers))
    coefficients = np.zeros((len(muscles), len(distinct)))
    tension = np.zeros(len(muscles))
    for term, power in zip(terms, powers, strict=True):
        row = muscles.index(term["muscle"])
        coefficients[row, distinct.index(power)] = float(term["length_m"])
        tension[row] = float(term["max_tension_N"])
    paths = PolynomialPaths(muscles, np.array(distinct), coefficients, np.array(box, dtype=float))
    return PathTable(paths, tension)


def with_joints_locked(paths: PolynomialPaths, free: int) -> PolynomialPaths:
    """Restrict muscles to the first joints, with the other joints locked at zero angles.

    `free`: number of joints that remain.
    Returns: paths without the muscles that span none of these joints.
    """
    middle, half = paths.box.mean(axis=1), np.diff(paths.box, axis=1)[:, 0] / 2
    # the locked factors of a term are constant: u^e at the scaled angle u of zero
    at_zero = np.prod((-middle[free:] / half[free:]) ** paths.exponents[:, free:], axis=1)
    exponents, inverse = np.unique(paths.exponents[:, :free], axis=0, return_inverse=True)
    summed = np.zeros((len(paths.muscles), len(exponents)))
    np.add.at(summed.T, inverse.ravel(), (paths.coefficients * at_zero).T)
    moving = exponents.any(axis=1)
    spans = (summed[:, moving] != 0).any(axis=1)
    names = tuple(np.array(paths.muscles)[spans].tolist())
    return PolynomialPaths(
        names, exponents[moving], summed[np.ix_(spans, moving)], paths.box[:free]
    )


#: Shoulder and elbow (m) of the muscles in the order of `core.conventions.MUSCLES`: Selen,
#: Franklin and Wolpert 2009 (J Neurosci 29:12606-12616, PMC2784227), Table 1, without signs.
PLANAR6_ARMS_M: Final = (
    (0.0536, 0.0),
    (0.0536, 0.0),
    (0.0, 0.0316),
    (0.0, 0.0267),
    (0.0386, 0.0427),
    (0.0388, 0.0300),
)
#: Maximum tension of all muscles, N: equal, so that only moment arms decide how a torque is shared.
#: Their Table 1 has no maxima; those of arm26 for these muscles are 624 to 987 N.
PLANAR6_TENSION_N: Final = 800.0
#: Range of the constant arms, which are an average around the posture of the experiments (shoulder
#: 60, elbow 90 degrees). Within 45 degrees of it, the elbow arms of arm26 change by about a third.
PLANAR6_RANGE_DEG: Final = ((15.0, 105.0), (45.0, 135.0))
#: Range in which arm26's polynomials were fitted.
ARM26_RANGE_DEG: Final = ((0.0, 90.0), (30.0, 120.0))
#: Range in which myoarm7's were fitted, with the humerus turned inwards by -1 to 1 rad (q_1 + q_3).
MYOARM_RANGE_RAD: Final = (
    (-1.5, 0.3),
    (0.4, 1.6),
    (-0.5, 1.7),
    (0.5, 2.1),
    (-1.0, 1.0),
    (-0.4, 0.2),
    (-0.6, 0.6),
)


@dataclass(frozen=True)
class BuiltInArm:
    """An arm's name on the command line, a description, and a function that builds it."""

    name: str
    line: str
    make: Callable[[], MuscularArm]


def planar6() -> MuscularArm:
    """Build a horizontal planar arm: six muscles, constant moment arms (Selen et al. 2009)."""
    return MuscularArm(
        name="planar6",
        paths=constant_paths(MUSCLES, np.array(MUSCLE_SIGNS) * np.array(PLANAR6_ARMS_M)),
        max_tension=np.full(len(MUSCLES), PLANAR6_TENSION_N),
        stiffness_per_tension=STIFFNESS_PER_TENSION,
        angle_range=np.deg2rad(PLANAR6_RANGE_DEG),
        source="Selen et al. 2009, Table 1; maximum tensions assumed",
    )


def arm26() -> MuscularArm:
    """Build OpenSim's arm26: six muscles, moment arms of order 2 fitted to the model's lengths.

    The model moves in the sagittal plane (shoulder elevation and elbow flexion, both positive in
    flexion), and it has no single-joint shoulder muscle: all shoulder torque comes from biceps and
    triceps, and many torques are impossible. The short head of its biceps extends the shoulder from
    10 degrees of elevation on, as in the model. Stiffness per tension is not part of the model; it
    is taken from Selen et al. 2009.

    Fitted over shoulder 0-90, elbow 30-120 degrees; rms error in mm at shoulder / elbow: TRIlong
    1.19 / .34, TRIlat and TRImed 0 / .34, BIClong .24 / .55, BICshort .46 / .55, BRA 0 / .94. No
    polynomial of order 2 does better than 1.19 mm for TRIlong at the shoulder, which has a kink
    where it comes off the bone at 60 degrees (order 3: .52 mm).

    Credit: The OpenSim Development Team (Reinbolt, Seth, Habib, Hamner), adapted from Holzbaur,
    Murray and Delp 2005 (Ann Biomed Eng 33:829-840), CC BY 3.0; the file has all of it.
    """
    box = np.deg2rad(ARM26_RANGE_DEG)
    table = path_table("arm26", ("shoulder", "elbow"), box)
    return MuscularArm(
        name="arm26",
        paths=table.paths,
        max_tension=table.max_tension,
        stiffness_per_tension=STIFFNESS_PER_TENSION,
        angle_range=box,
        source="OpenSim arm26 (CC BY 3.0, sagittal plane, no single-joint shoulder muscle); "
        "stiffness per tension after Selen et al. 2009",
        sagittal=True,
    )


def myoarm7() -> MuscularArm:
    """Build MyoSuite's right arm in space with a free wrist: 32 muscles over seven angles.

    Moment arms are of order 2, fitted to the model's over `MYOARM_RANGE_RAD` with the humerus
    rotated inwards by -1 to 1 rad, with an error of 1.5 mm (rms; the arms themselves 19 mm). The
    worst is TRIlong at the shoulder, 7 mm of 23, where its path comes off the bone. The girdle
    moves with the upper arm as in the model; muscles of the fingers are left out, so that a grip
    does not stiffen the wrist. Stiffness per tension is not part of the model; it is taken from
    Selen et al. 2009.

    Credit: myo-sim of the MyoSuite authors (Apache 2.0), geometry after Saul et al. 2015 (Comput
    Methods Biomech Biomed Engin 18:1445) and Holzbaur et al. 2005; the file has all of it.
    """
    radians = np.tile([-1.0, 1.0], (len(MYOARM_RANGE_RAD), 1))
    table = path_table("myoarm", tuple(f"q_{j}" for j in range(1, 8)), radians)
    return MuscularArm(
        name="myoarm7",
        paths=table.paths,
        max_tension=table.max_tension,
        stiffness_per_tension=STIFFNESS_PER_TENSION,
        angle_range=np.array(MYOARM_RANGE_RAD),
        source="MyoSuite's arm (Apache 2.0) after Saul et al. 2015, moment arms of order 2; "
        "stiffness per tension after Selen et al. 2009",
    )


def myoarm4() -> MuscularArm:
    """Build `myoarm7` with its wrist locked at zero angles: 30 muscles, four angles."""
    full_arm = myoarm7()
    paths = with_joints_locked(cast(PolynomialPaths, full_arm.paths), LOCKED_WRIST)
    stays = np.isin(full_arm.paths.muscles, paths.muscles)
    tension, box = full_arm.max_tension[stays], full_arm.angle_range[:LOCKED_WRIST]
    return replace(full_arm, name="myoarm4", paths=paths, max_tension=tension, angle_range=box)


#: The arms that come with the package.
ARMS: Final = {
    arm.name: arm
    for arm in (
        BuiltInArm("planar6", "horizontal, six muscles, constant moment arms", planar6),
        BuiltInArm("arm26", "OpenSim's, sagittal, moment arms of order 2", arm26),
        BuiltInArm("myoarm4", "MyoSuite's, in space, wrist locked, order 2", myoarm4),
        BuiltInArm("myoarm7", "MyoSuite's, in space, wrist free, order 2", myoarm7),
    )
}


def arm_named(name_or_path: MuscularArm | str | Path) -> MuscularArm:
    """Return a built-in arm by its name, or the arm of a table of moment arms (CSV).

    Parameters
    ----------
    name_or_path : str or path
        "planar6", "arm26", "myoarm4", "myoarm7", or the path of a table of moment arms. An arm is
        returned unchanged.

    Returns
    -------
    MuscularArm
        The muscles with their moment arms, strength and stiffness.

    Raises
    ------
    InputError
        There is no such arm and no such file, or the table is not valid.

    Examples
    --------
    >>> from armimpedance.limb.arm import arm_named
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
