"""Kinarm archives, written byte by byte: they give what C3D gives, or say by name why not."""

from __future__ import annotations

import struct
import time
import tracemalloc
import zipfile
from dataclasses import replace

import kinarm_archives as archives
import kinarm_bench as bench
import numpy as np
import pandas as pd
import pytest

from armimpedance.app.inspection import inspect
from armimpedance.core.errors import InputError
from armimpedance.hand.still.show import estimate
from armimpedance.recordings.kinarm import exam_file as packing
from armimpedance.recordings.kinarm.channels import grouped
from armimpedance.recordings.kinarm.exam import read_kinarm
from armimpedance.recordings.kinarm.trials import Choice
from armimpedance.recordings.opening import open_recording
from armimpedance.recordings.reading import ReadOptions

TIMED = Choice(onset_event="PERT_ON", end_event="PERT_OFF")


@pytest.fixture(scope="module")
def session(exams, c3d):
    """Eight pushes and the robot of a lab."""
    trials = [
        bench.trial_of(exams, i + 1, bench.push(2 * np.pi * i / 8, handle=(0.0, -0.0005)))
        for i in range(8)
    ]
    robot = bench.robot_of(exams, (0.0, -0.0005), tables=bench.tables_of(c3d))
    return trials, robot


@pytest.fixture
def exam(exams, tmp_path):
    """What reads an archive of these members, those of a small sound one changed."""

    def read(changes=None, trials=None, robot=None, name="e.kinarm", **options):
        files = archives.members(exams, trials, robot) | (changes or {})
        files = {name: data for name, data in files.items() if data is not None}
        path = archives.packed(tmp_path / name, files)
        return read_kinarm(path, **({"force_by": "limb"} | options))

    return read


def refused(exam, *args, **options):
    with pytest.raises(InputError) as caught:
        exam(*args, **options)
    return caught.value


def assert_same(one, other):
    """Two recordings are the same to the last bit, sentences and findings and all."""
    pd.testing.assert_frame_equal(one.trials, other.trials, check_exact=True)
    for name in ("offsets", "time_s", "position", "force", "joint_angles", "emg", "shoulder_m"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), name, strict=True)
    assert one.extra.keys() == other.extra.keys()
    for name, values in one.extra.items():
        np.testing.assert_array_equal(values, other.extra[name], name, strict=True)
    for name in ("provenance", "findings", "subject", "muscles", "sample_rate_hz"):
        assert getattr(one, name) == getattr(other, name)


def both_doors(exams, tmp_path, trials, robot, version=3, **options):
    """The same exam as C3D files and as an archive."""
    files = archives.members(exams, trials, robot, version)
    paths = (
        exams.zip(tmp_path / "exam.zip", exams.files(trials, robot)),
        archives.packed(tmp_path / "exam.kinarm", files),
    )
    return [read_kinarm(path, **options) for path in paths]


# ---- the same as from C3D ------------------------------------------------------------------------


@pytest.mark.parametrize("version", [2, 3])
def test_the_same_recording_and_estimates(exams, session, tmp_path, version):
    trials, robot = session
    options = {"choice": TIMED, "emg_channels": {"ACH0": "biceps"}, "keep_personal": True}
    from_c3d, from_archive = both_doors(exams, tmp_path, trials, robot, version, **options)
    assert_same(from_c3d, from_archive)
    found = [estimate(r, despite="directions").to_frame() for r in (from_c3d, from_archive)]
    pd.testing.assert_frame_equal(*found, check_exact=True)


@pytest.mark.parametrize("side", ["Right", "Left"])
@pytest.mark.parametrize("version", ["KINARM_EP_Rev1", "KINARM_H_Rev1", "KINARM_M_Rev1", "NEW_X"])
def test_every_robot_and_side(exams, tmp_path, side, version):
    robot = exams.Robot(version=version, pointer=0.02)
    trials = [exams.Trial(side=side), exams.Trial("02_01_01.c3d", side=side, trial_num=9, tp="x y")]
    from_c3d, from_archive = both_doors(exams, tmp_path, trials, robot, force_by="device")
    assert_same(from_c3d, from_archive)
    known = any("not known" in sentence for sentence in from_archive.provenance)
    assert known == (version == "NEW_X")


def test_an_unpacked_archive_is_read_as_well(exams, tmp_path):
    path = archives.packed(tmp_path / "e.kinarm", archives.members(exams))
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "unpacked")
    packed = read_kinarm(path, force_by="limb")
    for folder in (tmp_path / "unpacked", tmp_path / "unpacked" / "raw"):
        assert_same(open_recording(folder, ReadOptions(force_by="limb")), packed)


def test_events_in_the_parameters_are_older_ones(exam, exams, c3d):
    groups = {
        "TRIAL": {"TRIAL_NUM": c3d.shorts(1, sizes=())},
        "EVENTS": {"LABELS": c3d.texts("OLD"), "TIMES": c3d.floats(0.05)},
    }
    place = "raw/01_02_01/"
    members = {f"{place}parameters.bin": archives.parameters(groups)}
    assert "event_PERT_ON_s" in exam(members).trials
    without = members | {f"{place}examevents.bin": None}
    assert exam(without).trials["event_OLD_s"].tolist() == [0.05]


def test_status_words_are_whole_numbers(exams, tmp_path):
    """A word of 32 bits stands in the files as if its bits were a number's."""
    words = np.array([0, 1, 0x80000000, 0x7F800001, 0xFFFFFFFF] * 60, dtype=np.uint32)
    as_if = words.view(np.float32)
    files = {}
    trial, robot = exams.Trial(extra_channels={"StatusBits": 5.0}), exams.Robot()
    for name, data in archives.members(exams, [trial], robot).items():
        files[name] = data
    points, channels, groups = exams.content(trial, robot)
    labels = (*channels, "Right_FS_Status")
    head = archives.header("01_02_01", 300, 1000.0, labels, ("Right_Hand",))
    member = archives.series("Right_FS_Status", [], "none")[:-4] + archives.number(300)
    files |= {
        "raw/01_02_01/header.bin": head,
        "raw/01_02_01/Right_FS_Status.kinematics": member + as_if.tobytes(),
    }
    recording = read_kinarm(archives.packed(tmp_path / "e.kinarm", files), force_by="limb")
    np.testing.assert_array_equal(recording.extra["Right_FS_Status"], words)
    assert set(recording.extra["StatusBits"]) == {5.0}
    # The C3D writer of the tests would turn some of the bits: they are put in afterwards.
    whole = exams.Trial(extra_channels={"StatusBits": 5.0, "Right_FS_Status": 7.0})
    data = exams.files([whole], robot)
    marked = np.full(300, 7.0, dtype="<f4").tobytes()[:4]
    assert data["01_02_01.c3d"].count(marked) >= 300
    frames = bytearray(data["01_02_01.c3d"])
    at = 0
    for word in words:
        at = frames.index(marked, at)
        frames[at : at + 4] = struct.pack("<I", word)
    data["01_02_01.c3d"] = bytes(frames)
    as_c3d = read_kinarm(exams.zip(tmp_path / "e.zip", data), force_by="limb")
    np.testing.assert_array_equal(as_c3d.extra["Right_FS_Status"], words)


def test_a_left_robot_alone_under_the_right_names(exams, c3d, tmp_path):
    """Its hand, or all of its data, stand under the right one's names."""
    trial, robot = exams.Trial(side="Left"), exams.Robot()
    groups = exams.shared(robot)
    for side, there in (("RIGHT", 0), ("LEFT", 1)):
        groups[f"{side}_KINARM"]["IS_PRESENT"] = c3d.shorts(there, sizes=())
    shared = {"raw/common/parameters.bin": archives.parameters(groups)}
    files = archives.members(exams, [trial], robot) | shared
    own = read_kinarm(archives.packed(tmp_path / "own.kinarm", files), force_by="limb")
    hand = files["raw/01_02_01/Left_Hand.position"]
    other = files["raw/01_02_01/Right_Hand.position"]
    swapped = {"raw/01_02_01/Right_Hand.position": hand, "raw/01_02_01/Left_Hand.position": other}
    hand_only = read_kinarm(
        archives.packed(tmp_path / "hand.kinarm", files | swapped), force_by="limb"
    )
    as_right = archives.members(exams, [trial], robot)
    points, channels, _ = exams.content(trial, robot)
    renamed = {
        label.replace("Left", "?").replace("Right", "Left").replace("?", "Right"): values
        for label, values in channels.items()
    }
    as_right = {n: d for n, d in as_right.items() if not n.endswith(".kinematics")} | shared
    as_right |= swapped | {
        "raw/01_02_01/header.bin": archives.header(
            "01_02_01", 300, 1000.0, tuple(renamed), ("Right_Hand", "Left_Hand")
        ),
        **{f"raw/01_02_01/{n}.kinematics": archives.series(n, v) for n, v in renamed.items()},
    }
    everything = read_kinarm(archives.packed(tmp_path / "all.kinarm", as_right), force_by="limb")
    for recording in (hand_only, everything):
        for name in ("position", "force", "joint_angles", "shoulder_m"):
            np.testing.assert_array_equal(getattr(recording, name), getattr(own, name))
        assert any("under Right_ names" in sentence for sentence in recording.provenance)
    assert not any("under Right_ names" in sentence for sentence in own.provenance)


# ---- what is not taken ---------------------------------------------------------------------------


def test_what_is_not_taken_is_told(exam, exams, session):
    trials, robot = session
    more = {"Right_FS_TorqueX": 0.1, "Right_FS_TorqueY": 0.2, "Gaze_X": 1.0, "Left_L1Ang": 0.5}
    channels = [replace(trial, extra_channels=more) for trial in trials]
    beside = {
        "analysis/result/parameters.bin": b"",
        "description.txt": b"x",
        "raw/01_01_01/videoack.bin": archives.shown([0.1, 0.2]),
    }
    points, there, _ = exams.content(channels[0], robot)
    frames = channels[0].samples
    beside["raw/01_01_01/header.bin"] = archives.header(
        "01_01_01", frames, 1000.0, tuple(there), ("Right_Hand",), 2, shown=1
    )
    told = "\n".join(exam(beside, channels, robot).provenance)
    assert "Not taken: Gaze_X, Right_FS_ForceZ, Right_FS_TorqueX/Y (" in told
    assert "Not taken: Left_L1Ang (" in told
    for what in ("the results of an analysis", "the exam's own label", "frames were shown"):
        assert what in told


def test_inspect_lists_what_is_not_taken(exams, session, tmp_path):
    path = archives.packed(tmp_path / "e.kinarm", archives.members(exams, *session))
    assert "Right_FS_ForceZ" in str(inspect(path))


def test_labels_that_differ_at_their_end_stand_together():
    labels = ["ACH10", "ACH9", "Gaze_X", "Gaze_Y", "Right_FS_TorqueZ", "Right_FS_TorqueX", "Z", "3"]
    told = ["3", "ACH9/10", "Gaze_X/Y", "Right_FS_TorqueX/Z", "Z"]
    assert grouped(labels) == told


# ---- damage --------------------------------------------------------------------------------------

NEEDED = [
    "header.bin",
    "parameters.bin",
    "examevents.bin",
    "Right_Hand.position",
    "Right_L1Ang.kinematics",
    "Right_FS_ForceX.kinematics",
]


def damaged(data, how):
    version = struct.unpack("<i", data[:4])[0]
    return {
        "cut off": data[: len(data) // 2],
        "empty": b"",
        "version": struct.pack("<i", version + 7) + data[4:],
        "big-endian": struct.pack(">i", version) + data[4:],
        "negative count": data[:4] + struct.pack("<i", -5) + data[8:],
        "huge count": data[:4] + struct.pack("<i", 2**31 - 1) + data[8:],
        "missing": None,
    }[how]


@pytest.mark.parametrize("member", NEEDED)
@pytest.mark.parametrize(
    "how", ["cut off", "empty", "version", "big-endian", "negative count", "huge count", "missing"]
)
def test_a_damaged_member_costs_its_trial(exam, exams, member, how):
    if how == "missing" and member == "examevents.bin":
        return
    if member == "parameters.bin" and how in ("negative count", "huge count"):
        return
    trials = [exams.Trial(), exams.Trial("01_02_02.c3d", trial_num=2)]
    place = f"raw/01_02_01/{member}"
    whole = archives.members(exams, trials)[place]
    recording = exam({place: damaged(whole, how)}, trials)
    assert recording.n_trials == 1
    (broken,) = (f for f in recording.findings if f.name == "broken trials")
    assert "1 of 2 are left out: 01_02_01 (" in broken.message
    if how == "version":
        assert f"version {struct.unpack('<i', whole[:4])[0] + 7} is not known" in broken.message
    if how == "big-endian":
        assert "big-endian" in broken.message


@pytest.mark.parametrize("how", ["cut off", "empty", "version", "missing"])
def test_what_nobody_reads_may_be_damaged(exam, exams, how):
    place = "raw/01_02_01/Right_FS_ForceZ.kinematics"
    recording = exam({place: damaged(archives.members(exams)[place], how)})
    assert recording.n_trials == 1
    assert any("Right_FS_ForceZ" in sentence for sentence in recording.provenance)


@pytest.mark.parametrize("how", ["cut off", "empty", "version", "big-endian"])
@pytest.mark.parametrize("member", ["header.bin", "parameters.bin"])
def test_damage_in_what_all_share_is_an_error(exam, exams, member, how):
    place = f"raw/common/{member}"
    error = refused(exam, {place: damaged(archives.members(exams)[place], how)})
    assert f"common/{member}" in str(error.file)
    if how == "version":
        assert "version 10 is not known" in error.problem


def test_a_channel_of_another_length(exam, exams):
    trials = [exams.Trial(), exams.Trial("01_02_02.c3d", trial_num=2)]
    for place, data in (
        ("Right_FS_ForceX.kinematics", archives.series("Right_FS_ForceX", np.ones(299))),
        ("Right_Hand.position", archives.places("Right_Hand", np.ones((301, 2)))),
    ):
        recording = exam({f"raw/01_02_01/{place}": data}, trials)
        assert recording.n_trials == 1
        assert any("the header says 300" in f.message for f in recording.findings)


def test_a_channel_with_nothing_was_not_recorded(exam):
    place = "raw/01_02_01/Right_Hand.position"
    recording = exam({place: archives.places("Right_Hand", [])})
    assert any("no recorded hand" in sentence for sentence in recording.provenance)
    place = "raw/01_02_01/Right_FS_ForceX.kinematics"
    error = refused(exam, {place: archives.series("Right_FS_ForceX", [])})
    assert (error.problem, error.column) == ("no such channel", "Right_FS_ForceX")


def test_the_label_inside_counts(exam, exams):
    """A member's name is the header's; what it holds is said inside."""
    points, channels, _ = exams.content(exams.Trial(), exams.Robot())
    names = tuple("channel 9" if n == "ACH0" else n for n in channels)
    recording = exam(
        {
            "raw/01_02_01/header.bin": archives.header(
                "01_02_01", 300, 1000.0, names, ("Right_Hand",)
            ),
            "raw/01_02_01/ACH0.kinematics": None,
            "raw/01_02_01/channel 9.kinematics": archives.series("ACH0", channels["ACH0"]),
        },
        emg_channels={"ACH0": "biceps"},
    )
    np.testing.assert_array_equal(recording.emg[:, 0], 0.25)


def test_empty_trials_are_told(exam, exams):
    empty = {"samples": 0, "links": np.zeros((0, 2)), "forces": np.zeros((0, 2))}
    trials = [exams.Trial(), replace(exams.Trial("01_02_02.c3d", trial_num=2), **empty)]
    recording = exam(trials=trials)
    (finding,) = (f for f in recording.findings if f.name == "empty trials")
    assert "1 of 2 hold no samples and are left out: 01_02_02" in finding.message


def test_two_exams_and_none(exam, exams):
    second = archives.members(exams, root="b/")
    assert "2 exams" in refused(exam, second).problem
    assert "2 exams" in refused(exam, exams.files()).problem
    nothing = dict.fromkeys(archives.members(exams), None)
    assert "no folder common" in refused(exam, {**nothing, "a.txt": b""}).problem


# ---- hostile archives ----------------------------------------------------------------------------


def test_archives_that_would_unpack_to_too_much(exam, tmp_path, monkeypatch):
    bomb = {"raw/01_02_01/x.kinematics": bytes(packing.SMALL_BYTES + 1)}
    assert "times its size" in refused(exam, bomb).problem
    monkeypatch.setattr(packing, "MOST_MEMBERS", 5)
    assert "more than 5 files" in refused(exam).problem


@pytest.mark.parametrize("member", ["header.bin", "parameters.bin", "examevents.bin"])
def test_what_an_exam_says_of_itself_is_short(exam, exams, member):
    """Millions of empty records would be read one by one."""
    place, padding = f"raw/01_02_01/{member}", np.random.default_rng(1).bytes(3_000_000)
    whole = archives.members(exams)[place]
    assert "is larger than" in refused(exam, {place: whole + padding}).problem


def test_claimed_counts_cost_no_memory(exam, exams):
    """A count of two thousand million is held against what is there before space is taken."""
    files = {
        "raw/01_02_01/header.bin": archives.number(3) + struct.pack("<5i", *[2**31 - 1] * 5),
        "raw/01_02_01/Right_L1Ang.kinematics": archives.series("Right_L1Ang", [])[:-4]
        + archives.number(2**31 - 1),
        "raw/01_02_02/header.bin": archives.header("", 2**29, 1000.0, ("Right_L1Ang",), ()),
    }
    trials = [exams.Trial(), exams.Trial("01_02_02.c3d", trial_num=2)]
    tracemalloc.start()
    refused(exam, files, trials)
    assert tracemalloc.get_traced_memory()[1] < 20e6
    tracemalloc.stop()


def mutated(rng, files):
    """One member of an archive changed: bits, bytes gone or put in, a count or version replaced."""
    name = rng.choice(sorted(files))
    data = bytearray(files[name])
    at = int(rng.integers(max(len(data) - 4, 1)))
    kind = rng.integers(6)
    if kind == 0 and data:
        data[min(at, len(data) - 1)] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        data = data[:at]
    elif kind == 2:
        data[at:at] = rng.bytes(int(rng.integers(1, 9)))
    elif kind == 3:
        del data[at : at + int(rng.integers(1, 9))]
    elif kind == 4:
        word = rng.choice([-1, 0, 1, 3, 255, 65536, 2**31 - 1, -(2**31)])
        at = min(at // 4 * 4, max(len(data) - 4, 0))
        data[at : at + 4] = struct.pack("<i", word)
    else:
        return {n: d for n, d in files.items() if n != name}
    return files | {str(name): bytes(data)}


def fuzz(exams, folder, count, seed):
    """How many of so many mutated archives are read; all others are refused by a typed error."""
    rng = np.random.default_rng(seed)
    trials = [exams.Trial(samples=40, events=(("PERT_ON", 0.01),)) for _ in (1, 2)]
    trials[1] = replace(trials[1], name="01_02_02.c3d", trial_num=2)
    whole = archives.members(exams, trials)
    read, lines = 0, set()
    for _ in range(count):
        files = mutated(rng, whole)
        path = archives.packed(folder / "e.kinarm", files)
        if rng.integers(4) == 0:
            data = bytearray(path.read_bytes())
            for _ in range(int(rng.integers(1, 4))):
                data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
            path.write_bytes(bytes(data))
        started = time.perf_counter()
        try:
            read_kinarm(path, force_by="limb")
            read += 1
        except InputError as error:
            lines.add(str(error).count("\n"))
        assert time.perf_counter() - started < 2.0
    assert lines == {0}
    return read


@pytest.mark.study
@pytest.mark.filterwarnings("error")
def test_mutated_archives(exams, tmp_path):
    assert 100 < fuzz(exams, tmp_path, 250, seed=18) < 250
