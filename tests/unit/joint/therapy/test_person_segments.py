"""A person's segments from what is known of the body."""

from __future__ import annotations

import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.joint.therapy.arm.passive_arm import segments_of, upper_arm_length
from armimpedance.limb.arm.anthropometry import WINTER, two_link_arm


def first_moment(segments, link):
    own = [s for s in segments if s.link == link]
    return sum(s.mass_kg * s.com_m for s in own), sum(s.mass_kg for s in own)


def test_it_agrees_with_the_two_link_arm_of_the_same_table():
    known = Subject("A", 65.0, 1.70)
    planar, segments = two_link_arm(65.0, 1.70), segments_of(known)
    moment, mass = first_moment(segments, "forearm")
    assert mass == pytest.approx(planar.forearm_hand_kg)
    assert moment / mass == pytest.approx(planar.forearm_hand_com_m)
    moment, mass = first_moment(segments, "upper_arm")
    assert moment / mass == pytest.approx(planar.upper_arm_com_m)
    assert mass == pytest.approx(planar.upper_arm_kg)


def test_measured_lengths_go_before_the_height_and_options_before_both():
    tall = Subject("A", 65.0, 1.90, upper_arm_m=0.31, forearm_hand_m=0.34)
    assert upper_arm_length(tall) == 0.31
    assert upper_arm_length(tall, 0.29) == 0.29
    upper, forearm, _ = segments_of(tall)
    assert upper.com_m == pytest.approx(WINTER.upper_arm.com * 0.31)
    wrist = 0.34 * WINTER.forearm.length / WINTER.forearm_hand_length
    assert forearm.com_m == pytest.approx(WINTER.forearm.com * wrist)
    heavier = segments_of(tall, mass_kg=130.0)
    assert heavier[0].mass_kg == pytest.approx(2 * upper.mass_kg)


@pytest.mark.parametrize(
    ("subject", "words"),
    [
        (Subject("A", None, 1.7), "the body mass is not known"),
        (Subject("A", 65.0), "the upper arm's length is not known"),
        (Subject("A", 65.0, upper_arm_m=0.3), "the forearm's length is not known"),
        (Subject("A", 65.0, upper_arm_m=30.0, forearm_hand_m=0.34), "upper_arm_m is 30"),
        (Subject("A", -65.0, 1.7), "body mass"),
    ],
)
def test_what_is_missing_is_named(subject, words):
    with pytest.raises(InputError, match=words):
        segments_of(subject)
