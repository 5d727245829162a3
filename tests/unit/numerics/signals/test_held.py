"""Lost samples that were filled with the last one, and what is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.numerics.signals.sample_faults import check_held


@pytest.fixture(scope="module")
def sound(limb):
    return limb.record(sets=1, force_noise=0.05, seed=5)


def held(values, share, length, seed):
    rng, values = np.random.default_rng(seed), values.copy()
    for start in rng.integers(1, len(values) - length, round(share * len(values) / length)):
        values[start : start + length] = values[start - 1]
    return values


@pytest.mark.parametrize("channel", ["position", "force"])
@pytest.mark.parametrize("length", [6, 20])
def test_samples_that_were_held_are_told(sound, channel, length):
    filled = held(getattr(sound, channel), 0.05, length, seed=2)
    found = check_held(replace(sound, **{channel: filled}))
    assert found.verdict == "warning"
    assert channel in found.message


@pytest.mark.parametrize("step_m", [2e-5, 1e-4, 5e-4])
def test_a_coarse_encoder_is_no_lost_sample(sound, step_m):
    coarse = np.round(sound.position / step_m) * step_m
    assert check_held(replace(sound, position=coarse)).verdict == "ok"


def test_a_clipped_force_and_a_coarse_one_are_none(sound):
    force = np.clip(sound.force, -1.0, 1.0)
    assert check_held(replace(sound, force=force)).verdict == "ok"
    force = np.round(sound.force / 0.5) * 0.5
    assert check_held(replace(sound, force=force)).verdict == "ok"
    assert check_held(replace(sound, force=np.zeros_like(force))).verdict == "ok"


@pytest.mark.parametrize("lengths_m", [(0.30, 0.33), (0.2, 0.5)])
def test_an_encoder_that_is_read_behind_kinematics_in_single_precision_is_none(sound, lengths_m):
    first, second = lengths_m
    around = sound.position - sound.position.mean(axis=0)
    x, y = (np.round(around / 2e-5) * 2e-5 + [0.2, 0.35]).T
    inner = np.arccos((first**2 + x**2 + y**2 - second**2) / (2 * first * np.hypot(x, y)))
    angle1 = np.float32(np.arctan2(y, x) - inner).astype(float)
    angle2 = np.arctan2(y - first * np.sin(angle1), x - first * np.cos(angle1))
    angle2 = np.float32(angle2).astype(float)
    behind = first * np.column_stack([np.cos(angle1), np.sin(angle1)])
    behind += second * np.column_stack([np.cos(angle2), np.sin(angle2)])
    assert check_held(replace(sound, position=behind)).verdict == "ok"
    filled = held(behind, 0.05, 20, seed=2)
    assert check_held(replace(sound, position=filled)).verdict == "warning"


def at_rest(sound, digit_m):
    """Read by a sensor whose noise at rest is far below its last digit; the hand creeps at rest.

    Kinematics behind it make steps of their own, far below that digit, while the hand moves.
    """
    rng = np.random.default_rng(7)
    clock = np.arange(len(sound.position)) / sound.sample_rate_hz
    creeping = sound.position + np.outer(clock, [8e-5, -5e-5])
    read = np.round(creeping / digit_m) * digit_m
    moves = np.abs(np.gradient(creeping[:, 0], clock)) > 2e-3
    read[moves] = creeping[moves] + rng.normal(0, 1e-8, (moves.sum(), 2))
    return read


@pytest.mark.parametrize("digit_m", [2e-6, 4.4e-6, 2e-5])
def test_the_last_digit_of_a_sensor_at_rest_is_no_lost_sample(sound, digit_m):
    read = at_rest(sound, digit_m)
    assert (np.diff(read, axis=0) == 0).all(axis=1).mean() > 0.2  # it does stand still
    assert check_held(replace(sound, position=read)).verdict == "ok"
    lost = held(sound.position, 0.05, 20, seed=2)
    assert check_held(replace(sound, position=lost)).verdict == "warning"


def test_what_is_held_for_less_than_five_milliseconds_is_not_said(sound):
    assert check_held(replace(sound, force=held(sound.force, 0.05, 3, seed=2))).verdict == "ok"
