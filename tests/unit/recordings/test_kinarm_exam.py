"""Kinarm exams, made byte by byte with every quirk of Dexterit-E, read as recordings."""

import stat
import struct
import zipfile

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.recordings.kinarm import exam_file as packing
from armimpedance.recordings.kinarm.exam import read_kinarm
from armimpedance.recordings.kinarm.trials import Choice
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions
from armimpedance.recordings.tables.folder import read_folder, write_folder

#: The file holds single precision: of 0.3 m, 3e-8 m; of two links, some more.
SINGLE_M = 2e-7


def read_exam(path, **options):
    """`read_kinarm` with the fields of its choice among the options; the force is the limb's."""
    choice = Choice(**{f: options.pop(f) for f in Choice.__dataclass_fields__ if f in options})
    return read_kinarm(path, choice=choice, **({"force_by": "limb"} | options))


def read(exams, tmp_path, trials=None, robot=None, **options):
    return read_exam(exams.folder(tmp_path, exams.files(trials, robot)), **options)


def test_hand_from_link_angles(exams, tmp_path):
    trial, robot = exams.Trial(), exams.Robot()
    recording = read(exams, tmp_path, [trial], robot)
    assert recording.kind == "hand"
    assert recording.sample_rate_hz == 1000.0
    np.testing.assert_allclose(recording.position, robot.hand(trial), atol=SINGLE_M)
    # From the angles, which leave steps of double precision, not from the single-precision hand.
    assert not np.array_equal(recording.position, recording.position.astype(np.float32))
    np.testing.assert_array_equal(recording.time_s, np.arange(300) / 1000.0)
    assert any("position: from the link angles" in s for s in recording.provenance)


def test_recorded_hand_where_the_links_disagree(exams, tmp_path):
    trial, robot = exams.Trial(hand_offset=0.002), exams.Robot()
    recording = read(exams, tmp_path, [trial], robot)
    np.testing.assert_allclose(recording.position, robot.hand(trial) + 0.002, atol=SINGLE_M)
    assert any("2.83 mm away" in s for s in recording.provenance)


def test_recorded_hand_where_there_are_no_link_angles(exams, tmp_path):
    trial, robot = exams.Trial(drop_channels=("Right_L1Ang",)), exams.Robot()
    recording = read(exams, tmp_path, [trial], robot)
    np.testing.assert_allclose(recording.position, robot.hand(trial), atol=SINGLE_M)


def test_sign_of_the_force(exams, tmp_path):
    limb = read(exams, tmp_path, force_by="limb")
    device = read(exams, tmp_path, force_by="device")
    assert limb.force[0].tolist() == [1.5, -2.5]
    np.testing.assert_array_equal(device.force, -limb.force)
    assert any("turned" in s for s in device.provenance)
    assert not any("turned" in s for s in limb.provenance)


def test_endpoint_robot_says_nothing_of_the_arm(exams, tmp_path):
    recording = read(exams, tmp_path)
    assert recording.joint_angles is None
    assert recording.shoulder_m is None
    np.testing.assert_array_equal(
        recording.extra["Right_L1Ang"], exams.Trial().angles()[:, 0].astype(float)
    )


@pytest.mark.parametrize("version", ["KINARM_H_R_001", "KINARM_M_Rev2"])
def test_exoskeleton_gives_the_arm(exams, tmp_path, version):
    trial, robot = exams.Trial(), exams.Robot(version=version, pointer=0.02)
    recording = read(exams, tmp_path, [trial], robot)
    first, second = trial.angles().astype(float).T
    np.testing.assert_array_equal(recording.joint_angles, np.column_stack([first, second - first]))
    np.testing.assert_allclose(recording.shoulder_m, robot.shoulder, atol=1e-8)
    np.testing.assert_allclose(recording.position, robot.hand(trial), atol=SINGLE_M)
    assert any("position: from the link angles" in s for s in recording.provenance)


def test_unknown_robot_keeps_the_recorded_hand(exams, tmp_path):
    trial, robot = exams.Trial(), exams.Robot(version="PROTOTYPE")
    recording = read(exams, tmp_path, [trial], robot)
    assert recording.joint_angles is None
    np.testing.assert_allclose(recording.position, robot.hand(trial), atol=SINGLE_M)


@pytest.mark.parametrize("version", ["KINARM_EP_Rev1", "KINARM_H_L_002"])
def test_left_arm_is_the_mirror_image_of_a_right_one(exams, tmp_path, version):
    right = exams.Robot(version=version, shoulder=(-0.1, 0.05), pointer=0.02)
    left = exams.Robot(version=version, shoulder=(0.1, 0.05), pointer=0.02)
    as_right = read(exams, tmp_path / "r", [exams.Trial()], right)
    mirrored = exams.Trial(side="Left", force=(-1.5, -2.5))
    as_left = read(exams, tmp_path / "l", [mirrored], left)
    np.testing.assert_allclose(as_left.position, as_right.position, atol=SINGLE_M)
    np.testing.assert_array_equal(as_left.force, as_right.force)
    if as_right.joint_angles is not None:
        np.testing.assert_allclose(as_left.joint_angles, as_right.joint_angles, atol=5e-7)
        np.testing.assert_allclose(as_left.shoulder_m, as_right.shoulder_m, atol=1e-8)
    assert any("mirrored" in s for s in as_left.provenance)
    assert any("position: from the link angles" in s for s in as_left.provenance)


def test_trials_are_in_the_order_they_were_run(exams, tmp_path):
    trials = [
        exams.Trial("01_01_01.c3d", samples=100, trial_num=3, events=()),
        exams.Trial("01_02_01.c3d", samples=120, trial_num=1, events=(), is_error=1),
        exams.Trial("02_01_02.c3d", samples=140, trial_num=2, events=(), tp="reach"),
    ]
    recording = read(exams, tmp_path, trials)
    table = recording.trials
    assert table["trial"].tolist() == [1, 2, 3]
    assert np.diff(recording.offsets).tolist() == [120, 140, 100]
    assert table["set"].tolist() == [1, 2, 1]
    assert table["protocol"].tolist() == [2, 1, 1]
    assert table["repetition"].tolist() == [1, 2, 1]
    assert table["condition"].tolist() == ["TP_2", "reach", "TP_1"]
    assert table["is_error"].tolist() == [True, False, False]


def test_numbers_that_start_again_in_every_set_are_counted_through(exams, tmp_path):
    trials = [
        exams.Trial("01_01_01.c3d", samples=100, trial_num=2),
        exams.Trial("01_02_01.c3d", samples=110, trial_num=1),
        exams.Trial("02_01_01.c3d", samples=120, trial_num=1),
    ]
    recording = read(exams, tmp_path, trials)
    assert recording.trials["trial"].tolist() == [1, 2, 3]
    assert np.diff(recording.offsets).tolist() == [110, 100, 120]


def test_trials_without_numbers_are_counted(exams, tmp_path):
    trials = [exams.Trial(f"01_0{i}_01.c3d", trial_num=None) for i in (1, 2)]
    assert read(exams, tmp_path, trials).trials["trial"].tolist() == [1, 2]


def test_events(exams, tmp_path):
    events = (("PERT ON", 0.15), ("OFF", 0.2), ("PERT_ON", 0.05), ("PERT ON", 0.25))
    trials = [
        exams.Trial("01_01_01.c3d", trial_num=1, events=events),
        exams.Trial("01_02_01.c3d", trial_num=2, events=(("PERT ON", 0.07),)),
    ]
    recording = read(exams, tmp_path, trials)
    times = recording.trials["event_PERT_ON_s"].to_numpy()
    np.testing.assert_allclose(times, [0.05, 0.07], atol=1e-7)
    assert np.isnan(recording.trials["event_OFF_s"][1])
    assert "onset_s" not in recording.trials
    timed = read(exams, tmp_path, trials, onset_event="PERT ON", end_event="OFF")
    assert timed.trials["trial"].tolist() == [1]
    np.testing.assert_allclose(timed.trials["onset_s"], [0.05], atol=1e-7)
    np.testing.assert_allclose(timed.trials["end_s"], [0.2], atol=1e-7)
    assert any("Left out" in s and "2" in s for s in timed.provenance)


def test_event_times_in_pairs_as_in_the_guide(exams, c3d, tmp_path):
    files = exams.files([exams.Trial(events=())])
    points, analog = np.ones((50, 2, 3)), np.ones((50, 2))
    groups = {
        "POINT": {"LABELS": c3d.texts("Right_Hand", "Left_Hand")},
        "ANALOG": {"LABELS": c3d.texts("Right_FS_ForceX", "Right_FS_ForceY")},
        "EVENTS": {
            "LABELS": c3d.texts("a", "b"),
            "TIMES": c3d.floats(0.0, 0.01, 0.0, 0.03, sizes=(2, 2)),
        },
        "TRIAL": {"TRIAL_NUM": c3d.shorts(1)},
    }
    files["01_02_01.c3d"] = c3d.write(points, analog, groups)
    trials = read_kinarm(exams.folder(tmp_path, files), force_by="limb").trials
    np.testing.assert_allclose(trials["event_a_s"], 0.01, atol=1e-7)
    np.testing.assert_allclose(trials["event_b_s"], 0.03, atol=1e-7)


def test_emg_inputs(exams, tmp_path):
    trial = exams.Trial(extra_channels={"ACH1": 0.5, "ACH2": 0.0})
    named = read(exams, tmp_path, [trial], emg_channels={"ACH1": "biceps_long"})
    assert named.muscles == ("biceps_long",)
    assert np.unique(named.emg).tolist() == [0.5]
    # The rest is kept under its own name, inputs that are zero throughout are not.
    assert {k for k in named.extra if k.startswith("ACH")} == {"ACH0"}


PERSONAL = (b"Jane", b"Doe", b"Secret", b"03/04/2021", b"11:12:13")


def test_personal_fields_stay_out(exams, tmp_path):
    exam = exams.zip(tmp_path / "Jane_Doe_2021.zip", exams.files())
    recording = read_kinarm(exam, force_by="limb")
    assert recording.subject.id == "unknown"
    write_folder(recording, tmp_path / "out", "csv")
    written = b"".join(p.read_bytes() for p in (tmp_path / "out").iterdir())
    assert not [field for field in PERSONAL if field in written]


def test_personal_fields_are_kept_on_demand(exams, tmp_path):
    recording = read(exams, tmp_path, keep_personal=True)
    assert recording.subject.id == "Jane Doe"
    assert recording.trials["date"].tolist() == ["03/04/2021"]
    assert recording.trials["time_of_day"].tolist() == ["11:12:13"]
    assert "STUDY: Secret study" in recording.provenance


@pytest.mark.parametrize("inside", ["", "raw/", "exam/raw/"])
def test_folder_and_zip_are_the_same(exams, tmp_path, inside):
    files = exams.files([exams.Trial(), exams.Trial("01_02_02.c3d", trial_num=2)])
    folder = exams.folder(tmp_path / "folder", files, inside)
    archive = exams.zip(tmp_path / "exam.zip", files, inside)
    a, b = (read_kinarm(path, force_by="limb") for path in (folder, archive))
    np.testing.assert_array_equal(a.position, b.position)
    np.testing.assert_array_equal(a.force, b.force)
    assert a.trials.equals(b.trials)


def test_other_files_in_the_exam_are_passed_over(exams, tmp_path):
    files = exams.files() | {"._01_02_01.c3d": b"resource fork", "analysis.c3d": b"x", "a.txt": b""}
    assert read_kinarm(exams.zip(tmp_path / "e.zip", files), force_by="limb").n_trials == 1


def test_converted_exam_reads_back(exams, tmp_path):
    trials = [exams.Trial(), exams.Trial("01_03_01.c3d", trial_num=2, samples=250)]
    robot = exams.Robot(version="KINARM_H_R")
    recording = read(exams, tmp_path / "exam", trials, robot, onset_event="PERT_ON")
    write_folder(recording, tmp_path / "out")
    back = read_folder(tmp_path / "out")
    np.testing.assert_array_equal(back.position, recording.position)
    np.testing.assert_array_equal(back.joint_angles, recording.joint_angles)
    assert back.trials.equals(recording.trials)
    assert back.provenance == recording.provenance


# ---- bad exams ----------------------------------------------------------------------------------


def refused(path, **options) -> InputError:
    with pytest.raises(InputError) as caught:
        read_exam(path, **options)
    assert "\n" not in str(caught.value)
    assert caught.value.file is not None
    return caught.value


@pytest.mark.parametrize("drop", [True, False])
def test_no_force_sensor(exams, tmp_path, drop):
    channels = ("Right_FS_ForceX", "Right_FS_ForceY")
    trial = exams.Trial(drop_channels=channels) if drop else exams.Trial(force=(0.0, 0.0))
    error = refused(exams.folder(tmp_path, exams.files([trial])))
    assert "absent" in error.problem


def test_side_without_a_sensor(exams, tmp_path):
    assert "left" in refused(exams.folder(tmp_path, exams.files()), side="left").problem


def test_both_arms_need_a_choice(exams, tmp_path):
    both = exams.Trial(
        drop_channels=("Left_FS_ForceX",),
        extra_channels={"Left_FS_ForceX ": 1.0, "Left_L1Ang": 1.0},
    )
    folder = exams.folder(tmp_path, exams.files([both]))
    assert "--side" in str(refused(folder))
    assert read_kinarm(folder, force_by="limb", side="right").force[0, 0] == 1.5


def test_no_common_file(exams, tmp_path):
    files = exams.files()
    del files["common.c3d"]
    assert "common.c3d" in refused(exams.folder(tmp_path, files)).problem
    assert "common.c3d" in refused(exams.zip(tmp_path / "e.zip", files)).problem


def test_no_trials(exams, tmp_path):
    files = {"common.c3d": exams.files()["common.c3d"]}
    assert "no trials" in refused(exams.folder(tmp_path, files)).problem


def test_two_exams(exams, tmp_path):
    for name in ("a", "b"):
        exams.folder(tmp_path, exams.files(), name)
    assert "2 exams" in refused(tmp_path).problem


@pytest.mark.parametrize("part", [0.2, 0.5, 0.9])
def test_truncated_trial(exams, tmp_path, part):
    files = exams.files()
    whole = files["01_02_01.c3d"]
    files["01_02_01.c3d"] = whole[: int(part * len(whole))]
    assert "01_02_01.c3d" in str(refused(exams.folder(tmp_path, files)).file)


def test_header_claims_more_frames(exams, tmp_path):
    files = exams.files()
    data = bytearray(files["01_02_01.c3d"])
    struct.pack_into("<H", data, 8, 5000)
    files["01_02_01.c3d"] = bytes(data)
    assert "claims 5000" in refused(exams.folder(tmp_path, files)).problem


def test_not_finite(exams, tmp_path):
    trial = exams.Trial(force=(1.0, float("nan")))
    error = refused(exams.folder(tmp_path, exams.files([trial])))
    assert (error.column, error.row) == ("Right_FS_ForceY", 1)


def test_missing_channel(exams, tmp_path):
    trial = exams.Trial(drop_channels=("Right_FS_ForceY",))
    error = refused(exams.folder(tmp_path, exams.files([trial])))
    assert error.column == "Right_FS_ForceY"


def test_missing_emg_input(exams, tmp_path):
    error = refused(exams.folder(tmp_path, exams.files()), emg_channels={"ACH7": "biceps"})
    assert error.column == "ACH7"


def test_two_inputs_of_one_muscle(exams, tmp_path):
    folder = exams.folder(tmp_path, exams.files())
    with pytest.raises(InputError, match="one muscle"):
        read_kinarm(folder, force_by="limb", emg_channels={"ACH0": "a", "ACH1": "a"})


def test_unknown_event_lists_those_there_are(exams, tmp_path):
    error = refused(exams.folder(tmp_path, exams.files()), onset_event="GO")
    assert "PERT_ON" in str(error)


@pytest.mark.parametrize("times", [(0.1, 0.5), (0.1, 0.3), (0.2, 0.1), (-0.1, 0.1)])
def test_events_that_cannot_be(exams, tmp_path, times):
    trial = exams.Trial(events=(("ON", times[0]), ("OFF", times[1])))
    folder = exams.folder(tmp_path, exams.files([trial]))
    assert "event" in refused(folder, onset_event="ON", end_event="OFF").problem


@pytest.mark.parametrize(
    "name", ["../evil.c3d", "raw/../../evil.c3d", "/etc/evil.c3d", "C:/evil.c3d", "..\\evil.c3d"]
)
def test_zip_with_paths_outside(exams, tmp_path, name):
    path = exams.zip(tmp_path / "e.zip", exams.files())
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, b"x")
    assert "outside" in refused(path).problem
    assert [p.name for p in tmp_path.iterdir()] == ["e.zip"]


def test_zip_that_would_unpack_to_too_much(exams, tmp_path, monkeypatch):
    path = exams.zip(tmp_path / "e.zip", exams.files())
    monkeypatch.setattr(packing, "LARGEST_EXAM_BYTES", 10_000)
    assert "would unpack" in refused(path).problem


def test_zip_that_lies_about_its_size(exams, tmp_path):
    path = exams.zip(tmp_path / "e.zip", {**exams.files(), "01_09_01.c3d": b"\0" * 5_000_000})
    data = path.read_bytes()
    # The size unpacked stands in the local header and in the directory.
    path.write_bytes(data.replace(struct.pack("<I", 5_000_000), struct.pack("<I", 1000)))
    recording = read_kinarm(path, force_by="limb")
    assert recording.n_trials == 1
    (broken,) = (f for f in recording.findings if f.name == "broken trials")
    assert "01_09_01.c3d (cannot be unpacked)" in broken.message


def test_zip_twice_the_same_trial(exams, tmp_path):
    path = exams.zip(tmp_path / "e.zip", exams.files())
    with pytest.warns(UserWarning, match="Duplicate"), zipfile.ZipFile(path, "a") as archive:
        archive.writestr("raw/01_02_01.c3d", exams.files()["01_02_01.c3d"])
    assert "twice" in refused(path).problem


@pytest.mark.parametrize("part", [0.0, 0.3, 0.99])
def test_broken_zip(exams, tmp_path, part):
    path = exams.zip(tmp_path / "e.zip", exams.files())
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    assert "zip" in refused(path).problem


def test_damaged_zip_member(exams, tmp_path):
    path = exams.zip(tmp_path / "e.zip", exams.files())
    data = bytearray(path.read_bytes())
    at = data.index(b"01_02_01.c3d") + 500
    data[at : at + 40] = b"\xff" * 40
    path.write_bytes(bytes(data))
    assert "unpacked" in refused(path).problem


def test_an_archive_that_is_no_zip(tmp_path):
    (tmp_path / "e.kinarm").write_bytes(b"PK")
    assert "zip" in refused(tmp_path / "e.kinarm").problem


def test_file_that_may_not_be_read(exams, tmp_path):
    exams.folder(tmp_path, exams.files())
    secret = tmp_path / "01_02_01.c3d"
    secret.chmod(0)
    try:
        secret.read_bytes()
    except PermissionError:
        assert "cannot be read" in refused(tmp_path).problem
    finally:
        secret.chmod(stat.S_IRUSR | stat.S_IWUSR)


# ---- opening anything ---------------------------------------------------------------------------


def test_open_recording_knows_its_formats(exams, tables, tmp_path):
    folder = tables.write()
    archive = exams.zip(tmp_path / "e.zip", exams.files())
    loose = exams.folder(tmp_path / "loose", exams.files(), "raw")
    assert open_recording(folder).n_trials == 2
    assert open_recording(archive, ReadOptions(force_by="device")).force[0, 0] == -1.5
    assert open_recording(loose, ReadOptions(force_by="limb", side="right")).n_trials == 1


def test_open_recording_asks_for_the_sign(exams, tmp_path):
    archive = exams.zip(tmp_path / "e.zip", exams.files())
    with pytest.raises(InputError, match="--force-by"):
        open_recording(archive)


def test_open_recording_refuses_what_it_cannot_use(tables, tmp_path):
    with pytest.raises(InputError, match="--force-by with a folder with recording.json"):
        open_recording(tables.write(), ReadOptions(force_by="limb"))
    with pytest.raises(InputError, match="no such file"):
        open_recording(tmp_path / "none")
    (tmp_path / "a.xyz").write_text("x")
    with pytest.raises(InputError, match=r"recording\.json"):
        open_recording(tmp_path / "a.xyz")
    (tmp_path / "e.kinarm").write_bytes(b"PK")
    with pytest.raises(InputError, match="not a readable zip"):
        open_recording(tmp_path / "e.kinarm")
