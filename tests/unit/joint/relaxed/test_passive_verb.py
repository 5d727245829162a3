"""`passive` in a notebook: what the command gives, from records and from paths."""

from __future__ import annotations

import inspect
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.joint.relaxed import from_joint_recording, from_motion
from armimpedance.joint.relaxed.show import passive
from armimpedance.numerics.signals import emg_gate
from armimpedance.recordings import write_recording
from manipulandum_sim.passive import simulate_passive


@pytest.fixture(scope="module")
def markers():
    return simulate_passive("release", trials=2, duration_s=2.0)[0]


@pytest.fixture(scope="module")
def told():
    """What the progress of `fits` was told."""
    return []


@pytest.fixture(scope="module")
def fits(markers, told):
    return passive(markers, rest_angle=1.5, progress=lambda *counts: told.append(counts))


def swing(sign=1.0, still=False):
    """A recording of one joint's angle and torque."""
    t = np.arange(1000) / 100.0
    a, b = 2 * np.pi * 0.5, 2 * np.pi * 1.1
    q = 0.2 + 0.4 * np.sin(a * t) + 0.2 * np.sin(b * t + 1)
    qd = 0.4 * a * np.cos(a * t) + 0.2 * b * np.cos(b * t + 1)
    torque = sign * (2.0 * (q - 0.3) + 0.1 * qd + 0.02 * np.sign(qd))
    return Recording(
        kind="joint",
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [1], "condition": ["slow"]}),
        offsets=np.array([0, len(t)]),
        time_s=t,
        position=(0.2 + 0 * q if still else q)[:, None],
        force=torque[:, None],
    )


@pytest.mark.study
def test_a_path_and_its_record_give_the_same(markers, fits, tmp_path):
    write_recording(markers, tmp_path / "relaxed")
    read = passive(tmp_path / "relaxed", rest_angle=1.5, validate=tmp_path / "relaxed")
    assert read.to_dict()["parameters"] == fits.to_dict()["parameters"]
    assert read.notes == fits.notes
    told = read.to_dict()["validated_on"]
    assert told["recording"] == str(tmp_path / "relaxed")
    assert "validated_on" not in fits.to_dict()
    again = fits.predicting(fits.samples, "itself")
    assert [v.r2 for v in again.validations] == [v.r2 for v in read.validations]


def test_a_result_is_a_sequence_found_by_a_joints_name(fits):
    (only,) = fits
    assert fits["right_elbow_flexion"] is fits[0] is only
    assert fits[:1] == (only,)
    with pytest.raises(InputError, match=r"'knee'.*right_elbow_flexion"):
        fits["knee"]
    assert fits.emg.muscles == ("biceps", "triceps")
    assert str(fits.emg) in fits.notes


def test_a_result_as_a_table(fits):
    frame = fits.to_frame()
    assert list(frame.index) == ["k", "h", "f"]
    assert list(frame.columns) == ["joint", "value", "sd", "ci_low", "ci_high", "unit"]
    assert (frame.ci_low < frame.value).all()
    assert frame.equals(fits[0].to_frame())


def test_a_result_shows_itself_in_a_few_lines(fits):
    many = replace(fits, fits=fits.fits * 30)
    for text in (repr(fits), repr(fits[0]), repr(many)):
        assert 2 <= len(text.splitlines()) <= 12
    assert "right_elbow_flexion" in repr(fits)


def test_hostile_names_are_escaped(fits):
    bad = replace(fits[0], joint="<script>", warnings=("<b>",))
    html = replace(fits, fits=(bad,))._repr_html_() + bad._repr_html_()
    assert "<script>" not in html
    assert "<b>" not in html


@pytest.mark.study
def test_a_joint_that_a_mapping_does_not_name_is_free():
    free, known = passive(swing(), rest_angle={}), passive(swing(), rest_angle={"q1": 0.3})
    assert free[0].parameters.names == ("k", "h", "f", "q_r")
    assert known[0].parameters.names == ("k", "h", "f")


def test_errors_name_the_file_where_a_path_was_given(tmp_path):
    write_recording(swing(still=True), tmp_path / "still")
    with pytest.raises(NotIdentifiableError, match=r"still: q1 stands still") as told:
        passive(tmp_path / "still", rest_angle=0.3)
    assert told.value.parameters == ("h", "f")
    with pytest.raises(NotIdentifiableError, match=r"^q1 stands still"):
        passive(swing(still=True), rest_angle=0.3)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"joints": ["q1"]}, "all its joints"),
        ({"longest_gap_s": 0.1}, "a recording of markers"),
        ({"method": "magic"}, "method .magic."),
        ({"rest_angle": 20.0}, "looks like degrees"),
        ({"rest_angle": {"knee": 1.0}}, "rest angles of knee"),
        ({"emg_gate_percent": -1.0}, "emg_gate_percent -1"),
    ],
)
def test_what_has_no_effect_or_no_meaning_is_refused(options, told):
    with pytest.raises(InputError, match=told):
        passive(swing(), **options)


def test_a_sign_of_the_torque_is_refused_where_there_is_none(markers):
    with pytest.raises(InputError, match="a recording of torque"):
        passive(markers, torque_sign=1)


@pytest.mark.usefixtures("fits")
def test_progress_counts_frames_then_joints(markers, told):
    frames = len(markers.time_s)
    assert (frames, frames) in told
    assert told[-1] == (1, 1)


def test_the_verb_has_the_defaults_of_what_it_calls():
    verb = inspect.signature(passive).parameters
    for function in (from_motion, from_joint_recording):
        own = inspect.signature(function).parameters["cutoff_hz"].default
        assert verb["cutoff_hz"].default == own
    gate = inspect.signature(emg_gate).parameters["limit_percent"].default
    assert verb["emg_gate_percent"].default == gate


def test_another_bodys_skeleton_is_told(markers):
    one = markers.select([0])
    far = replace(one, positions=2 * one.positions)
    with pytest.raises(EstimationError, match="swapped labels"):
        passive(far)


@pytest.mark.study
def test_copies_of_swings_are_refused_and_marked():
    """A joint moved and its torque recorded; every trial twice under other numbers."""
    rng = np.random.default_rng(3)
    t, trials = np.arange(3000) / 200, 4
    angle = np.concatenate([0.5 * np.sin(2 * t + phase) for phase in range(trials)])
    speed = np.concatenate([np.cos(2 * t + phase) for phase in range(trials)])
    noise = rng.normal(0, 0.01, (2, len(angle)))
    torque = 2.0 * angle + 0.1 * speed + noise[0]
    once = Recording(
        kind="joint",
        sample_rate_hz=200.0,
        trials=pd.DataFrame({"trial": [1, 2, 3, 4], "condition": "swing"}),
        offsets=np.arange(trials + 1) * len(t),
        time_s=np.tile(t, trials),
        position=(angle + 1e-4 * noise[1])[:, None],
        force=torque[:, None],
    )
    twice = replace(
        once,
        trials=pd.DataFrame({"trial": range(1, 9), "condition": "swing"}),
        offsets=np.arange(2 * trials + 1) * len(t),
        time_s=np.tile(t, 2 * trials),
        position=np.tile(once.position, (2, 1)),
        force=np.tile(once.force, (2, 1)),
    )
    assert not any("copies" in note for note in passive(once).notes)
    with pytest.raises(InputError, match="copies: trials hold the same noise: 1 = 5"):
        passive(twice)
    assert passive(twice, despite="copies").notes[0].startswith("despite copies")
