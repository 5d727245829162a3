"""What is shared is read again to the last bit, is described in full, and says nothing untold."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from sessions import pushes

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording, MotionRecording
from armimpedance.core.records import Recording, Subject
from armimpedance.core.skeleton import Hinge, MarkerSite, Segment, Skeleton
from armimpedance.recordings import ReadOptions, open_recording, write_recording
from armimpedance.recordings.bids.tsv import parsed
from armimpedance.show.files.sharing.form import FORMS, Shared, Statement

ARRAYS = ("time_s", "position", "force", "joint_angles", "emg", "offsets")
#: Conditions as a lab may call them: numbers, formulas, marks of other formats.
CONDITIONS = ("007", "1e3", "=1+1", "a|b <c>", 'quo"te', "true", "Kraft 5 N, Übung", "n.a.")


@pytest.fixture(scope="module")
def hand() -> Recording:
    """Eight trials of a simulated hand."""
    return pushes(1, ("cocontraction_10",))


def _as_bids(recording, folder: Path, **said) -> Path:
    folder.mkdir()
    shared = Shared([(Path("session"), recording)], statement=Statement(**said), version="0")
    FORMS["bids"].write(shared, folder)
    return folder


def _same(one, other, names) -> None:
    for name in names:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)


def test_a_recording_comes_back_to_the_last_bit(hand, tmp_path):
    trials = hand.trials.assign(condition=list(CONDITIONS))
    extra = {
        "x_command_m": np.nextafter(hand.position[:, 0], 1),
        "tiny": np.full(len(hand.force), 5e-324),
    }
    told = replace(hand, trials=trials, extra=extra, imposed="position", gravity_m_s2=(0.0, -9.81))
    again = open_recording(_as_bids(told, tmp_path / "b"))
    _same(again, told, ARRAYS)
    pd.testing.assert_frame_equal(again.trials, trials)
    assert (again.imposed, again.gravity_m_s2) == ("position", (0.0, -9.81))
    assert (again.subject, again.handle_mass_kg) == (told.subject, told.handle_mass_kg)
    for name, values in extra.items():
        np.testing.assert_array_equal(again.extra[name], values)


def test_estimates_of_the_dataset_are_those_of_the_recording(hand, tmp_path):
    dataset = _as_bids(hand, tmp_path / "b")
    ai.estimate(hand).to_csv(tmp_path / "one.csv")
    ai.estimate(dataset).to_csv(tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()


def test_joints_come_back_as_joints(tmp_path):
    rng = np.random.default_rng(0)
    joint = Recording(
        kind="joint",
        sample_rate_hz=200.0,
        trials=pd.DataFrame({"trial": [4, 9], "condition": ["a", "b"]}),
        offsets=np.array([0, 50, 90]),
        time_s=np.concatenate([np.arange(50), np.arange(40)]) / 200.0,
        position=rng.normal(size=(90, 1)),
        force=rng.normal(size=(90, 1)),
        perturbation="stochastic",
        torque="interaction",
    )
    again = open_recording(_as_bids(joint, tmp_path / "b"))
    _same(again, joint, ("time_s", "position", "force", "offsets"))
    assert (again.kind, again.torque, again.perturbation) == ("joint", "interaction", "stochastic")
    pd.testing.assert_frame_equal(again.trials, joint.trials)


@pytest.fixture(scope="module")
def markers() -> MarkerRecording:
    """Two trials with lost markers; EMG goes on for some samples after each."""
    rng = np.random.default_rng(2)
    positions = rng.normal(size=(110, 2, 3))
    positions[20:30, 1] = np.nan
    return MarkerRecording(
        sample_rate_hz=100.0,
        trials=pd.DataFrame({"trial": [3, 1], "condition": ["10", "20"], "load_N": [1.5, np.nan]}),
        offsets=np.array([0, 60, 110]),
        time_s=np.concatenate([np.arange(60), 30 + np.arange(50)]) / 100.0,
        positions=positions,
        names=("RSHO", "R_ELB"),
        emg=EmgSignals(
            1000.0, np.array([0, 607, 1110]), 1e-3 * rng.normal(size=(1110, 2)), ("bic", "tri"), "V"
        ),
        subject=Subject("S 7", 70.0, 1.8),
    )


def test_markers_come_back_to_the_last_bit_and_emg_in_24(markers, tmp_path):
    dataset = _as_bids(markers, tmp_path / "b")
    again = open_recording(dataset, ReadOptions(emg_channels={"bic": "bic", "tri": "tri"}))
    _same(again, markers, ("time_s", "positions", "offsets"))
    assert again.names == markers.names
    assert list(again.trials["condition"]) == ["10", "20"]
    np.testing.assert_array_equal(again.emg.offsets, markers.emg.offsets)
    step = 2.0 * np.abs(markers.emg.signals).max() / 2**24
    assert np.abs(again.emg.signals - markers.emg.signals).max() < step
    assert not any("acq_time" in sentence for sentence in again.provenance)


def test_joint_motion_and_its_skeleton_come_back(tmp_path):
    hinges = (Hinge("flexion", np.array([0.0, 1.0, 0.0])),)
    segments = (
        Segment("trunk", None, np.zeros(3)),
        Segment("arm", "trunk", np.ones(3) / 7, hinges),
    )
    rng = np.random.default_rng(4)
    motion = MotionRecording(
        sample_rate_hz=50.0,
        trials=pd.DataFrame({"trial": [1, 2], "condition": ["a", "b"]}),
        offsets=np.array([0, 20, 50]),
        time_s=np.concatenate([np.arange(20), np.arange(30)]) / 50.0,
        coordinates=rng.normal(size=(50, 7)),
        skeleton=Skeleton(segments, (MarkerSite("m", "arm", np.ones(3)),)),
    )
    again = open_recording(_as_bids(motion, tmp_path / "b"))
    _same(again, motion, ("time_s", "coordinates", "offsets"))
    assert again.skeleton.coordinates == motion.skeleton.coordinates
    np.testing.assert_array_equal(again.skeleton.segments[1].origin_m, np.ones(3) / 7)


def test_every_column_is_described_where_bids_looks(hand, markers, tmp_path):
    for number, recording in enumerate((hand, markers)):
        dataset = _as_bids(recording, tmp_path / str(number))
        for table in dataset.rglob("*_motion.tsv"):
            stem = table.name.removesuffix("_motion.tsv")
            channels = pd.read_csv(table.with_name(f"{stem}_channels.tsv"), sep="\t")
            assert len(table.read_text().split("\n", 1)[0].split("\t")) == len(channels)
            told = json.loads(table.with_name(f"{stem}_motion.json").read_text())
            counted = [told[f"{k}ChannelCount"] for k in ("POS", "JNTANG", "Misc")]
            assert sum(counted) == told["MotionChannelCount"] == len(channels)
            events = pd.read_csv(table.with_name(f"{stem}_events.tsv"), sep="\t")
            described = json.loads(table.with_name(f"{stem}_events.json").read_text())
            assert set(events) <= set(described) | {"onset", "duration"}
        files = [f for f in (dataset).rglob("sub-*") if f.is_file()]
        assert files
        assert all(parsed(f) is not None for f in files)


def test_nothing_is_said_that_nobody_told(hand, tmp_path):
    private = replace(
        hand, provenance=("Read from /home/jane.doe/2023-04-05/exam.zip of Mr. Secret.",)
    )
    dataset = _as_bids(private, tmp_path / "b")
    write_recording(hand, tmp_path / "session", "csv")
    for form, name in (("json-ld", "a.jsonld"), ("datasheet", "a.md")):
        shared = Shared([(tmp_path / "session", private)], version="0")
        FORMS[form].write(shared, tmp_path / name)
    written = [f for f in dataset.rglob("*") if f.is_file()]
    for file in (*written, tmp_path / "a.jsonld", tmp_path / "a.md"):
        text = file.read_text()
        assert "jane" not in text
        assert "Secret" not in text
    described = json.loads((dataset / "dataset_description.json").read_text())
    assert not {"License", "Authors", "DatasetDOI"} & set(described)


def _results(hand, folder: Path) -> Path:
    ai.estimate(hand).to_csv(folder / "hand.csv")
    return folder / "hand.csv"


def test_a_derivative_holds_every_cell_and_the_unit_of_every_number(hand, tmp_path):
    results = _results(hand, tmp_path)
    out = tmp_path / "d"
    assert main(["share", str(results), "--as", "bids-derivative", "--out", str(out)]) == 0
    (table,) = out.rglob("*_impedance.tsv")
    one = pd.read_csv(results, dtype=str, na_filter=False)
    two = pd.read_csv(table, sep="\t", dtype=str, na_filter=False, quoting=3)
    pd.testing.assert_frame_equal(two.replace("n/a", ""), one)
    described = json.loads(table.with_suffix(".json").read_text())
    assert set(one) <= set(described)
    units = {"K_11": "N/m", "sd_B_12": "N s/m", "ci_low_M_22": "kg", "q_elbow_rad": "rad"}
    assert {name: described[name]["Units"] for name in units} == units
    told = json.loads((out / "dataset_description.json").read_text())
    assert (told["DatasetType"], told["GeneratedBy"][0]["Name"]) == ("derivative", "armimpedance")


def test_metadata_name_every_variable_and_every_file(hand, tmp_path):
    write_recording(hand, tmp_path / "session", "csv")
    results = _results(hand, tmp_path)
    words = ["share", str(tmp_path / "session"), str(results), "--as", "json-ld"]
    words += ["--out", str(tmp_path / "a.jsonld"), "--licence", "CC0-1.0", "--creator", "A. Ex"]
    assert main(words) == 0
    told = json.loads((tmp_path / "a.jsonld").read_text())
    assert (told["@context"], told["@type"]) == ("https://schema.org/", "Dataset")
    variables = {v["name"]: v for v in told["variableMeasured"]}
    columns = set(pd.read_csv(results, nrows=1)) | set(hand.trials) | {"x_m", "fy_N"}
    assert columns <= set(variables)
    assert (variables["fy_N"]["unitText"], variables["K_12"]["unitText"]) == ("N", "N/m")
    files = {d["name"]: d["sha256"] for d in told["distribution"]}
    for file in ("session/samples.csv", "hand.csv"):
        assert files[file] == hashlib.sha256((tmp_path / file).read_bytes()).hexdigest()
    assert told["license"] == "https://spdx.org/licenses/CC0-1.0"
    assert told["creator"] == [{"@type": "Person", "name": "A. Ex"}]
    assert not {"description", "identifier", "keywords", "funding", "url"} & set(told)


def test_a_datasheet_leaves_open_what_was_not_answered(hand, tmp_path):
    write_recording(hand, tmp_path / "session", "csv")
    odd = replace(hand, trials=hand.trials.assign(condition="a | b\n# <script>"))
    open_questions = []
    for said in ({}, {"description": "Why.", "creators": ("A",), "licence": "CC0"}):
        shared = Shared([(tmp_path / "session", odd)], statement=Statement(**said), version="0")
        FORMS["datasheet"].write(shared, tmp_path / "a.md")
        text = (tmp_path / "a.md").read_text()
        open_questions.append(text.count("To be answered"))
        assert "<script" not in text
        assert "a \\| b #" in text
    assert open_questions[0] - open_questions[1] == 3


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["{results}", "--as", "bids", "--out", "x"], "expected a recording"),
        (["{session}", "--as", "bids-derivative", "--out", "x"], "table of results"),
        (["{session}", "--as", "json-ld", "--out", "x.txt"], ".jsonld"),
        (["{session}", "--as", "bids", "--out", "{session}/x"], "lies in what is read"),
        (["{session}", "--as", "bids", "--out", "x", "--subject", "A B"], "letters and digits"),
        (["{session}", "--as", "bids", "--out", "{kept}", "--replace"], "not an earlier output"),
        (["{session}", "{session}", "--as", "bids", "--out", "x"], "one recording"),
    ],
)
def test_what_cannot_be_written_is_refused_in_one_line(
    hand, tmp_path, monkeypatch, capsys, words, told
):
    write_recording(hand, tmp_path / "session", "csv")
    kept = tmp_path / "kept"
    kept.mkdir()
    (kept / "only_copy.txt").write_text("x")
    places = {"session": tmp_path / "session", "results": _results(hand, tmp_path), "kept": kept}
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert main(["share", *(w.format(**places) for w in words)]) == 2
    line = capsys.readouterr().err
    assert told in line
    assert line.count("\n") == 1
    assert list((tmp_path / "here").iterdir()) == []
    assert [p.name for p in kept.iterdir()] == ["only_copy.txt"]


def test_a_dataset_is_replaced_only_when_asked(hand, tmp_path, capsys):
    write_recording(hand, tmp_path / "session", "csv")
    words = ["share", str(tmp_path / "session"), "--as", "bids", "--out", str(tmp_path / "b")]
    assert [main(words), main(words), main([*words, "--replace", "--name", "New"])] == [0, 2, 0]
    assert json.loads((tmp_path / "b" / "dataset_description.json").read_text())["Name"] == "New"
    capsys.readouterr()


def test_emg_that_fits_no_record_is_refused(markers, tmp_path):
    odd = replace(markers, emg=replace(markers.emg, sample_rate_hz=1000.0 / 3.0 + 0.01))
    with pytest.raises(InputError, match="whole samples"):
        _as_bids(odd, tmp_path / "b")
