"""The segments of a recording's subject: lengths and masses from what is known of the person."""

from __future__ import annotations

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.joint.therapy.arm.passive_arm import ArmSegment, winter_segments
from armimpedance.limb.arm import WINTER


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
        Who was recorded, with what is known of the body.
    mass_kg : float, optional
        Mass of the whole body, kg.
    upper_arm_m, forearm_m, hand_m : float, optional
        Shoulder to elbow, elbow to wrist, wrist to finger tip, m.
    point_masses : bool
        As in the source: segments have no inertia of their own.

    Returns
    -------
    tuple of ArmSegment

    Raises
    ------
    InputError
        The body mass, or a length, is not known or cannot be.
    """
    mass_kg = mass_kg if mass_kg is not None else subject.mass_kg
    if mass_kg is None:
        raise _unknown(subject, "the body mass", "subject.mass_kg", "mass-kg")
    return winter_segments(
        mass_kg,
        upper_arm_length(subject, upper_arm_m),
        forearm_m if forearm_m is not None else _beyond_elbow(subject, "forearm"),
        hand_m if hand_m is not None else _beyond_elbow(subject, "hand"),
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
    if subject.height_m is None:
        where = "subject.upper_arm_m or height_m"
        raise _unknown(subject, "the upper arm's length", where, "upper-arm-m")
    return WINTER.upper_arm.length * subject.height_m


def _beyond_elbow(subject: Subject, part: str) -> float:
    """Length of the forearm or of the hand."""
    ratio = getattr(WINTER, part).length
    if subject.forearm_hand_m is not None:
        return float(ratio * subject.forearm_hand_m / WINTER.forearm_hand_length)
    if subject.height_m is None:
        where = "subject.forearm_hand_m or height_m"
        raise _unknown(subject, f"the {part}'s length", where, f"{part}-m")
    return float(ratio * subject.height_m)


def _unknown(subject: Subject, what: str, where: str, option: str) -> InputError:
    return InputError(
        f"subject {subject.id}: {what} is not known",
        expected=f"{where} in recording.json, or --{option}",
    )
