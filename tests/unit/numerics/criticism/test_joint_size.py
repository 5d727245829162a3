"""Sizes that no joint of a person has."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.show import elbow
from armimpedance.numerics.criticism import check_joint_size
from manipulandum_sim.elbow import simulate_bench


@pytest.mark.parametrize(("value", "verdict"), [(0.07, "ok"), (70.0, "warning"), (7e-5, "warning")])
def test_an_inertia_in_another_unit_is_named(value, verdict):
    assert check_joint_size("inertia", value, 0.01 * value).verdict == verdict


def test_what_a_wide_interval_holds_is_not_judged():
    assert check_joint_size("inertia", 12.0, 1.0).verdict == "ok"
    assert check_joint_size("inertia", 0.0, 1e-3).verdict == "ok"


def test_a_torque_in_millinewtonmetres_is_named_and_degrees_are_refused():
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=1, duration_s=6.0, snr_db=40.0)
    (found,) = [c for c in elbow(recording).checks if c.name == "units"]
    assert found.verdict == "ok"
    fit = elbow(replace(recording, force=1000 * recording.force))
    assert any(warning.startswith("units:") for warning in fit.warnings)
    with pytest.raises(InputError, match="units"):
        elbow(replace(recording, position=np.rad2deg(recording.position)))
