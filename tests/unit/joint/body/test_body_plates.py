"""Plates that do not belong to the motion: late, or of another gain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.records import Subject
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def walked(small, rigs):
    """Three motions of a small tree with noise of plates and angles."""
    exact = rigs.moving(small, 6, trials=3, size=0.3)[0]
    rng = np.random.default_rng(2)
    q, w = exact.coordinates, exact.wrenches
    return replace(
        exact,
        coordinates=q + 2e-4 * rng.standard_normal(q.shape),
        wrenches=w + np.repeat([0.5, 0.1], 3) * rng.standard_normal(w.shape),
    )


def late(recording, delay_s):
    w = np.array(recording.wrenches)
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        clock = np.arange(len(w[at])) / recording.sample_rate_hz
        flat = w[at].reshape(len(clock), -1)
        moved = [np.interp(clock - delay_s, clock, column) for column in flat.T]
        w[at] = np.stack(moved, axis=1).reshape(w[at].shape)
    return replace(recording, wrenches=w)


def check(recording, name):
    fit = identify_body(recording, choice=RowChoice(cutoff_hz=6.0), check=False, motions=None,
                        noise_draws=0)  # fmt: skip
    found = [one for one in fit.checks if one.name == name]
    assert all((one.sentence in fit.warnings) == (one.verdict == "warning") for one in found)
    return found[0] if found else None


@pytest.mark.parametrize("delay_s", [-0.01, 0.0, 0.01])
def test_plates_out_of_step_with_the_motion_are_named(walked, delay_s):
    skew = check(late(walked, delay_s), "skew")
    assert skew.verdict == ("warning" if delay_s else "ok")
    if delay_s:
        told = float(skew.message.split("come ")[1].split(" ms")[0])
        # the parameters take a part of it, so that it is told too small rather than too large
        assert 0.5 < told / (1e3 * delay_s) < 1.1


@pytest.mark.parametrize(("gain", "verdict"), [(1.0, "ok"), (1.05, "warning"), (0.96, "warning")])
def test_plates_of_another_gain_are_named(walked, gain, verdict):
    mass = walked.wrenches[..., 2].sum(axis=1).mean() / 9.80665
    scaled = replace(
        walked, wrenches=gain * walked.wrenches, subject=Subject("A", mass_kg=float(mass))
    )
    assert check(scaled, "weight").verdict == verdict
    if gain != 1.0:
        # the scale is known to 5 % only
        unsure = replace(scaled, subject=replace(scaled.subject, mass_sd_kg=float(0.05 * mass)))
        assert check(unsure, "weight").verdict == "ok"


def test_a_plate_that_lies_or_points_elsewhere_is_named_with_where(walked):
    assert check(walked, "plate").verdict == "ok"
    moved = replace(walked, plate_origins_m=walked.plate_origins_m + [[0.03, 0.0, 0.0]])
    told = check(moved, "plate")
    assert told.verdict == "warning"
    assert float(told.message.split("lies ")[1].split(",")[0]) == pytest.approx(30, abs=6)
    turn = np.deg2rad(5)
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1.0]])
    w = np.concatenate([walked.wrenches[..., :3] @ R.T, walked.wrenches[..., 3:] @ R.T], axis=-1)
    told = check(replace(walked, wrenches=w), "plate")
    assert told.verdict == "warning"
    degrees = float(told.message.split(" mm, ")[1].split(" degrees")[0])
    assert degrees == pytest.approx(5, abs=1)
