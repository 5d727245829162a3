"""A robot that yields to the person's own force: named, and the way out holds the truth."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.core.records import Recording
from armimpedance.hand.still import check_response
from manipulandum_sim.hand import simulate
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


@pytest.mark.parametrize(("servo", "named"), [(1_000.0, False), (300.0, True)])
def test_a_servo_is_named_where_it_yields_to_the_person(servo, named):
    recording, _ = simulate(
        "cocontraction", seed=1, sets=3, conditions=["cocontraction_10"], servo=Servo(servo)
    )
    assert ("own motion" in warned(recording)) == named


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
