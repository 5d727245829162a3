"""Bad input of passive joints: one clear line each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.motion import EmgSignals
from armimpedance.core.records import Recording
from armimpedance.joint.relaxed.identify import identify_passive
from armimpedance.joint.relaxed.linear import from_joint_recording
from armimpedance.joint.relaxed.samples import PassiveSamples, from_motion
from armimpedance.numerics.signals.emg.silence import emg_gate, recorded_emg

RATE = 1000.0


def driven(motion, truth=(2.0, 0.1, 0.02, 0.3), sign=1.0, noise=0.0, rate=100.0, seconds=10.0):
    """A joint recording: an angle by `motion`(t) -> q, qd and its passive torque."""
    t = np.arange(round(seconds * rate)) / rate
    q, qd = motion(t)
    k, h, f, rest = truth
    torque = sign * (k * (q - rest) + h * qd + f * np.sign(qd))
    rng = np.random.default_rng(0)
    return Recording(
        kind="joint",
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": [1], "condition": ["slow"]}),
        offsets=np.array([0, len(t)]),
        time_s=t,
        position=q[:, None] + noise * 0.02 * rng.standard_normal((len(t), 1)),
        force=torque[:, None] + noise * rng.standard_normal((len(t), 1)),
    )


def swing(t):
    a, b = 2 * np.pi * 0.5, 2 * np.pi * 1.1
    q = 0.2 + 0.4 * np.sin(a * t) + 0.2 * np.sin(b * t + 1)
    return q, 0.4 * a * np.cos(a * t) + 0.2 * b * np.cos(b * t + 1)


@pytest.mark.parametrize("method", ["parallel", "output-error"])
def test_a_joint_recording_gives_its_truth_within_its_interval(method):
    samples = from_joint_recording(driven(swing, noise=0.02))
    (fit,) = identify_passive(samples, rest_angle=0.3, method=method, cross_validate=False)
    for name, truth in zip(("k", "h", "f"), (2.0, 0.1, 0.02), strict=True):
        found = fit.parameters[name]
        assert abs(found.value - truth) < 4 * found.sd_robust, name
    assert not fit.warnings


def test_torque_of_the_other_sign_is_turned_and_said():
    turned = from_joint_recording(driven(swing, sign=-1.0, noise=0.01))
    right = from_joint_recording(driven(swing, sign=1.0, noise=-0.01))
    assert "sign was turned" in turned.notes[0]
    assert not right.notes
    (fit,) = identify_passive(turned, rest_angle=0.3, cross_validate=False)
    assert fit.parameters["k"].value == pytest.approx(2.0, rel=0.02)
    assert "sign was turned" in fit.warnings[0]
    kept = from_joint_recording(driven(swing, sign=-1.0, noise=0.01), torque_sign=1)
    (negative,) = identify_passive(kept, rest_angle=0.3, cross_validate=False)
    assert negative.parameters["k"].value < 0
    assert any("negative stiffness" in w for w in negative.warnings)


def test_an_unstable_joint_that_dissipates_is_left_as_it_is():
    # negative stiffness alone is no proof of a turned sign
    samples = from_joint_recording(driven(swing, truth=(-1.0, 0.3, 0.05, 0.3), noise=0.01))
    assert not samples.notes


def test_degrees_are_not_radians():
    recording = driven(swing)
    with pytest.raises(InputError, match="degrees"):
        from_joint_recording(replace(recording, position=np.rad2deg(recording.position)))


def test_degrees_are_not_radians_in_a_motion(forearm):
    motion, _ = forearm.swings(trials=1, samples=60, substeps=8)
    with pytest.raises(InputError, match=r"right_elbow_flexion.*degrees"):
        from_motion(replace(motion, coordinates=np.rad2deg(motion.coordinates)), [forearm.elbow])


def test_constant_motion_names_what_is_lost():
    still = driven(lambda t: (0.5 + 0 * t, 0 * t))
    with pytest.raises(NotIdentifiableError, match="q1 stands still: h, f") as told:
        identify_passive(from_joint_recording(still), rest_angle=0.3)
    assert told.value.parameters == ("h", "f")
    with pytest.raises(NotIdentifiableError, match="k, h, f, q_r"):
        identify_passive(from_joint_recording(still), rest_angle="free")


def test_one_way_with_a_free_rest_angle_is_refused():
    def ramp(t):
        return -0.8 + 0.16 * t + 0.002 * t**2, 0.16 + 0.004 * t

    samples = from_joint_recording(driven(ramp), cutoff_hz=None)
    with pytest.raises(NotIdentifiableError, match=r"one way only.*f .*q_r") as told:
        identify_passive(samples, rest_angle="free")
    assert told.value.parameters == ("f", "q_r")
    (fit,) = identify_passive(samples, rest_angle=0.3, cross_validate=False)
    assert fit.parameters["k"].value == pytest.approx(2.0, rel=1e-6)


def test_cut_off_samples_joints_and_methods_are_checked(forearm):
    motion, _ = forearm.swings(trials=1, samples=60, substeps=8)
    with pytest.raises(InputError, match="15"):
        from_motion(motion, [forearm.elbow], cutoff_hz=20.0)
    with pytest.raises(InputError, match=r"no joint 'knee'.*right_elbow_flexion"):
        from_motion(motion, ["knee"])
    with pytest.raises(InputError, match="no joint 'trunk_x'"):
        from_motion(motion, ["trunk_x"])
    short, _ = forearm.swings(trials=1, samples=10, substeps=8)
    with pytest.raises(InputError, match="10 samples in a trial"):
        from_motion(short, [forearm.elbow])
    samples = from_motion(motion, [forearm.elbow])
    with pytest.raises(InputError, match=r"unknown method 'magic'.*parallel"):
        identify_passive(samples, rest_angle=1.0, method="magic")
    with pytest.raises(InputError, match="rest angles of knee"):
        identify_passive(samples, rest_angle={"knee": 1.0})
    with pytest.raises(InputError, match="kind 'hand'"):
        from_joint_recording(replace(driven(swing), kind="hand"))


def test_few_samples_are_refused():
    few = PassiveSamples(
        30.0, np.array([0, 8]), ("q1",), *np.random.default_rng(0).normal(size=(4, 8, 1))
    )
    with pytest.raises(InputError, match="8 samples of q1 for 3 parameters"):
        identify_passive(few, rest_angle=0.0)


def test_output_error_needs_a_skeleton_or_a_measured_torque(forearm):
    motion, _ = forearm.swings(trials=1, samples=90, substeps=8)
    bare = replace(from_motion(motion, [forearm.elbow]), hinges=None)
    with pytest.raises(InputError, match="no measured torque"):
        identify_passive(bare, rest_angle=1.0, method="output-error")


def emg(levels_percent, seconds=8.0, seed=0):
    """Normalised EMG whose rectified mean is `levels_percent`(t) of the maximum, (S, m)."""
    t = np.arange(round(seconds * RATE)) / RATE
    noise = np.random.default_rng(seed).standard_normal((len(t), 2)) * np.sqrt(np.pi / 2)
    signals = noise * levels_percent(t) / 100
    return EmgSignals(RATE, np.array([0, len(t)]), signals, ("biceps", "triceps"))


TRIALS = pd.DataFrame({"trial": [7], "condition": ["p5"]})


def test_a_relaxed_arm_passes_the_gate_and_its_level_is_told():
    level = emg_gate(emg(lambda t: np.full((len(t), 2), 2.0)), TRIALS)
    # the mean of 8 s of rectified white noise has a standard error of some .5 % of itself
    np.testing.assert_allclose(level.mean_percent, 2.0, rtol=0.04)
    assert (level.highest_percent >= level.mean_percent).all()


def test_a_burst_is_refused_with_muscle_trial_time_and_size():
    def burst(t):
        level = np.full((len(t), 2), 2.0)
        level[(t > 4) & (t < 5.2), 1] = 8.0
        return level

    with pytest.raises(InputError, match=r"trial 7: triceps at [78]\.\d % .* from 4\.") as told:
        emg_gate(emg(burst), TRIALS)
    assert "\n" not in str(told.value)
    assert emg_gate(emg(burst), TRIALS, limit_percent=10.0).highest_percent[0, 1] > 6


def test_emg_in_volts_needs_its_maximum():
    volts = replace(emg(lambda t: np.full((len(t), 2), 2.0)), unit="V")
    with pytest.raises(InputError, match="mvc_biceps_V"):
        emg_gate(volts, TRIALS)
    known = TRIALS.assign(mvc_biceps_V=0.5, mvc_triceps_V=2.0)
    level = emg_gate(volts, known, limit_percent=10.0)
    np.testing.assert_allclose(level.mean_percent, [[4.0, 1.0]], rtol=0.04)
    with pytest.raises(InputError, match="not positive"):
        emg_gate(volts, known.assign(mvc_biceps_V=0.0))


def test_emg_of_a_joint_recording_is_found_in_it():
    recording = driven(swing, rate=RATE)
    assert recorded_emg(recording) is None
    more = replace(
        recording, emg=np.ones((len(recording.time_s), 1)), muscles=("biceps",), emg_unit="V"
    )
    found = recorded_emg(more)
    assert found.unit == "V"
    assert found.muscles == ("biceps",)


def test_one_short_swing_is_enough_for_output_error(forearm):
    motion, _ = forearm.swings(trials=1, samples=80, substeps=8, angle_noise=1e-3)
    samples = from_motion(motion, [forearm.elbow])
    (fit,) = identify_passive(samples, rest_angle=1.0, method="output-error", cross_validate=False)
    for name in ("k", "h", "f"):
        found = fit.parameters[name]
        assert abs(found.value - getattr(forearm.truth, name)) < 4 * found.sd_robust, name
