"""Pushes that go on throughout a reach: the truth comes back, and what cannot be is refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.reaching import check_pushes, identify_course, identify_movement
from armimpedance.recordings import open_recording, write_recording
from manipulandum_sim.movement import MovementTruth, simulate_movement


@cache
def session(push: str = "random") -> tuple[Recording, MovementTruth]:
    return simulate_movement(seed=31, repeats=9, unperturbed=20, push=push)


@pytest.fixture(scope="module")
def few() -> Recording:
    """What tells nothing of the truth, and enough of the pushes."""
    rig = {"push": "random", "after_s": 0.2}
    return simulate_movement(seed=31, repeats=2, unperturbed=10, **rig)[0]


def _off(truth: MovementTruth, found: list) -> np.ndarray:
    """Errors (n, 12) in standard errors."""
    line = truth.hand[-1] - truth.hand[0]
    rows = []
    for one in found:
        travelled = float((one.position - truth.hand[0]) @ line / np.hypot(*line))
        true = np.concatenate([truth.at(f"{x}_e", travelled) for x in "MBK"], axis=None)
        rows.append(np.abs(one.parameters - true) / one.sd.ravel())
    return np.array(rows)


@pytest.mark.study
@pytest.mark.parametrize(
    ("identify", "push"),
    [
        (identify_movement, "random"),
        (identify_course, "random"),
        (identify_movement, "random-servo"),
    ],
)
def test_the_truth_lies_within_the_intervals(identify, push):
    recording, truth = session(push)
    found = identify(recording)
    # at the end of the reach the travelled way does not tell the time
    off = _off(truth, found[: len(found) // 2 + 1])
    # twelve elements at several times, of t with some 60 degrees of freedom
    assert off.max() < 5.0
    assert (off < 2.0).mean() > 0.75


@pytest.mark.study
def test_commands_that_are_not_those_of_the_robot_are_refused():
    recording, _ = session()
    shuffled = {name: np.roll(value, 40_000) for name, value in recording.extra.items()}
    with pytest.raises(InputError, match="does not follow"):
        identify_movement(replace(recording, extra=shuffled))


@pytest.mark.study
def test_without_commands_a_push_needs_its_direction():
    recording, _ = session()
    with pytest.raises(InputError, match="push_deg"):
        identify_movement(replace(recording, extra={}))


def test_the_sources_methods_take_single_pushes_only(few):
    with pytest.raises(InputError, match="throughout"):
        identify_movement(few, method="mean_difference")


def test_a_push_that_is_too_short_is_refused(few):
    table = few.trials.assign(push_end_s=few.trials["push_onset_s"] + 0.2)
    with pytest.raises(InputError, match=r"pushes of 0\.2 s"):
        identify_movement(replace(few, trials=table))


def test_the_commands_come_back_from_the_disk_and_are_told_by_the_check(few, tmp_path):
    write_recording(few, tmp_path / "reaches")
    back = open_recording(tmp_path / "reaches")
    assert np.allclose(back.extra["command_x"], few.extra["command_x"], atol=1e-6)
    assert "throughout" in check_pushes(back)[1].message
