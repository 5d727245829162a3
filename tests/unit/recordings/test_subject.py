"""Who was recorded, of every format, by one door."""

from __future__ import annotations

import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.recordings.motion.marker_and_motion_folder import write_markers
from armimpedance.recordings.opening import FORMATS, read_subject
from armimpedance.recordings.reading import ReadOptions
from manipulandum_sim.passive.swing import simulate_passive


def test_a_folder_is_known_by_its_recording_json_alone(tables):
    folder = tables.write("csv")
    for name in ("samples.csv", "trials.csv"):
        (folder / name).unlink()
    recorded = read_subject(folder)
    assert recorded.subject.id
    assert recorded.muscles is None or all(isinstance(m, str) for m in recorded.muscles)


def test_markers_are_read_by_the_same_door(tmp_path):
    recording, _ = simulate_passive("release", trials=1, duration_s=2.0)
    write_markers(recording, tmp_path / "r", "csv")
    (tmp_path / "r" / "samples.csv").unlink()
    assert read_subject(tmp_path / "r").subject == recording.subject


def test_an_exam_needs_no_sign_of_the_force_here(exams, tmp_path):
    archive = exams.zip(tmp_path / "e.zip", exams.files())
    recorded = read_subject(archive, ReadOptions(emg_channels={"ACH0": "biceps"}))
    assert recorded.subject == Subject()
    assert recorded.muscles == ("biceps",)
    with pytest.raises(InputError, match="--axes with a Kinarm exam"):
        read_subject(archive, ReadOptions(axes=("x", "y", "z")))


def test_the_formats_stand_in_files_of_their_own(tmp_path):
    assert FORMATS.names[0] == "folder"
    (tmp_path / "a.xyz").write_text("a")
    with pytest.raises(InputError) as refused:
        read_subject(tmp_path / "a.xyz")
    assert all(each.name in str(refused.value) for each in FORMATS.values())
