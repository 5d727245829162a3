"""`armimpedance inspect` on moving bodies and on joints that nothing disturbs."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.core.records import Recording
from armimpedance.recordings.motion.marker_and_motion_folder import write_markers, write_motion
from armimpedance.recordings.tables.folder import write_folder
from manipulandum_sim.body.simulate import simulate_body


@pytest.fixture(scope="module")
def walk():
    return simulate_body(("walk",))[0]


def inspected(folder, capsys):
    assert main(["inspect", str(folder)]) == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("table", ["csv", "parquet"])
def test_markers(release, table, tmp_path, capsys):
    write_markers(release[0], tmp_path / "relaxed", table)
    printed = inspected(tmp_path / "relaxed", capsys)
    assert "8 markers, no force plates" in printed
    assert "2 trials, 1 condition, 8.0 s at 30 Hz" in printed
    assert "ok    all markers are seen" in printed
    assert "biceps 2.0 %, triceps 2.0 % of the maximum, below the gate of 3 %" in printed
    assert "array(" not in printed
    assert max(map(len, printed.splitlines()[1:])) <= 100


def test_lost_markers_and_places_that_are_not_known(release, tmp_path, capsys):
    recording, _ = release
    positions = np.array(recording.positions)
    positions[30:45, 2] = np.nan
    names = (*recording.names[:-1], "knee")
    write_markers(replace(recording, positions=positions, names=names), tmp_path / "lost", "csv")
    printed = inspected(tmp_path / "lost", capsys)
    assert f"WARN  {names[2]}: not seen in 6.2 % of the frames, for 0.50 s" in printed
    assert "no place for knee" in printed
    write_markers(replace(recording, skeleton=None), tmp_path / "bare", "csv")
    assert "not known: the skeleton" in inspected(tmp_path / "bare", capsys)


def test_an_active_muscle_is_a_warning(release, tmp_path, capsys):
    recording, _ = release
    loud = replace(recording.emg, signals=4 * recording.emg.signals)
    write_markers(replace(recording, emg=loud), tmp_path / "tense", "csv")
    assert "WARN  trial 1:" in inspected(tmp_path / "tense", capsys)


def test_motion_on_plates(walk, tmp_path, capsys):
    write_motion(walk, tmp_path / "walk", "parquet")
    printed = inspected(tmp_path / "walk", capsys)
    assert "36 coordinates of 15 segments, 2 force plates" in printed
    assert "1 trial, 1 condition" in printed
    assert "walk: 1 trial\n" in printed
    assert "ok    the plates bear the body's weight" in printed
    bare = replace(walk, wrenches=None, plate_origins_m=None)
    write_motion(bare, tmp_path / "bare", "parquet")
    assert "not known: contact forces" in inspected(tmp_path / "bare", capsys)


def test_plates_that_cannot_be_are_refused(walk, tmp_path, capsys):
    write_motion(replace(walk, wrenches=-walk.wrenches), tmp_path / "turned", "parquet")
    assert main(["inspect", str(tmp_path / "turned")]) == 2
    captured = capsys.readouterr()
    (line,) = captured.err.strip().splitlines()
    assert "turned" in line
    assert "upwards" in line
    assert "STOP" in captured.out


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_that_nothing_disturbs_can_be_used(sign, tmp_path, capsys):
    t = np.arange(2000) / 200
    q, qd = 0.4 * np.sin(3 * t), 1.2 * np.cos(3 * t)
    recording = Recording(
        kind="joint",
        sample_rate_hz=200.0,
        trials=pd.DataFrame({"trial": [1], "condition": ["swing"]}),
        offsets=np.array([0, len(t)]),
        time_s=t,
        position=q[:, None],
        force=sign * (2 * q + 0.1 * qd)[:, None],
    )
    write_folder(recording, tmp_path / "swing")
    printed = inspected(tmp_path / "swing", capsys)
    assert "joint, 1 axis" in printed
    assert "`passive` takes such a recording" in printed
    assert "Usable, with 1 warning\n" in printed


def test_a_kind_that_is_none_is_refused(release_folder, relaxed, refusal):
    file = relaxed / "recording.json"
    content = json.loads(file.read_text())
    file.write_text(json.dumps({**content, "kind": "swim"}))
    line = refusal("inspect", relaxed)
    assert "column kind" in line
    assert '"markers"' in line
