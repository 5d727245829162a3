"""`armimpedance convert` of motion capture: tables of a laboratory become recordings."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.recordings.motion.marker_and_motion_folder import read_markers, read_motion
from armimpedance.recordings.motion.skeleton_json import write_skeleton

BODY = ("--skeleton", "elbow", "--mass-kg", "70", "--height-m", "1.75")
ANGLES = (
    *("--angle", "right_elbow_flexion=elbow_flexion"),
    *("--angle", "right_shoulder_flexion=-arm_flex"),
)


@pytest.fixture
def trc(release, tmp_path):
    """The first trial as a laboratory's `.trc`: millimetres, y up, labels of its own."""
    recording, _ = release
    part = recording.samples_of(0)
    x, y, z = np.moveaxis(1e3 * recording.positions[part], 2, 0)
    cells = np.stack([x, z, -y], axis=2).reshape(len(x), -1)
    labels = "\t\t\t".join(f"M{i}" for i in range(len(recording.names)))
    count = f"{len(x)}\t{len(recording.names)}"
    lines = [
        "PathFileType\t4\t(X/Y/Z)\tswing.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"30.00\t30.00\t{count}\tmm\t30.00\t1\t{len(x)}",
        f"Frame#\tTime\t{labels}\t\t",
        "\t\t" + "\t".join(f"{a}{i + 1}" for i in range(len(recording.names)) for a in "XYZ"),
        "",
    ]
    for i, row in enumerate(cells):
        values = "\t".join(repr(float(v)) for v in row)
        lines.append(f"{i + 1}\t{i / 30:.6f}\t{values}")
    (tmp_path / "swing.trc").write_text("\n".join(lines) + "\n")
    return tmp_path / "swing.trc"


def names_of(recording):
    return [w for i, n in enumerate(recording.names) for w in ("--marker", f"M{i}={n}")]


@pytest.fixture
def mot(tmp_path):
    """A table of angles as OpenSim writes it, in degrees."""
    t = np.arange(60) / 50
    rows = zip(t, 60 + 20 * np.sin(9 * t), 10 * np.cos(7 * t), strict=True)
    head = "arm\nversion=1\nnRows=60\nnColumns=3\ninDegrees=yes\nendheader\n"
    table = "time\telbow_flexion\tarm_flex\n"
    table += "".join("\t".join(repr(float(v)) for v in row) + "\n" for row in rows)
    (tmp_path / "arm.mot").write_text(head + table)
    return tmp_path / "arm.mot"


def test_a_laboratorys_markers_become_parameters(release, trc, tmp_path, capsys):
    recording, truth = release
    write_skeleton(recording.skeleton, tmp_path / "mine.json")
    folder, out = tmp_path / "relaxed", tmp_path / "fit.json"
    options = ["--skeleton", str(tmp_path / "mine.json"), *names_of(recording)]
    assert main(["convert", str(trc), str(folder), *options]) == 0
    assert "8 markers" in capsys.readouterr().out
    there = read_markers(folder)
    expected = recording.positions[recording.samples_of(0)]
    np.testing.assert_allclose(there.positions, expected, atol=1e-12)
    assert main(["passive", str(folder), "--rest-angle", "1.5", "--out", str(out)]) == 0
    k = json.loads(out.read_text())["parameters"][0]
    assert abs(k["value"] - truth.k[-1]) < 5 * k["sd_robust"]


def test_a_table_of_angles_becomes_motion(mot, tmp_path, capsys):
    folder = tmp_path / "arm"
    assert main(["convert", str(mot), str(folder), *BODY, *ANGLES]) == 0
    assert "1 trial, 1 condition" in capsys.readouterr().out
    motion = read_motion(folder)
    at = motion.skeleton.coordinate
    t = motion.time_s
    elbow = motion.coordinates[:, at("right_elbow_flexion")]
    np.testing.assert_allclose(elbow, np.deg2rad(60 + 20 * np.sin(9 * t)), atol=1e-12)
    shoulder = motion.coordinates[:, at("right_shoulder_flexion")]
    np.testing.assert_allclose(shoulder, -np.deg2rad(10 * np.cos(7 * t)), atol=1e-12)
    assert motion.subject.mass_kg == 70.0


@pytest.mark.parametrize("table", ["csv", "parquet"])
def test_a_recording_of_markers_changes_its_table_and_nothing_else(
    release, release_folder, table, tmp_path
):
    folder = tmp_path / "again"
    assert main(["convert", str(release_folder), str(folder), "--table", table]) == 0
    assert (folder / f"samples.{table}").is_file()
    there, recording = read_markers(folder), release[0]
    assert np.array_equal(there.positions, recording.positions)
    assert np.array_equal(there.emg.signals, recording.emg.signals)
    assert there.subject == recording.subject
    assert there.skeleton.coordinates == recording.skeleton.coordinates


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--force-by", "limb"), ("--force-by with motion capture", "--axes", ".trc")),
        (("--handle-mass-kg", "0.2"), ("--handle-mass-kg with motion capture",)),
        (("--skeleton", "elbow"), ("--skeleton elbow", "--mass-kg and --height-m")),
        (("--skeleton", "mine.json"), ("mine.json", "No such file")),
        ((*BODY[:3], "-70", *BODY[4:]), ("-70",)),
        (("--standing", "up.trc"), ("--standing without --skeleton",)),
        ((*BODY, "--standing", "up.trc"), ("up.trc", "no such file")),
        (("--marker", "RSHO=acromion_right"), ("'RSHO'", "M0, M1")),
        (("--marker", "M0"), ("--marker M0", "LABEL=NAME")),
        (("--axes", "x,y"), ("x,y",)),
        (("--emg", "ACH0"), ("--emg ACH0", "CHANNEL=MUSCLE")),
    ],
)
def test_wrong_options_for_markers_are_one_line(options, says, trc, refusal):
    line = refusal("convert", trc, "folder", *options)
    for word in says:
        assert word in line


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), ("arm.mot", "skeleton")),
        ((*BODY, "--angle", "right_elbow_flexion=knee"), ("knee",)),
        ((*BODY, "--angle", "knee=elbow_flexion"), ("knee",)),
        (BODY, ("arm.mot", "right_elbow_flexion")),
    ],
    ids=["skeleton", "column", "coordinate", "angles"],
)
def test_wrong_options_for_angles_are_one_line(options, says, mot, refusal):
    line = refusal("convert", mot, "folder", *options)
    for word in says:
        assert word in line


def test_files_that_are_none_are_one_line(refusal, tmp_path):
    assert "nowhere.c3d" in refusal("convert", tmp_path / "nowhere.c3d", "folder")
    (tmp_path / "broken.c3d").write_bytes(b"\x02\x50 no more")
    assert "broken.c3d" in refusal("convert", tmp_path / "broken.c3d", "folder")
    (tmp_path / "empty.trc").write_text("")
    assert "empty.trc" in refusal("convert", tmp_path / "empty.trc", "folder")
