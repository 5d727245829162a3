"""Lengths and masses that are not well known, in the covariance of what was mapped with them."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.records import ImpedanceEstimate, Quality, Subject
from armimpedance.hand.levels.show import to_joint
from armimpedance.hand.show import Estimates
from armimpedance.limb.arm.anthropometry import two_link_arm

WHO = Subject("A", mass_kg=70.0, upper_arm_m=0.30, forearm_hand_m=0.34)
QUALITY = Quality(1, 1, 1.0, 1.0, 1.0, 1.0, 12, 0.0)
K_E = np.array([[300.0, -90.0], [-90.0, 220.0]])


def mapped(subject, gravity=None, **given):
    """K_j of a hand whose own M, B, K are known to rounding."""
    hand = ImpedanceEstimate(
        "hand", "truth", np.eye(2), K_E / 20, K_E, 1e-12 * np.eye(12), np.inf, QUALITY,
        force=np.array([3.0, -2.0]), **given,
    )  # fmt: skip
    return to_joint(Estimates((hand,), subject, gravity))[0]


@pytest.mark.study
@pytest.mark.parametrize("known", ["joint_angles", "position"])
def test_intervals_hold_arms_of_other_lengths(known):
    places = {"joint_angles": np.array([0.7, 1.4]), "position": np.array([0.05, 0.42])}
    given = {known: places[known]}
    told = mapped(replace(WHO, length_sd_m=0.01), **given)
    rng, z = np.random.default_rng(0), []
    for _ in range(200):
        upper, lower = np.array([0.30, 0.34]) + 0.01 * rng.standard_normal(2)
        other = mapped(replace(WHO, upper_arm_m=upper, forearm_hand_m=lower), **given)
        z.append((other.stiffness - told.stiffness) / told.sd[2])
    # 200 draws of unit variance: the standard error of an sd is 5 %; curvature adds a little
    z = np.array(z)[:, [0, 1], [1, 1]]
    assert np.std(z, axis=0) == pytest.approx(1.0, abs=0.2)
    assert np.abs(np.mean(z, axis=0)).max() < 0.35
    sure = mapped(WHO, **given)
    np.testing.assert_array_equal(sure.stiffness, told.stiffness)
    assert sure.sd[2].max() < 1e-3 < told.sd[2, 1].min()
    # turning at the shoulder moves a hand whose place is known whatever the segments are
    assert (told.sd[2, 0, 0] < 1e-3) == (known == "position")


def test_what_lengths_do_is_named_for_those_who_fit_many_places():
    told = mapped(replace(WHO, length_sd_m=0.01), joint_angles=np.array([0.7, 1.4]))
    assert set(told.shared_errors) == {"upper_arm_m", "forearm_hand_m"}
    spread = sum(np.outer(d, d) for d in told.shared_errors.values())
    np.testing.assert_allclose(told.covariance, spread, atol=1e-6 * np.abs(spread).max())
    assert not mapped(WHO, joint_angles=np.array([0.7, 1.4])).shared_errors


def test_the_bodys_mass_matters_where_gravity_acts_and_only_there():
    q = {"joint_angles": np.array([0.7, 1.4])}
    unsure = replace(WHO, mass_sd_kg=7.0)
    assert mapped(unsure, **q).sd[2].max() < 1e-3
    upright = mapped(unsure, (0.0, -9.81), **q)
    gradient = mapped(WHO, **q).stiffness - mapped(WHO, (0.0, -9.81), **q).stiffness
    # masses, and with them dg/dq, are known to a tenth
    np.testing.assert_allclose(upright.sd[2], np.abs(gradient) / 10, rtol=1e-3)


def test_lengths_from_the_height_alone_are_named():
    q = {"joint_angles": np.array([0.7, 1.4])}
    tall = Subject("A", mass_kg=70.0, height_m=1.75)
    assert any(w.startswith("lengths: ") for w in mapped(tall, **q).warnings)
    assert not mapped(replace(tall, length_sd_m=0.015), **q).warnings
    assert not mapped(WHO, **q).warnings


@pytest.mark.parametrize(("longer", "named"), [(0.0, False), (0.006, False), (0.015, True)])
def test_an_arm_whose_hand_is_elsewhere_than_its_angles_say_is_named(longer, named):
    q = np.array([0.7, 1.4])
    where = two_link_arm(70.0, upper_arm_m=0.30, forearm_hand_m=0.34 + longer).hand_position(q)
    place = np.array([0.8, -0.3])
    found = mapped(WHO, joint_angles=q, position=place + where, shoulder_m=place)
    assert any(w.startswith("lengths: ") for w in found.warnings) == named


def test_a_shoulder_at_an_unknown_place_is_named():
    unknown = mapped(WHO, position=np.array([0.05, 0.42]))
    assert any(w.startswith("shoulder: ") for w in unknown.warnings)
    known = mapped(WHO, position=np.array([0.05, 0.42]), shoulder_m=np.zeros(2))
    assert not known.warnings
    np.testing.assert_array_equal(known.stiffness, unknown.stiffness)
