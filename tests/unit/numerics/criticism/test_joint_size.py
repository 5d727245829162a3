"""Sizes that no joint of a person has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.elbow.show import elbow
from armimpedance.numerics.criticism import check_hand_size, check_joint_size
from manipulandum_sim.elbow import simulate_bench


@pytest.mark.parametrize(("value", "verdict"), [(0.07, "ok"), (70.0, "warning"), (7e-5, "warning")])
def test_an_inertia_in_another_unit_is_named(value, verdict):
    assert check_joint_size("inertia", value, 0.01 * value).verdict == verdict


def test_what_a_wide_interval_holds_is_not_judged():
    assert check_joint_size("inertia", 12.0, 1.0).verdict == "ok"
    assert check_joint_size("inertia", 0.0, 1e-3).verdict == "ok"


def test_a_torque_in_millinewtonmetres_and_an_angle_in_degrees_are_refused():
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=1, duration_s=6.0, snr_db=40.0)
    (found,) = [c for c in elbow(recording).checks if c.name == "units"]
    assert found.verdict == "ok"
    with pytest.raises(EstimationError, match="units"):
        elbow(replace(recording, force=1000 * recording.force))
    with pytest.raises(InputError, match="units"):
        elbow(replace(recording, position=np.rad2deg(recording.position)))


@pytest.mark.parametrize(
    ("mean", "mass_kg", "verdict"),
    [
        (1.3, 65.0, "ok"),
        (1.3, None, "ok"),
        (1300.0, 65.0, "unusable"),
        (1.3 / 9.81, 65.0, "unusable"),
        (0.3, 12.0, "ok"),  # a child's
        (-1.0, None, "unusable"),
    ],
)
def test_a_hands_inertia_follows_from_its_bodys_mass(mean, mass_kg, verdict):
    assert check_hand_size(mean, 0.01, mass_kg).verdict == verdict
    assert check_hand_size(mean, 1e4, mass_kg).verdict == "ok"
