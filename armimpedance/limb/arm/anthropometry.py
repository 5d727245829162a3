"""Segment masses, centres of mass and inertias from body mass and height.

Winter: D. A. Winter, Biomechanics and Motor Control of Human Movement, 2nd ed. 1990 (4th ed.
2009, the same values), Table 4.1 (after Dempster), lengths from Fig. 4.1 (Drillis and Contini
1966). The hand's length of .108 of the height is wrist to finger tip; with it, the centre of
mass of forearm and hand together lies within 1 % of the table's own row for both (.682 of the
forearm's length).

de Leva: P. de Leva, Adjustments to Zatsiorsky-Seluyanov's segment inertia parameters, J Biomech
29 (1996) 1223-1230, Table 4. Lengths between joint centres: shoulder to elbow, elbow to wrist,
wrist to the third metacarpal's head (the knuckle, not the finger tip), as fractions of the mean
height of the sample, 1.741 m (male) and 1.735 m (female).

The grip's centre is assumed halfway between wrist and finger tip (Winter) or at the knuckle (de
Leva): .200 and .204 (male) of the height from the elbow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.limb.arm.rods import Rod
from armimpedance.limb.arm.two_link import TwoLinkArm

Table = Literal["winter", "de_leva"]
Sex = Literal["male", "female"]


@dataclass(frozen=True)
class SegmentRatios:
    """One row of a table.

    Attributes
    ----------
    mass, length : float
        Fractions of the body's mass and height.
    com : float
        Centre of mass from the proximal end, as a fraction of the length.
    gyration : float
        Radius of gyration about the centre of mass, axis of elbow flexion (de Leva:
        "transverse"), as a fraction of the length.
    gyration_sagittal, gyration_long : float or None
        The same about the other two axes; Winter gives none.
    """

    mass: float
    length: float
    com: float
    gyration: float
    gyration_sagittal: float | None = None
    gyration_long: float | None = None


@dataclass(frozen=True)
class ArmRatios:
    """Three segments, and the position of the grip's centre as a fraction of the hand's length."""

    upper_arm: SegmentRatios
    forearm: SegmentRatios
    hand: SegmentRatios
    grip: float

    @property
    def forearm_hand_length(self) -> float:
        """Distance from the elbow to the grip's centre, as a fraction of the height."""
        return self.forearm.length + self.grip * self.hand.length


WINTER: Final = ArmRatios(
    upper_arm=SegmentRatios(0.028, 0.186, 0.436, 0.322),
    forearm=SegmentRatios(0.016, 0.146, 0.430, 0.303),
    hand=SegmentRatios(0.006, 0.108, 0.506, 0.297),
    grip=0.5,
)

DE_LEVA: Final = {
    "male": ArmRatios(
        upper_arm=SegmentRatios(0.0271, 281.7 / 1741, 0.5772, 0.269, 0.285, 0.158),
        forearm=SegmentRatios(0.0162, 268.9 / 1741, 0.4574, 0.265, 0.276, 0.121),
        hand=SegmentRatios(0.0061, 86.2 / 1741, 0.7900, 0.513, 0.628, 0.401),
        grip=1.0,
    ),
    "female": ArmRatios(
        upper_arm=SegmentRatios(0.0255, 275.1 / 1735, 0.5754, 0.260, 0.278, 0.148),
        forearm=SegmentRatios(0.0138, 264.3 / 1735, 0.4559, 0.257, 0.261, 0.094),
        hand=SegmentRatios(0.0056, 78.0 / 1735, 0.7474, 0.454, 0.531, 0.335),
        grip=1.0,
    ),
}


def arm_ratios(table: Table = "winter", sex: Sex = "male") -> ArmRatios:
    """Return the table's rows for the arm; Winter does not distinguish the sexes.

    Raises InputError: unknown table or sex.
    """
    if sex not in DE_LEVA:
        raise InputError(f"unknown sex {sex!r} in a table", expected="'male' or 'female'")
    if table == "winter":
        return WINTER
    if table == "de_leva":
        return DE_LEVA[sex]
    raise InputError(f"unknown table {table!r}", expected="'winter' or 'de_leva'")


def two_link_arm(
    mass_kg: float,
    height_m: float | None = None,
    *,
    table: Table = "winter",
    sex: Sex = "male",
    upper_arm_m: float | None = None,
    forearm_hand_m: float | None = None,
) -> TwoLinkArm:
    """Build a two-link arm from body mass and height; forearm and hand become one link.

    `mass_kg`: body mass.
    `height_m`: needed if a length is not stated.
    `sex`: Winter does not distinguish.
    `upper_arm_m`, `forearm_hand_m`: measured lengths (shoulder to elbow, elbow to the grip's
    centre); forearm and hand then keep their proportion.
    Raises InputError: a number is missing, not positive or implausible (mass above 400 kg, height
    above 3 m).
    """
    ratios = arm_ratios(table, sex)
    _require("body mass in kg", mass_kg, 400.0)
    upper_arm_m = _length("upper_arm_m", upper_arm_m, ratios.upper_arm.length, height_m)
    forearm_hand_m = _length("forearm_hand_m", forearm_hand_m, ratios.forearm_hand_length, height_m)
    upper, forearm, hand = ratios.upper_arm, ratios.forearm, ratios.hand
    unit = forearm_hand_m / ratios.forearm_hand_length
    wrist, hand_length = unit * forearm.length, unit * hand.length
    masses = mass_kg * np.array([forearm.mass, hand.mass])
    centres = np.array([forearm.com * wrist, wrist + hand.com * hand_length])
    segment_inertias = (
        masses * np.array([forearm.gyration * wrist, hand.gyration * hand_length]) ** 2
    )
    com = float(masses @ centres / masses.sum())
    return TwoLinkArm(
        upper_arm_m=upper_arm_m,
        forearm_hand_m=forearm_hand_m,
        upper_arm_kg=mass_kg * upper.mass,
        forearm_hand_kg=float(masses.sum()),
        upper_arm_com_m=upper.com * upper_arm_m,
        forearm_hand_com_m=com,
        upper_arm_inertia_kgm2=mass_kg * upper.mass * (upper.gyration * upper_arm_m) ** 2,
        # parallel axis: I = sum I_i + m_i (c_i - c)^2
        forearm_hand_inertia_kgm2=float(segment_inertias.sum() + masses @ (centres - com) ** 2),
    )


def arm_of(subject: Subject, *, table: Table = "winter", sex: Sex = "male") -> TwoLinkArm:
    """Build the two-link arm of a recording's subject, from the stated facts.

    Parameters
    ----------
    subject : Subject
    table : {"winter", "de_leva"}
    sex : {"male", "female"}
        Winter does not distinguish.

    Returns
    -------
    TwoLinkArm

    Raises
    ------
    InputError
        The body mass, or a length and the height, are not known.
    """
    if subject.mass_kg is None:
        raise InputError(f"subject {subject.id}: no body mass", expected="mass_kg of the subject")
    return two_link_arm(
        subject.mass_kg,
        subject.height_m,
        table=table,
        sex=sex,
        upper_arm_m=subject.upper_arm_m,
        forearm_hand_m=subject.forearm_hand_m,
    )


def hand_rod(links: TwoLinkArm, *, table: Table = "winter", sex: Sex = "male") -> Rod:
    """Build the hand beyond a free wrist, as a part of forearm and hand.

    Parameters
    ----------
    links : TwoLinkArm
        As `two_link_arm` makes it; forearm and hand keep their proportion.
    table : {"winter", "de_leva"}
    sex : {"male", "female"}
        Winter does not distinguish.

    Returns
    -------
    Rod
        Its length is from the wrist to the grip's centre. Winter has no radius of gyration about
        the long axis: de Leva's is used.
    """
    ratios, long = arm_ratios(table, sex), DE_LEVA[sex].hand
    unit = links.forearm_hand_m / ratios.forearm_hand_length
    share = ratios.hand.mass / (ratios.forearm.mass + ratios.hand.mass)
    length, kg = unit * ratios.hand.length, share * links.forearm_hand_kg
    return Rod(
        length_m=ratios.grip * length,
        kg=kg,
        com_m=ratios.hand.com * length,
        across_kgm2=kg * (ratios.hand.gyration * length) ** 2,
        along_kgm2=kg * ((long.gyration_long or 0.0) * unit * long.length) ** 2,
    )


def _length(name: str, measured: float | None, ratio: float, height_m: float | None) -> float:
    if measured is not None:
        _require(name, measured, 1.0)
        return measured
    if height_m is None:
        raise InputError(f"{name} is not known", expected=f"{name}, or the height of the body")
    _require("height in m", height_m, 3.0)
    return ratio * height_m


def _require(name: str, value: float, most: float) -> None:
    if not (np.isfinite(value) and 0 < value <= most):
        raise InputError(f"{name} is {value}", expected=f"more than 0 and at most {most:g}")
