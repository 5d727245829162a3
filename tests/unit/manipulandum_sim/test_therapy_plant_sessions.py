"""Calibration of the empty therapy robot: what sweeps and holds must show, and how it is kept."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from therapy_sessions import CALIBRATION

from armimpedance.core.errors import InputError
from armimpedance.recordings.tables.folder import read_folder, write_folder
from manipulandum_sim.therapy.calibration import Seeds, simulate_calibration, simulate_validation
from manipulandum_sim.therapy.device import therapy_device
from manipulandum_sim.therapy.truth import TherapyTruth

DEVICE = therapy_device()
SPEEDS = CALIBRATION["speeds_deg_s"]


@pytest.fixture(scope="module")
def session(therapy_calibration):
    return therapy_calibration


def between(recording, row):
    """Samples of a trial from its onset to its end."""
    table, part = recording.trials.iloc[row], recording.samples_of(row)
    time = recording.time_s[part]
    kept = (time >= table["onset_s"]) & (time <= table["end_s"])
    return np.arange(part.start, part.stop)[kept]


@pytest.mark.study
def test_a_sweep_has_its_velocity_and_needs_what_the_law_says(session):
    recording, truth = session
    sweeps = recording.trials[recording.trials["condition"] == "sweep"]
    assert len(sweeps) == 5 * len(SPEEDS) * 2
    for row, table in sweeps.iterrows():
        rows, axis = between(recording, row), int(table["axis"]) - 1
        velocity = np.deg2rad(table["velocity_deg_s"])
        assert table["movement"] == DEVICE.axes[axis]
        np.testing.assert_allclose(truth.motion.qd[rows, axis].mean(), velocity, rtol=1e-3)
        law = DEVICE.friction.steady(np.full(5, velocity))[axis]
        assert truth.motion.friction[rows, axis].mean() == pytest.approx(law, rel=2e-3)
        told = np.stack([recording.extra[f"q{i}_command_rad"][rows] for i in range(1, 6)], axis=1)
        assert np.rad2deg(np.abs(truth.motion.q[rows] - told)).max() < 0.2


def test_friction_is_odd_over_the_pair_of_sweeps(session):
    recording, truth = session
    sweeps = recording.trials[recording.trials["condition"] == "sweep"]
    for _, pair in sweeps.assign(speed=sweeps["velocity_deg_s"].abs()).groupby(["axis", "speed"]):
        axis = int(pair["axis"].iloc[0]) - 1
        forth, back = (
            truth.motion.friction[between(recording, row), axis].mean() for row in pair.index
        )
        assert forth == pytest.approx(-back, rel=1e-3)
        assert abs(forth) > 0.2


def test_holds_stick_with_the_friction_they_came_with(session):
    recording, truth = session
    holds = recording.trials[recording.trials["condition"] == "hold"]
    assert len(holds) == 2 * CALIBRATION["held_angles"]
    law = DEVICE.friction
    for row, table in holds.iterrows():
        rows = between(recording, row)
        friction = truth.motion.friction[rows, 0] * table["approach"]
        assert np.ptp(truth.motion.q[rows, 0]) < np.deg2rad(0.02)
        assert friction.mean() > 0.7 * law.coulomb[0]
        # the rate at which bristles bend adds a little to what they hold
        assert friction.mean() < law.static[0]
    sides = holds.groupby(holds.index // 2)["approach"].apply(sorted)
    assert all(list(pair) == [-1, 1] for pair in sides)


def test_the_recording_holds_the_opposite_of_the_motors_torques(session):
    recording, truth = session
    off = -recording.force - truth.motion.motor
    sd = DEVICE.torque_noise_Nm
    # N is above 50,000: the sd of an sd is sd / sqrt(2 N), of a mean sd / sqrt(N)
    n = len(off)
    assert (np.abs(off.std(axis=0) - sd) < 5 * sd / np.sqrt(2 * n)).all()
    assert (np.abs(off.mean(axis=0)) < 5 * sd / np.sqrt(n)).all()
    sensor = recording.extra["sensor2_Nm"] - truth.motion.sensor
    assert abs(sensor.std() - DEVICE.sensor_noise_Nm) < 5 * DEVICE.sensor_noise_Nm / np.sqrt(2 * n)
    assert recording.torque == "commanded"
    assert recording.subject.upper_arm_m is None
    assert np.abs(recording.position - truth.motion.q).max() <= DEVICE.encoder_rad.max() / 2 * 1.001
    left = truth.motion.tau_r + truth.motion.tau_h - truth.motion.motor - truth.motion.user
    assert np.abs(left).max() < 1e-9
    assert not truth.motion.tau_h.any()


@pytest.mark.study
def test_the_same_seed_gives_the_same_bits_and_noise_goes_by_number_alone():
    speeds = (60.0,)
    long, _ = simulate_calibration(speeds_deg_s=speeds, held_angles=3, seed=4)
    short, truth = simulate_calibration(speeds_deg_s=speeds, held_angles=0, seed=4)
    samples = len(short.time_s)
    assert long.n_trials == short.n_trials + 6
    assert long.force[:samples].tobytes() == short.force.tobytes()
    assert long.position[:samples].tobytes() == short.position.tobytes()
    noise = short.force + truth.motion.motor
    first, second = (noise[short.samples_of(row)][:1000] for row in (0, 1))
    assert not (first == second).any()


def test_streams_differ_by_seed_session_trial_and_purpose():
    keys = [(4, "a", 1, "torque"), (5, "a", 1, "torque"), (4, "b", 1, "torque")]
    keys += [(4, "a", 2, "torque"), (4, "a", 1, "sensor")]
    drawn = [Seeds(k[0], k[1]).stream(k[2], k[3]).normal() for k in keys]
    assert len(set(drawn)) == len(keys)
    assert Seeds(4, "a").stream(1, "torque").normal() == drawn[0]


@pytest.mark.study
def test_validation_moves_all_axes_far_within_their_limits():
    recording, truth = simulate_validation(trials=2, legs=1, noise="none", seed=2)
    np.testing.assert_array_equal(recording.force, -truth.motion.motor)
    np.testing.assert_array_equal(recording.position, truth.motion.q)
    low, high = DEVICE.limits_rad.T
    assert ((recording.position > low) & (recording.position < high)).all()
    for row in range(2):
        rows = between(recording, row)
        assert (np.ptp(recording.position[rows], axis=0) > 0.3 * (high - low)).all()
        speed = np.rad2deg(np.abs(truth.motion.qd[rows]).max(axis=0))
        assert ((speed > 10) & (speed < 60)).all()
    assert (np.abs(truth.motion.motor) < DEVICE.torque_limit_Nm).all()


def test_a_session_comes_back_from_the_disk(session, tmp_path):
    recording, truth = session
    write_folder(recording, tmp_path / "robot")
    again = read_folder(tmp_path / "robot")
    np.testing.assert_array_equal(again.force, recording.force)
    for column in (
        "condition",
        "movement",
        "axis",
        "onset_s",
        "end_s",
        "velocity_deg_s",
        "approach",
    ):
        assert list(again.trials[column].fillna(0)) == list(recording.trials[column].fillna(0))
    truth.write(tmp_path / "truth.json")
    back = TherapyTruth.read(tmp_path / "truth.json")
    for field in fields(TherapyTruth):
        if field.name != "motion":
            np.testing.assert_array_equal(getattr(back, field.name), getattr(truth, field.name))
    np.testing.assert_allclose(back.cable_stiffness, np.rad2deg([0, 0.016, 0.015, 0.014, 0.0078]))
    (tmp_path / "truth.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match="not a truth of a therapy robot"):
        TherapyTruth.read(tmp_path / "truth.json")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"noise": "loud"}, "no noise level"),
        ({"seed": -1}, "seed -1"),
        ({"speeds_deg_s": ()}, "speeds"),
        ({"speeds_deg_s": (500.0,)}, "speeds"),
        ({"held_angles": -2}, "held angles"),
    ],
)
def test_what_makes_no_session_is_refused(wrong, said):
    with pytest.raises(InputError, match=said):
        simulate_calibration(**wrong)
    with pytest.raises(InputError, match="0 trials"):
        simulate_validation(trials=0)
