"""Random perturbations: truth within its intervals, and hostile records named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import armimpedance as ai
from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.hand.random import identify_random

RATE = 250.0
M2 = np.array([[1.3, -0.5], [-0.5, 1.6]])
B2 = np.array([[10.0, -4.0], [-4.0, 14.0]])
K2 = np.array([[231.0, -114.0], [-114.0, 369.0]])
M3 = np.array([[1.3, -0.35, 0.1], [-0.35, 1.9, 0.2], [0.1, 0.2, 1.1]])
B3 = np.array([[14.0, -5.0, 2.0], [-5.0, 40.0, 6.0], [2.0, 6.0, 12.0]])
K3 = np.array([[364.0, -169.0, 82.0], [-169.0, 1185.0, 198.0], [82.0, 198.0, 338.0]])
PLANE, SPACE = (M2, B2, K2), (M3, B3, K3)


def linear_session(
    limb=PLANE,
    *,
    seed=0,
    imposed="position",
    seconds=60.0,
    trials=1,
    reflex=0.0,
    delay_s=0.04,
    lag_s=0.0,
    own=1.0,
    extra=None,
):
    """A linear limb on a linear robot, solved line by line: exact, and periodic."""
    rng = np.random.default_rng(seed)
    M, B, K = limb
    d, n = len(M), int(seconds * RATE)
    f = np.fft.rfftfreq(n, 1 / RATE)
    s = 2j * np.pi * f[:, None, None]
    Z = M * s**2 + B * s + K + reflex * K * np.exp(-s * delay_s)
    if extra is not None:
        Z = Z + extra(s)
    inside = (f >= 2) & (f <= 20)
    stiff = imposed == "position"
    robot = 2 * np.eye(d) * s**2 + (280 if stiff else 6) * np.eye(d) * s
    robot = robot + (2e4 if stiff else 60) * np.eye(d)
    drive = robot if stiff else np.broadcast_to(np.eye(d), Z.shape)
    shape = inside / (1 + (f / 4) ** 2) if stiff else inside.astype(float)
    parts = []
    for _ in range(trials):
        c = np.fft.irfft(shape[:, None] * np.fft.rfft(rng.standard_normal((n, d)), axis=0), n, 0)
        c *= (0.0025 if stiff else 4.0) / c.std(axis=0)
        slow = 1 / (1 + (2 * np.pi * f * 0.4) ** 2) ** 0.5
        w = np.fft.irfft(slow[:, None] * np.fft.rfft(rng.standard_normal((n, d)), axis=0), n, 0)
        w *= own / w.std(axis=0)
        W, C = np.fft.rfft(w, axis=0)[..., None], np.fft.rfft(c, axis=0)[..., None]
        X = np.linalg.solve(Z + robot, drive @ C + W)
        F = (W - Z @ X) * np.exp(-s * lag_s)
        x, force = (np.fft.irfft(one[..., 0], n, axis=0) for one in (X, F))
        force = force + 0.03 * rng.standard_normal(force.shape)
        parts.append((x + 3e-6 * rng.standard_normal(x.shape), force, c))
    x, force, c = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Recording(
        kind="hand",
        sample_rate_hz=RATE,
        trials=pd.DataFrame({"trial": np.arange(1, trials + 1), "condition": "a"}),
        offsets=np.arange(trials + 1) * n,
        time_s=np.tile(np.arange(n) / RATE, trials),
        position=x,
        force=force,
        perturbation="stochastic",
        imposed=imposed,
        extra={f"command_{axis}": c[:, i] for i, axis in enumerate("xyz"[:d])},
    )


def errors(fit, limb):
    """Each number less the truth, in standard errors."""
    truth = np.concatenate([m.ravel() for m in limb])
    return (fit.estimate.parameters - truth) / np.sqrt(np.diag(fit.estimate.covariance))


@pytest.mark.parametrize("imposed", ["position", "force"])
@pytest.mark.parametrize("limb", [PLANE, SPACE], ids=["plane", "space"])
def test_truth_within_its_intervals_in_closed_loop(limb, imposed):
    fit = identify_random(linear_session(limb, imposed=imposed))[0]
    assert np.abs(errors(fit, limb)).max() < 4
    assert fit.reflex.probability < 0.5
    assert fit.lag_probability < 0.5


@pytest.mark.parametrize("imposed", ["position", "force"])
def test_a_reflex_is_named_with_its_delay_and_leaves_the_stiffness(imposed):
    recording = linear_session(SPACE, seed=1, imposed=imposed, reflex=0.25)
    fit = identify_random(recording)[0]
    assert fit.reflex.probability > 0.99
    assert abs(fit.reflex.delay_s - 0.04) < 4 * fit.reflex.delay_sd_s + 1e-3
    assert np.abs(errors(fit, SPACE)).max() < 4
    assert (np.abs(fit.reflex.matrix - 0.25 * K3) < 4.5 * fit.reflex.sd).all()


def test_without_noise_the_truth_comes_back():
    fit = identify_random(linear_session(own=1e-4, seed=2))[0]
    assert np.allclose(fit.estimate.stiffness, K2, rtol=0, atol=0.02 * K2.max())
    assert np.allclose(fit.estimate.inertia, M2, rtol=0, atol=2e-3)


def test_a_force_that_is_recorded_late_is_named_and_taken_off():
    recording = linear_session(seed=3, lag_s=0.002)
    fit = identify_random(recording)[0]
    assert fit.lag_probability > 0.5
    assert abs(fit.lag_s - 0.002) < 2e-4
    assert np.abs(errors(fit, PLANE)).max() < 4.5
    assert any(w.startswith("delay") for w in fit.estimate.warnings)


def test_several_short_trials_are_one_long_one():
    fit = identify_random(linear_session(seconds=10.0, trials=6, seed=4))[0]
    assert np.abs(errors(fit, PLANE)).max() < 4


def test_turning_the_frame_turns_the_matrices():
    recording = linear_session(seed=5, seconds=20.0)
    turn = np.array([[0.0, -1.0], [1.0, 0.0]])
    turned = replace(
        recording, position=recording.position @ turn.T, force=recording.force @ turn.T
    )
    one, other = (identify_random(r)[0].estimate for r in (recording, turned))
    assert np.allclose(turn @ one.stiffness @ turn.T, other.stiffness, rtol=1e-3, atol=0.1)
    assert np.allclose(turn @ one.inertia @ turn.T, other.inertia, rtol=1e-3, atol=1e-4)


def test_units_of_the_commands_do_not_matter():
    recording = linear_session(seed=6, seconds=20.0)
    scaled = replace(recording, extra={k: 1e3 * v for k, v in recording.extra.items()})
    one, other = (identify_random(r)[0].estimate for r in (recording, scaled))
    assert np.allclose(one.stiffness, other.stiffness, rtol=1e-6)


def test_a_force_of_the_wrong_sign_or_exchanged_axes_are_refused():
    recording = linear_session(seed=7, seconds=20.0)
    for force in (-recording.force, recording.force[:, ::-1]):
        with pytest.raises(EstimationError, match="inertia"):
            identify_random(replace(recording, force=force))


def test_commands_of_another_trial_are_refused_by_its_number():
    recording = linear_session(seconds=10.0, trials=6, seed=8)
    wrong = {}
    for name, values in recording.extra.items():
        rows = np.array(values).reshape(6, -1)
        rows[2] = np.random.default_rng(1).standard_normal(rows.shape[1]) * rows.std()
        wrong[name] = rows.ravel()
    with pytest.raises(InputError, match="trial 3"):
        identify_random(replace(recording, extra=wrong))


def test_without_commands_only_an_imposed_position_is_taken():
    recording = replace(linear_session(seed=9), extra={})
    fit = identify_random(recording)[0]
    assert any("no commands" in w for w in fit.estimate.warnings)
    with pytest.raises(InputError, match="command"):
        identify_random(replace(recording, imposed="force"))


def test_one_direction_alone_does_not_tell_the_matrices():
    recording = linear_session(seed=10)
    extra = dict.fromkeys(recording.extra, recording.extra["command_x"])
    along = np.repeat(recording.position[:, :1], 2, axis=1)
    same = replace(recording, position=along, extra=extra)
    with pytest.raises((NotIdentifiableError, EstimationError)):
        identify_random(same)


def test_a_gap_of_the_clock_is_cut_out():
    recording = linear_session(seed=11)
    time = np.array(recording.time_s)
    time[8000:] += 0.5
    force = np.array(recording.force)
    fit = identify_random(replace(recording, time_s=time, force=force))[0]
    assert np.abs(errors(fit, PLANE)).max() < 4


def test_a_mode_that_the_model_lacks_is_named():
    def extra(s):
        return 150 * s**2 / (s**2 + 2 * 0.2 * 50 * s + 50**2) * np.eye(2) * 0.5

    fit = identify_random(linear_session(seed=12, extra=extra, own=0.3))[0]
    assert any(w.startswith(("lack of fit", "reflex")) for w in fit.estimate.warnings)
    assert any(w.startswith("lack of fit") for w in fit.estimate.warnings)


def test_joints_are_taken_as_hands_are():
    recording = linear_session(seed=13, seconds=20.0)
    joints = replace(recording, kind="joint", torque="interaction")
    hand, joint = (identify_random(r)[0].estimate for r in (recording, joints))
    assert joint.level == "joint"
    assert np.allclose(hand.stiffness, joint.stiffness)


def swivelling(s):
    """At once 120 N/m more along one axis of space than at rest, with a mode of 2 Hz between."""
    n = np.array([1.0, 0.3, -0.2]) / np.linalg.norm([1.0, 0.3, -0.2])
    w, z = 2 * np.pi * 2.0, 0.6
    return 120 * np.outer(n, n) * (s**2 + 2 * z * w * s) / (s**2 + 2 * z * w * s + w**2)


def test_an_elbow_that_nobody_held_is_allowed_for_and_named():
    recording = linear_session(SPACE, seed=14, extra=swivelling)
    untold, held = (
        identify_random(one)[0].estimate
        for one in (
            recording,
            replace(recording, trials=recording.trials.assign(elbow="held")),
        )
    )
    told = [any(w.startswith("inner mode") for w in one.warnings) for one in (untold, held)]
    assert told == [True, False]
    off = [np.linalg.norm(one.stiffness - K3) for one in (untold, held)]
    assert off[0] < off[1]
    z = [np.abs((one.stiffness - K3) / one.sd[2]).max() for one in (untold, held)]
    assert z[0] < 4 < z[1]


def test_the_free_response_agrees_with_the_model_within_its_error():
    fit = identify_random(linear_session(seed=15))[0].response
    inside = (fit.frequency_hz > 3) & (fit.frequency_hz < 19)
    off = np.abs(fit.impedance - fit.model)[inside] / fit.sd[inside]
    assert np.sqrt((off**2).mean()) < 2.5
    assert fit.multiple[inside].min() > 0.5
    assert (fit.partial <= fit.multiple[..., None] + 0.05).all()


def test_a_free_wrist_stops_the_command_and_inspect():
    locked = linear_session(SPACE, seconds=30.0)
    recording = replace(locked, trials=locked.trials.assign(wrist="free"))
    with pytest.raises(InputError, match="wrist"):
        ai.random(recording)
    stops = [one.name for one in ai.inspect(recording).checks if one.verdict == "unusable"]
    assert stops == ["wrist"]
    assert ai.inspect(locked).usable
