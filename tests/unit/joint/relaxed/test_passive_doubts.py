"""What a passive joint's fit doubts: each violation is named, and a clean recording is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.linear import from_joint_recording
from armimpedance.joint.relaxed.samples import as_still_as_shown, from_motion
from armimpedance.joint.relaxed.show.verb import passive


def verdicts(fit):
    return {check.name: check.verdict for check in fit.checks}


def held(forearm, quadratic=0.0):
    """Three releases of a forearm whose pivot is held still, markers' noise on all coordinates."""
    noise = {"angle_noise": 2e-3, "place_noise": 3e-4}
    motion, _ = forearm.swings(
        samples=150, shake_m=0.0, start=0.8, quadratic=quadratic, substeps=8, **noise
    )
    return motion


@pytest.fixture(scope="module")
def clean(forearm):
    return held(forearm)


def test_a_clean_release_is_not_doubted_and_holds_its_truth(forearm, clean):
    (fit,) = identify_passive(from_motion(clean, [forearm.elbow]), rest_angle="free")
    asked = {
        "amplitude",
        "damping",
        "friction",
        "time",
        "inertia",
        "up axis",
        "voluntary",
        "trials",
    }
    assert set(verdicts(fit)) == asked
    assert set(verdicts(fit).values()) == {"ok"}
    for name in ("k", "h", "f", "q_r"):
        found = fit.parameters[name]
        assert abs(found.value - getattr(forearm.truth, name)) < 4 * found.sd_robust, name


@pytest.mark.study
def test_a_stiffness_that_changes_with_the_angle_is_named(forearm):
    bent = held(forearm, quadratic=0.6)
    samples = from_motion(bent, [forearm.elbow])
    for method in ("output-error", "parallel"):
        (fit,) = identify_passive(samples, rest_angle="free", method=method, cross_validate=False)
        assert verdicts(fit)["amplitude"] == "warning"
        assert any(w.startswith("amplitude: ") for w in fit.warnings)


@pytest.mark.study
def test_trials_that_contradict_each_other_are_named(forearm, clean):
    # one trial with another zero of the angle: a marker that slid, or somebody who did not relax
    coordinates = clean.coordinates.copy()
    coordinates[clean.samples_of(1), 6] += 0.05
    other = replace(clean, coordinates=coordinates)
    (fit,) = identify_passive(
        from_motion(other, [forearm.elbow]), rest_angle="free", cross_validate=False
    )
    assert verdicts(fit)["trials"] == "warning"


@pytest.mark.study
def test_the_sources_filter_is_named_and_its_numbers_kept(forearm, clean):
    (fit,) = identify_passive(
        from_motion(clean, [forearm.elbow]), rest_angle=1.0, method="ls", cross_validate=False
    )
    assert verdicts(fit)["filter"] == "warning"


@pytest.mark.study
def test_a_mass_that_is_not_told_widens_and_is_said(clean):
    by = {sd: passive(clean, mass_sd_percent=sd)[0] for sd in (0.0, 5.0, None)}
    assert verdicts(by[None])["mass"] == "cannot tell"
    assert verdicts(by[5.0])["mass"] == "ok"
    assert any(w.startswith("mass: ") for w in by[None].warnings)
    for name in ("k", "h", "f"):
        weighed, told = by[0.0].parameters[name], by[5.0].parameters[name]
        expected = np.hypot(weighed.sd_robust, 0.05 * weighed.value)
        assert told.sd_robust == pytest.approx(expected, rel=1e-9)
        assert by[None].parameters[name].sd_robust > told.sd_robust
    q_r = [fit.parameters["q_r"].sd_robust for fit in by.values()]
    assert np.ptp(q_r) == 0.0
    with pytest.raises(InputError, match="mass known to 60 %"):
        passive(clean, mass_sd_percent=60)


def test_the_recording_may_say_how_well_the_mass_is_known(clean):
    who = Subject("A", mass_kg=70.0, mass_sd_kg=3.5)
    # by the least dear of the methods
    one, cheap = clean.select([0]), {"rest_angle": 1.0, "method": "parallel"}
    told = passive(replace(one, subject=who), **cheap)[0].parameters["k"]
    asked = passive(one, mass_sd_percent=5.0, **cheap)[0].parameters["k"]
    assert told.sd_robust == asked.sd_robust


@pytest.mark.study
def test_a_heavier_limb_makes_the_same_swing(forearm, clean):
    # all torques are proportional to the mass: the residual cannot show it, k and h follow it
    heavy = replace(
        clean.skeleton,
        segments=tuple(
            replace(s, mass_kg=1.05 * s.mass_kg, inertia_kgm2=1.05 * s.inertia_kgm2)
            for s in clean.skeleton.segments
        ),
    )
    right, wrong = (
        identify_passive(from_motion(m, [forearm.elbow]), rest_angle="free", cross_validate=False)[
            0
        ]
        for m in (clean, replace(clean, skeleton=heavy))
    )
    for name in ("k", "h", "f"):
        ratio = wrong.parameters[name].value / right.parameters[name].value
        assert ratio == pytest.approx(1.05, abs=1e-3), name


def test_a_joint_without_friction_has_none(forearm, clean):
    (fit,) = identify_passive(
        from_motion(clean, [forearm.elbow]), rest_angle="free", friction=False, cross_validate=False
    )
    assert fit.parameters.names == ("k", "h", "q_r")
    assert fit.friction_share_percent == 0.0


def test_what_is_held_is_still_and_what_moves_is_only_smoothed():
    t = np.arange(300) / 30.0
    rng = np.random.default_rng(4)
    noise = 1e-3 * rng.standard_normal((300, 2))
    motion = np.stack([np.zeros(300), 0.05 * np.sin(6 * t)], axis=1)
    smooth = as_still_as_shown(motion + noise, 30.0, 8.0)
    assert np.ptp(smooth[:, 0]) == 0.0
    # three fifths of white noise pass an 8 Hz low-pass at 30 frames/s
    assert np.std(smooth[30:-30, 1] - motion[30:-30, 1]) < 0.9e-3


def turned_by_a_motor(gain):
    """Six swings of a relaxed elbow by a motor that measures its torque, times a gain each."""
    rng, n, rate = np.random.default_rng(5), 500, 100.0
    t = np.arange(n) / rate
    angle, torque = [], []
    for row in range(6):
        w, phase = 2 * np.pi * rng.uniform(0.15, 0.7, 2), rng.uniform(0, 2 * np.pi, 2)
        q = 1.5 + np.array([0.5, 0.15]) @ np.sin(w[:, None] * t + phase[:, None])
        v = (np.array([0.5, 0.15]) * w) @ np.cos(w[:, None] * t + phase[:, None])
        tau = 3.0 * (q - 1.4) + 0.2 * v + 0.15 * np.sign(v)
        angle.append(q + 2e-4 * rng.standard_normal(n))
        torque.append(gain(row) * tau + 0.03 * rng.standard_normal(n))
    return Recording(
        kind="joint",
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": range(1, 7), "condition": "swing"}),
        offsets=n * np.arange(7),
        time_s=np.tile(t, 6),
        position=np.concatenate(angle)[:, None],
        force=np.concatenate(torque)[:, None],
    )


def test_a_gain_of_the_torque_that_changes_is_named_with_its_trial():
    def said(gain):
        samples = from_joint_recording(turned_by_a_motor(gain))
        (fit,) = identify_passive(samples, rest_angle="free", cross_validate=False)
        (one,) = (check for check in fit.checks if check.name == "trials")
        return one

    assert said(lambda _: 1.0).verdict == "ok"
    halved = said(lambda row: 0.5 if row >= 3 else 1.0)
    assert halved.verdict == "warning"
    assert "alike from trial 4 on by -50 %" in halved.message
