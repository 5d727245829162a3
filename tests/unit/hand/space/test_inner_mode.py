"""A free elbow: its estimate is corrected, its intervals allow for the swivel, and it is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.still import check_response
from armimpedance.hand.still.show import estimate
from manipulandum_sim.space import SpaceCondition, simulate_space


@pytest.fixture(scope="module")
def soft():
    """5 % co-contraction, sensors' noise only: the swivel is plain to see."""
    made = [SpaceCondition("nominal", 0.05)]
    return simulate_space(made, seed=2, sets=3, directions=6, noise="sensor", elbow="free")


def said(recording, elbow):
    trials = recording.trials.drop(columns="elbow")
    return replace(recording, trials=trials if elbow is None else trials.assign(elbow=elbow))


def along_softest(matrix, truth):
    n = np.linalg.eigh(truth)[1][:, 0]
    return n @ matrix @ n


def test_the_swivel_is_named_and_half_of_the_error_or_more_is_taken_off(soft):
    recording, truth = soft
    K = truth.K_e[0]
    told = estimate(recording)[0]
    silent = estimate(said(recording, "held"))[0]
    errors = [np.linalg.norm(e.stiffness - K) / np.linalg.norm(K) for e in (silent, told)]
    assert errors[0] > 0.08
    assert errors[1] < errors[0] / 2
    assert any("swivel" in w for w in told.warnings)
    assert not any("swivel" in w for w in silent.warnings)
    softest = [along_softest(e.stiffness, K) for e in (silent, told)]
    assert softest[0] > softest[1]


def test_what_nobody_said_is_taken_as_free(soft):
    recording, _ = soft
    told = estimate(said(recording, None))[0]
    assert any("swivel" in w for w in told.warnings)


def test_inspect_finds_the_mode_unless_the_elbow_was_held(soft):
    recording, _ = soft
    found = {one.name: one for one in check_response(recording)}
    assert found["inner mode"].verdict == "warning"
    assert "inner mode" not in {one.name for one in check_response(said(recording, "held"))}


def test_a_word_that_is_neither_held_nor_free_is_refused(soft):
    recording, _ = soft
    with pytest.raises(InputError, match="elbow"):
        estimate(said(recording, "tied"))


def test_a_column_of_that_name_is_a_laboratory_s_own_in_the_plane(soft):
    recording, _ = soft
    plane = replace(
        recording,
        position=recording.position[:, :2],
        force=recording.force[:, :2],
        extra={},
        shoulder_m=None,
        gravity_m_s2=None,
        trials=recording.trials.drop(columns="elevation_deg").assign(elbow=1.2),
    )
    assert "inner mode" not in {one.name for one in check_response(plane)}
