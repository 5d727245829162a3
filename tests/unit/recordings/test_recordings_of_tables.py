"""Recordings of what a person holds: the same as from a file, and refused for the same."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from mapped_files import long_table

import armimpedance as ai
from armimpedance.core.errors import InputError

NAMES = {
    "time_s": "t",
    "position_m": ["x", "y"],
    "force_N": ["fx", "fy"],
    "trial": "trial",
    "condition": "cond",
    "onset_s": "onset",
    "end_s": "end",
}


def trials_of(recording):
    """One mapping a trial, in mm, ms and N, without a time."""
    for number, row in recording.trials.iterrows():
        of = recording.samples_of(number)
        yield {
            "position_mm": 1e3 * recording.position[of],
            "force_N": recording.force[of],
            "trial": row["trial"],
            "condition": row["condition"],
            "onset_ms": 1e3 * row["onset_s"],
            "end_s": row["end_s"],
        }


def same(made, truth, atol=1e-12):
    np.testing.assert_allclose(made.position, truth.position, atol=atol)
    np.testing.assert_array_equal(made.force, truth.force)
    for name in ("trial", "condition"):
        assert made.trials[name].tolist() == truth.trials[name].tolist()
    for name in ("onset_s", "end_s"):
        np.testing.assert_allclose(made.trials[name], truth.trials[name], atol=1e-12)


def test_a_table_of_all_samples(truth):
    made = ai.recording(long_table(truth), NAMES, force_by="limb")
    same(made, truth)
    assert made.sample_rate_hz == truth.sample_rate_hz


def test_a_list_of_trials_in_their_own_units(truth):
    made = ai.recording(list(trials_of(truth)), force_by="limb", sample_rate_hz=1000)
    same(made, truth)


def test_a_table_of_samples_and_a_table_of_trials(truth):
    table = long_table(truth)
    trials = table[["trial", "cond", "onset", "end"]].drop_duplicates()
    trials.columns = ["trial", "condition", "onset_s", "end_s"]
    names = {name: NAMES[name] for name in ("time_s", "position_m", "force_N", "trial")}
    same(ai.recording(table, names, force_by="limb", trials=trials[::-1]), truth)


def test_the_force_of_the_device_turns_round(truth):
    made = ai.recording(long_table(truth), NAMES, force_by="device")
    np.testing.assert_array_equal(made.force, -truth.force)


def test_further_columns_muscles_and_facts(truth):
    trials = list(trials_of(truth))
    for one in trials:
        n = len(one["force_N"])
        one |= {"speed": np.arange(float(n)), "emg_mV": np.ones((n, 2)), "day": 2.0}
    made = ai.recording(
        trials, force_by="limb", sample_rate_hz=1000, handle_mass_kg=0.2, subject=ai.Subject("B")
    )
    assert made.handle_mass_kg == 0.2
    assert made.subject.id == "B"
    assert set(made.trials["day"]) == {2}
    assert "speed" in made.extra
    assert made.emg.shape == (len(made.position), 2)
    assert made.emg[0, 0] == pytest.approx(1e-3)


def test_joints():
    time = np.arange(500) / 500
    one = {"angle_deg": 10 * np.sin(9 * time), "torque_Nm": np.cos(9 * time), "onset_s": 0.1}
    made = ai.recording([one, one], force_by="limb", sample_rate_hz=500)
    assert made.kind == "joint"
    assert np.ptp(made.position) == pytest.approx(np.radians(20), rel=1e-3)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"position_mm": None}, "position"),
        ({"position": np.zeros((900, 2)), "position_mm": None}, "position says no unit.*_mm"),
        ({"force_N": np.zeros((9, 2))}, "different lengths"),
        ({"force_N": np.full((900, 2), np.nan)}, "missing value|not finite|NaN"),
        ({"onset_ms": 7000.0}, "onset"),
        ({"force_N": np.zeros((900, 2, 2))}, r"\(900, 2, 2\)"),
        ({"force_N": np.zeros((900, 2), dtype=complex)}, "complex"),
    ],
)
def test_what_is_wrong_is_named(change, said):
    one = {
        "position_mm": np.random.default_rng(1).normal(size=(900, 2)).cumsum(axis=0),
        "force_N": np.ones((900, 2)),
        "onset_ms": 300.0,
    } | change
    one = {name: value for name, value in one.items() if value is not None}
    with pytest.raises(InputError, match=said):
        ai.recording([one], force_by="limb", sample_rate_hz=1000)


def test_what_is_no_table_is_a_type_error():
    for wrong in (42, [1.0, 2.0], "session", np.zeros((3, 2))):
        with pytest.raises(TypeError, match="got"):
            ai.recording(wrong, force_by="limb")
    with pytest.raises(TypeError, match="got DataFrame.*ai.recording"):
        ai.read(pd.DataFrame())
