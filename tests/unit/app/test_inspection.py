"""`inspect` as a verb: the same from a path and from a record, and shown in a few lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from sessions import pushes, swing

from armimpedance.app.inspection import inspect
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.recordings import write_recording
from armimpedance.show.verbs.results import read, read_recording
from manipulandum_sim.body import simulate_body
from manipulandum_sim.elbow import simulate_elbow


@pytest.fixture(scope="module")
def hand():
    return pushes(1, ("cocontraction_10",))


@pytest.fixture(scope="module")
def markers():
    return swing()


@pytest.fixture(scope="module")
def walk():
    return simulate_body(("walk",))[0]


@pytest.mark.parametrize("kind", ["hand", "markers", "walk"])
def test_a_path_and_a_record_give_the_same(kind, request, tmp_path):
    recording = request.getfixturevalue(kind)
    write_recording(recording, tmp_path / "session")
    by_path, by_record = inspect(tmp_path / "session"), inspect(recording)
    assert by_path.checks == by_record.checks
    assert by_path.usable
    assert str(by_path).splitlines()[0] == str(tmp_path / "session")
    assert str(by_path).splitlines()[1:] == str(by_record).splitlines()[1:]


@pytest.mark.parametrize("kind", ["hand", "markers", "walk"])
def test_it_shows_itself(kind, request):
    inspected = inspect(request.getfixturevalue(kind))
    assert len(repr(inspected).splitlines()) <= 12
    frame = inspected.to_frame()
    assert list(frame.columns) == ["check", "verdict", "message"]
    assert len(frame) == len(inspected.checks)
    assert set(frame["verdict"]) <= {"ok", "warning", "unusable", "missing"}
    plain = inspected.to_dict()
    assert plain["usable"]
    assert [check["message"] for check in plain["checks"]] == list(frame["message"])


def test_a_turned_sensor_is_no_error_but_is_told(hand):
    inspected = inspect(replace(hand, force=-hand.force))
    assert not inspected.usable
    assert inspected.verdict.startswith("cannot be used: force sign")
    assert "STOP  force sign" in str(inspected)
    assert inspected.verdict in repr(inspected)


def test_plates_that_cannot_be_are_told(walk):
    assert not inspect(replace(walk, wrenches=-walk.wrenches)).usable


def test_hostile_names_are_escaped(hand):
    bad = "<script>alert(1)</script>"
    trials = hand.trials.assign(condition=bad)
    shown = inspect(replace(hand, trials=trials, subject=Subject(bad)))._repr_html_()
    assert "<script>" not in shown
    assert "&lt;script&gt;" in shown


def test_verbs_for_hand_and_joints_refuse_a_moving_body_by_name(markers, tmp_path):
    write_recording(markers, tmp_path / "swing")
    assert read(tmp_path / "swing").names == markers.names
    with pytest.raises(InputError, match=r"swing: a recording of markers.*hand or of joints"):
        read_recording(tmp_path / "swing")
    with pytest.raises(InputError, match="a recording of markers"):
        read_recording(markers)


def test_options_that_a_format_cannot_use_are_refused(hand, tmp_path):
    write_recording(hand, tmp_path / "session")
    with pytest.raises(InputError, match="--side with a folder"):
        read(tmp_path / "session", side="left")
    with pytest.raises(InputError, match="--force-by with a folder"):
        inspect(tmp_path / "session", force_by="limb")


def test_what_is_missing_is_listed():
    t = np.arange(2000) / 200
    recording = Recording(
        kind="joint",
        sample_rate_hz=200.0,
        trials=pd.DataFrame({"trial": [1], "condition": ["swing"]}),
        offsets=np.array([0, len(t)]),
        time_s=t,
        position=0.4 * np.sin(3 * t)[:, None],
        force=0.8 * np.sin(3 * t)[:, None],
    )
    missing = inspect(recording).of_verdict("missing")
    assert any("EMG" in finding.message for finding in missing)


@pytest.mark.parametrize("test", ["calibration", "spring"])
def test_a_joint_that_nothing_disturbs_is_usable_for_its_emg(test):
    recording, _ = simulate_elbow(test, repetitions=1, duration_s=2.0)
    inspected = inspect(recording)
    (fit,) = [check for check in inspected.checks if check.name == "fit"]
    assert fit.verdict == "warning"
    assert inspected.usable
