"""The verbs of one joint: a path gives what its recording gives, and errors name the path."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.joint.elbow.show import elbow, elbow_over_time, emg_law
from armimpedance.recordings.tables.folder import write_folder
from manipulandum_sim.elbow.bench import simulate_bench
from manipulandum_sim.elbow.simulate import simulate_elbow


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A recording of two trials, and its folder."""
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=2, duration_s=4.0, snr_db=35.0, seed=5)
    folder = tmp_path_factory.mktemp("joint") / "bench"
    write_folder(recording, folder)
    return recording, folder


@pytest.fixture(scope="module")
def levels():
    """Five levels of contraction with EMG, and isometric trials of the same muscles."""
    given = {"repetitions": 1, "noise": "sensor"}
    recording, _ = simulate_elbow("cocontraction", duration_s=3.0, **given)
    return recording.select([0, 1, 2, 4, 6]), simulate_elbow(
        "calibration", repetitions=1, duration_s=2.0
    )[0]


@pytest.mark.study
def test_a_path_gives_what_its_recording_gives_and_the_command_writes_it(bench, tmp_path, capsys):
    recording, folder = bench
    calls = []
    fit = elbow(recording, progress=lambda *done: calls.append(done))
    assert calls == [(0, 3), (1, 3), (2, 3), (3, 3)]
    again = elbow(str(folder))
    np.testing.assert_array_equal(fit.parameters.values, again.parameters.values)
    assert list(fit.parts) == ["trial 1", "trial 2"]
    out = tmp_path / "fit.json"
    assert main(["elbow", str(folder), "--out", str(out)]) == 0
    written = json.loads(out.read_text())
    assert [p["value"] for p in written["parameters"]] == fit.parameters.values.tolist()
    assert len(written["parts"]) == 2
    assert "trial 2" in capsys.readouterr().out


def test_a_course_of_a_path_is_that_of_its_recording(bench):
    recording, folder = bench
    calls = []
    course = elbow_over_time(recording, method="windows", progress=lambda *done: calls.append(done))
    assert len(calls) > 2
    assert calls[-1][0] == calls[-1][1]
    np.testing.assert_array_equal(course.K, elbow_over_time(folder, method="windows").K)


def test_the_law_holds_its_points_and_the_index(levels):
    recording, isometric = levels
    law = emg_law(recording, imcj=isometric)
    assert list(law.points.to_frame().columns) == [
        *("trial", "amplitude_biceps", "amplitude_triceps", "K", "sd_K", "B", "sd_B"),
        *("imcj_Nm", "sd_imcj_Nm"),
    ]
    assert len(law.points.trials) == recording.n_trials
    assert list(law.to_frame().index) == [p.name for p in law.summary.parameters]
    assert len(repr(law).splitlines()) <= 12
    assert [entry["symbol"] for entry in law.to_dict()["laws"]] == ["K", "B"]
    assert any("|a_i| of the index" in note for note in law.notes)
    exchanged = emg_law(recording, flexor="triceps", extensor="biceps")
    assert exchanged.stiffness.muscles == ("triceps", "biceps")
    np.testing.assert_allclose(
        exchanged.stiffness.parameters.values[[0, 2, 1]],
        law.stiffness.parameters.values,
        rtol=1e-6,
    )


def test_errors_name_the_path_and_one_condition_is_taken(bench):
    recording, folder = bench
    with pytest.raises(InputError, match="no joint 3") as told:
        elbow(folder, joint=3)
    assert told.value.file == folder
    with pytest.raises(InputError, match="no condition 'other'") as told:
        elbow_over_time(str(folder), condition="other")
    assert str(told.value).startswith(str(folder))
    with pytest.raises(InputError, match="no EMG") as told:
        emg_law(recording)
    assert told.value.file is None


@pytest.mark.parametrize("option", [{"flexor": "biceps"}, {"emg_cutoff_hz": 7.0}])
def test_an_option_of_emg_has_no_place_in_another_method(bench, option):
    with pytest.raises(InputError, match=f"{next(iter(option))} with method 'smoother'"):
        elbow_over_time(bench[0], **option)
