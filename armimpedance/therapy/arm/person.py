"""The segments of a recording's subject: lengths and masses from what is known of the person."""

from __future__ import annotations

from armimpedance.arm import WINTER
from armimpedance.errors import InputError
from armimpedance.records import Subject
from armimpedance.therapy.arm.passive_arm import ArmSegment, winter_segments


def segments_of(
    subject: Subject,
    *,
    mass_kg: float | None = None,
    upper_arm_m: float | None = None,
    forearm_m: float | None = None,
    hand_m: float | None = None,
    point_masses: bool = False,
) -> tuple[ArmSegment, ...]:
    """Upper arm, forearm and hand of a person; what is given goes before what the recording says.

    A forearm or hand that is not known keeps Winter's proportion to the measured length from elbow
    to grip, or else to the height.

    Parameters
    ----------
    subject : Subject
    mass_kg : float, optional
        Of the body.
    upper_arm_m, forearm_m, hand_m : float, optional
        Shoulder to elbow, elbow to wrist, wrist to finger tip.
    point_masses : bool
        As in the source.

    Raises
    ------
    InputError
        The body mass, or a length, is not known or cannot be.
    """
    mass_kg = mass_kg if mass_kg is not None else subject.mass_kg
    if mass_kg is None:
        raise InputError(f"subject {subject.id}: no body mass", expected="mass_kg of the subject")
    return winter_segments(
        mass_kg,
        upper_arm_length(subject, upper_arm_m),
        forearm_m if forearm_m is not None else _beyond_elbow(subject, WINTER.forearm.length),
        hand_m if hand_m is not None else _beyond_elbow(subject, WINTER.hand.length),
        point_masses=point_masses,
    )


def upper_arm_length(subject: Subject, given: float | None = None) -> float:
    """Length of the upper arm, to which the robot is adjusted too.

    Raises
    ------
    InputError
        Neither it nor the height is known.
    """
    if given is not None:
        return given
    if subject.upper_arm_m is not None:
        return subject.upper_arm_m
    return WINTER.upper_arm.length * _height(subject, "upper_arm_m")


def _beyond_elbow(subject: Subject, ratio: float) -> float:
    if subject.forearm_hand_m is not None:
        return ratio * subject.forearm_hand_m / WINTER.forearm_hand_length
    return ratio * _height(subject, "forearm_hand_m")


def _height(subject: Subject, missing: str) -> float:
    if subject.height_m is None:
        raise InputError(
            f"subject {subject.id}: {missing} is not known", expected="it, or height_m"
        )
    return subject.height_m
