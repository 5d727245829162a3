"""A robot that yields to the person's own force: named, and the way out holds the truth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.records import Recording
from armimpedance.hand.still import check_response
from manipulandum_sim.hand import Truth, simulate
from manipulandum_sim.hand.robot import Servo
from manipulandum_sim.space import SpaceTruth, simulate_space


@cache
def forced() -> tuple[Recording, SpaceTruth]:
    return simulate_space(seed=1, sets=2, control="force")


def warned(recording: Recording) -> list[str]:
    return [check.name for check in check_response(recording) if check.verdict == "warning"]


@pytest.mark.study
def test_own_motion_is_named_and_nothing_that_it_looks_like():
    assert warned(forced()[0]) == ["own motion"]


@cache
def behind(servo: float) -> tuple[Recording, Truth]:
    """In the plane, a robot of this stiffness."""
    rig = {"servo": Servo(servo), "emg": False}
    return simulate("cocontraction", seed=1, sets=3, conditions=["cocontraction_10"], **rig)


@pytest.mark.parametrize(("servo", "named"), [(1_000.0, False), (300.0, True)])
def test_a_servo_is_named_where_it_yields_to_the_person(servo, named):
    assert ("own motion" in warned(behind(servo)[0])) == named


def test_the_method_that_is_named_holds_the_truth_in_the_plane():
    recording, truth = behind(300.0)
    (found,) = ai.estimate(recording, method="instruments")
    # four elements of t with many degrees of freedom: one in 4000 beyond four standard errors
    assert (np.abs(found.stiffness - truth.K_e[0]) < 4 * found.sd[2]).all()
    (plain,) = ai.estimate(recording)
    assert any(text.startswith("own motion") for text in plain.warnings)


@pytest.mark.study
def test_the_method_that_is_named_holds_the_truth():
    recording, truth = forced()
    (found,) = ai.estimate(recording, method="instruments")
    low, high = found.interval()
    held = (low[2] <= truth.K_e[0]) & (truth.K_e[0] <= high[2])
    # nine elements that go together
    assert held.mean() > 0.75
    (plain,) = ai.estimate(recording)
    assert any(text.startswith("own motion") for text in plain.warnings)
    assert np.linalg.eigvalsh(plain.inertia)[0] < 0
