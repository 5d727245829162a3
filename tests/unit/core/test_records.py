"""The central records: what they refuse, and how an estimate shows itself."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import RecordError
from armimpedance.core.estimates import ImpedanceEstimate, Quality
from armimpedance.core.motion import EmgSignals
from armimpedance.core.records import Recording, trial_slices

N = 6


def recording(**changes):
    fields = {
        "kind": "hand",
        "sample_rate_hz": 100.0,
        "trials": pd.DataFrame({"trial": [1, 2], "condition": ["a", "b"]}),
        "offsets": [0, 4, N],
        "time_s": np.arange(N) / 100,
        "position": np.zeros((N, 2)),
        "force": np.ones((N, 2)),
    }
    return Recording(**(fields | changes))


def estimate(k=2, **changes):
    K = np.diag(np.arange(1.0, k + 1)) * 100
    quality = Quality(40, 8000, 0.99, 0.98, 1e3, 1e2, 3 * k * k, 0.1)
    fields = {
        "level": "hand",
        "method": "weighted",
        "inertia": np.eye(k),
        "viscosity": 10 * np.eye(k),
        "stiffness": K,
        "covariance": np.eye(3 * k * k),
        "dof": 12.0,
        "quality": quality,
        "keys": {"condition": "relaxed"},
    }
    return ImpedanceEstimate(**(fields | changes))


@pytest.mark.parametrize(
    "changes",
    [
        {"kind": "foot"},
        {"sample_rate_hz": 0.0},
        {"trials": pd.DataFrame({"trial": [1, 1], "condition": ["a", "b"]})},
        {"trials": pd.DataFrame({"trial": [1, 2]})},
        {"trials": pd.DataFrame({"trial": [1], "condition": ["a"]})},
        {"offsets": [0, 4, 4]},
        {"offsets": [1, 4, N]},
        {"offsets": [0, 4, N + 1]},
        {"time_s": np.full(N, np.nan)},
        {"force": np.ones((N, 3))},
        {"position": np.zeros(N)},
        {"emg": np.zeros((N, 1)), "muscles": ("a", "b")},
        {"shoulder_m": np.zeros(3)},
        {"handle_mass_kg": -1.0},
        {"extra": {"x": np.zeros(N - 1)}},
    ],
    ids=",".join,
)
def test_a_recording_that_disagrees_with_itself_is_refused(changes):
    with pytest.raises(RecordError):
        recording(**changes)


def test_a_recording_is_read_only_and_goes_to_another_process():
    one = recording(extra={"x": np.arange(N)}, muscles=["biceps"])
    assert one.muscles == ("biceps",)
    for array in (one.position, one.offsets, one.extra["x"]):
        assert not array.flags.writeable
    again = pickle.loads(pickle.dumps(one))  # noqa: S301
    assert np.array_equal(again.extra["x"], one.extra["x"])


def test_trials_are_selected_by_rows_or_by_a_mask():
    one = recording(position=np.arange(2 * N).reshape(N, 2), extra={"x": np.arange(N)})
    second = one.select([1])
    assert np.array_equal(second.position, one.position[4:])
    assert np.array_equal(second.extra["x"], [4, 5])
    assert second.trials["condition"].tolist() == ["b"]
    assert one.select(np.array([True, True])) is one
    assert np.array_equal(one.select([1, 0]).offsets, [0, 2, N])
    with pytest.raises(RecordError, match="no trials"):
        one.select(np.array([False, False]))


def test_slices_of_trials():
    assert trial_slices(np.array([0, 4, 4, 6])) == [slice(0, 4), slice(4, 4), slice(4, 6)]


def test_emg_agrees_with_its_offsets():
    with pytest.raises(RecordError, match="EMG signals"):
        EmgSignals(1000.0, [0, 5], np.zeros((4, 1)), ("biceps",))
    with pytest.raises(RecordError):
        EmgSignals(1000.0, [0, 4], np.zeros((4, 1)), ("biceps", "triceps"))


@pytest.mark.parametrize("k", [1, 2, 3, 6])
def test_an_estimate_shows_itself_in_a_few_lines(k):
    lines = repr(estimate(k)).splitlines()
    assert lines[0] == "relaxed: hand, method weighted, 40 trials"
    assert len(lines) <= 12
    # t of 12 degrees of freedom
    assert "K_11 = 100 N/m (95 %: 97.82 to 102.2)" in lines


def test_hostile_names_are_escaped():
    bad = "<script>alert(1)</script>"
    shown = estimate(keys={"condition": bad}, warnings=(bad,))._repr_html_()
    assert "<script>" not in shown
    assert shown.count("&lt;script&gt;") == 2


def test_an_estimate_as_plain_numbers():
    plain = estimate(dof=np.inf).to_dict()
    assert plain["group"] == {"condition": "relaxed"}
    assert plain["K"] == [[100.0, 0.0], [0.0, 200.0]]
    assert plain["ci_high_K"][0][0] == pytest.approx(101.96, abs=0.001)
    assert list(plain)[:4] == ["group", "level", "method", "n_trials"]


def test_an_estimate_that_disagrees_with_itself_is_refused():
    for changes in ({"covariance": np.eye(11)}, {"viscosity": np.eye(3)}, {"dof": 0.0}):
        with pytest.raises(RecordError):
            estimate(**changes)
    one = estimate()
    assert np.array_equal(one.inertia_with_handle, one.inertia)
    assert pickle.loads(pickle.dumps(one)).keys == {"condition": "relaxed"}  # noqa: S301
    assert replace(one, dof=3.0).dof == 3.0
