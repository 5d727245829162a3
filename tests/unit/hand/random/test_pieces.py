"""A session under random perturbations as its own witness, on a limb solved line by line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_random_hand import PLANE, linear_session

from armimpedance.hand.random import identify_random


def session(recording):
    """What the first group's warnings say of the session."""
    (one,) = identify_random(recording)
    return [text for text in one.estimate.warnings if text.startswith("session: ")]


def scaled(recording, gain):
    """The force of every axis times a gain (N, 2)."""
    part = np.arange(len(recording.force)) / len(recording.force)
    return replace(recording, force=recording.force * gain(part))


@pytest.mark.parametrize("imposed", ["position", "force"])
def test_a_clean_session_is_no_alarm(imposed):
    for seed in range(3):
        assert not session(linear_session(seed=seed, imposed=imposed, reflex=0.1 * seed))


def test_a_gain_that_steps_in_the_middle_of_one_trial_is_named_with_its_time():
    said = session(scaled(linear_session(seed=4), lambda t: np.c_[1 + 0.1 * (t >= 0.5)]))
    assert "M changes by +10 %" in said[0]
    assert "from trial 1 at 30 s on" in said[0]
    assert "gain" in said[0]


def test_one_channel_is_named_by_its_axis():
    half = scaled(
        linear_session(seed=5), lambda t: np.stack([1 - 0.5 * (t >= 0.5), 1 + 0 * t], axis=1)
    )
    assert "M along x changes by -50 %" in session(half)[0]


def test_a_sign_that_turns_in_the_last_trial_is_named():
    turned = scaled(
        linear_session(seed=6, trials=4, seconds=15.0),
        lambda t: np.stack([1 + 0 * t, 1 - 2.0 * (t >= 0.75)], axis=1),
    )
    assert "sign of M along y turns from trial 4" in session(turned)[0]


def test_stiffness_that_changes_is_no_alarm():
    M, B, K = PLANE
    fresh = linear_session(seed=7, seconds=30.0)
    tired = linear_session((M, B, 0.7 * K), seed=9, seconds=30.0)

    def both(name):
        return np.concatenate([getattr(fresh, name), getattr(tired, name)])

    joined = replace(
        fresh,
        trials=fresh.trials.iloc[[0, 0]].assign(trial=[1, 2]).reset_index(drop=True),
        offsets=np.array([0, len(fresh.time_s), 2 * len(fresh.time_s)]),
        extra={k: np.concatenate([v, tired.extra[k]]) for k, v in fresh.extra.items()},
        **{name: both(name) for name in ("time_s", "position", "force")},
    )
    assert not session(joined)


def test_a_short_record_is_not_asked():
    short = linear_session(seed=10, seconds=12.0)
    assert not session(scaled(short, lambda t: np.c_[1 + 0.5 * (t >= 0.5)]))


def test_a_piece_in_which_the_robot_stands_still_is_left_out():
    still = linear_session(seed=11)
    n = int(20 * still.sample_rate_hz)
    held = {name: np.array(getattr(still, name)) for name in ("position", "force")}
    extra = {name: np.array(values) for name, values in still.extra.items()}
    for values in (*held.values(), *extra.values()):
        values[:n] = 0.0
    assert not session(replace(still, **held, extra=extra))
