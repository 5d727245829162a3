"""Kinarm exams as labs have them: hundreds of trials, some empty or broken, nothing stated."""

from __future__ import annotations

import re
import struct
from dataclasses import replace

import kinarm_bench as bench
import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.app.inspection import inspect
from armimpedance.core.errors import InputError
from armimpedance.hand.show import read_results
from armimpedance.recordings.c3d.c3d_file import parse_c3d
from armimpedance.recordings.kinarm.dynamics import link_inertias
from armimpedance.recordings.kinarm.robot import robot_of
from armimpedance.show.verbs.results import read

HANDLE = (0.0, -0.0005)
CENTRE = np.array([-0.05, 0.42])


@pytest.fixture(scope="module")
def pushes():
    """Eight pushes by the robot, one in each direction."""
    return [bench.push(2 * np.pi * i / 8, handle=HANDLE) for i in range(8)]


@pytest.fixture(scope="module")
def lab(exams, c3d, pushes):
    """Files of an exam of these trials; fields of single ones by their number."""

    def files(count, *, changes=None, force_by="limb", noise_n=0.0, unit_n=1.0, **robot):
        rng = np.random.default_rng(16)
        changes = changes or {}
        trials = []
        for number in range(1, count + 1):
            made = pushes[(number - 1) % 8]
            trial = bench.trial_of(
                exams,
                number,
                made,
                force_by=force_by,
                unit_n=unit_n,
                noise=rng.normal(0, noise_n, made.force.shape) if noise_n else None,
            )
            trials.append(replace(trial, **changes.get(number, {})))
        known = bench.robot_of(exams, HANDLE, **({"tables": bench.tables_of(c3d)} | robot))
        return exams.files(trials, known)

    return files


EMPTY = {
    "samples": 0,
    "links": np.zeros((0, 2)),
    "forces": np.zeros((0, 2)),
    "motors": np.zeros((0, 2)),
}


def finding(recording, name):
    (found,) = (f for f in recording.findings if f.name == name)
    return found


# ---- the exam ------------------------------------------------------------------------------------


@pytest.mark.study
@pytest.mark.parametrize("force_by", ["limb", "device"])
def test_an_exam_of_661_trials_in_one_call(lab, exams, pushes, tmp_path, capsys, force_by):
    """6 trials are empty, the handle is off its link, nobody says whose force the sensor holds."""
    empty = (17, 100, 101, 333, 500, 661)
    noise_n = 0.1
    files = lab(661, changes=dict.fromkeys(empty, EMPTY), force_by=force_by, noise_n=noise_n)
    exam, session = exams.zip(tmp_path / "exam.zip", files), tmp_path / "session"
    assert main(["convert", str(exam), str(session)]) == 0
    told = capsys.readouterr()
    names = [f"01_{(n - 1) % 8 + 1:02d}_{(n - 1) // 8 + 1:02d}.c3d" for n in empty]
    for text in (told.out, told.err):
        assert "6 of 661 hold no samples" in text
        assert all(name in text for name in names)
    assert f"Force sign: by the {force_by}: inertial torque = " in told.out
    assert "-0.500 mm across link 2" in told.out

    recording = read(session)
    assert recording.trials["trial"].tolist() == [n for n in range(1, 662) if n not in empty]
    which = recording.trials["protocol"].to_numpy() - 1
    assert np.diff(recording.offsets).tolist() == [len(pushes[i].force) for i in which]
    force = np.concatenate([pushes[i].force for i in which])
    assert np.std(recording.force - force) == pytest.approx(noise_n, rel=0.01)
    # Single precision of the angles, 1e-7 rad, times the links.
    hand = bench.places(np.concatenate([pushes[i].links for i in which]), HANDLE)
    np.testing.assert_allclose(recording.position, hand, atol=2e-7)
    assert any("6 of 661 hold no samples" in sentence for sentence in recording.provenance)


def test_half_of_an_exam_may_be_empty(lab, exams, tmp_path):
    empty = range(2, 95, 2)
    recording = read(
        exams.folder(tmp_path, lab(93, changes=dict.fromkeys(list(empty)[:47], EMPTY)), "raw")
    )
    assert recording.n_trials == 93 - 46
    assert "46 of 93" in finding(recording, "empty trials").message


def test_an_exam_that_is_empty_is_refused(lab, exams, tmp_path):
    files = lab(3, changes=dict.fromkeys((1, 2, 3), EMPTY))
    with pytest.raises(InputError, match="none of the 3 trials holds a sample"):
        read(exams.folder(tmp_path, files))


def test_every_way_to_say_that_there_are_no_frames(lab, exams, tmp_path):
    """First and last frame 0, or no block at which data would start."""
    files = lab(4, changes=dict.fromkeys((2, 3), EMPTY))
    second, third = (bytearray(files[f"01_{n:02d}_01.c3d"]) for n in (2, 3))
    struct.pack_into("<HH", second, 6, 0, 0)
    struct.pack_into("<H", third, 16, 0)
    files |= {"01_02_01.c3d": bytes(second), "01_03_01.c3d": bytes(third)}
    recording = read(exams.folder(tmp_path, files))
    assert recording.trials["trial"].tolist() == [1, 4]
    assert "2 of 4 hold no samples" in finding(recording, "empty trials").message


# ---- broken trials -------------------------------------------------------------------------------


def with_nan(values):
    return np.where(np.arange(len(values))[:, None] == 7, np.nan, values)


BROKEN = {
    "not finite": lambda made: {"forces": with_nan(made.force)},
    "no such channel": lambda _: {"drop_channels": ("Right_L2Ang",)},
    "500 samples/s": lambda _: {"rate": 500.0},
    "zero throughout": lambda made: {"forces": np.zeros_like(made.force)},
    "is out of reach": lambda made: {"links": made.links + [[0.0, 1e6]]},
    "lies outside": lambda _: {"events": (("PERT_ON", 9.0), ("PERT_OFF", 9.5))},
}


@pytest.mark.parametrize("problem", BROKEN)
def test_a_broken_trial_is_left_out_by_name(lab, exams, pushes, tmp_path, capsys, problem):
    files = lab(16, changes={5: BROKEN[problem](pushes[4])})
    exam = exams.zip(tmp_path / "exam.zip", files)
    events = ["--onset-event", "PERT_ON", "--end-event", "PERT_OFF"]
    assert main(["convert", str(exam), str(tmp_path / "session"), *events]) == 3
    told = capsys.readouterr().err
    assert "1 of 16 are left out: 01_05_01.c3d (" in told
    assert problem in told
    assert "\n" not in told.strip()
    assert read(tmp_path / "session").trials["trial"].tolist() == [*range(1, 5), *range(6, 17)]


def test_a_file_cut_off_is_left_out_by_name(lab, exams, tmp_path):
    files = lab(16)
    files["01_05_01.c3d"] = files["01_05_01.c3d"][:-3000]
    recording = read(exams.folder(tmp_path, files))
    assert recording.n_trials == 15
    assert "01_05_01.c3d (the header claims" in finding(recording, "broken trials").message


def test_a_trial_twice_is_left_out_and_two_of_one_number_are_counted(lab, exams, tmp_path):
    files = lab(16)
    files["01_01_09.c3d"] = files["01_01_01.c3d"]
    recording = read(exams.folder(tmp_path / "copy", files))
    assert recording.n_trials == 16
    assert "01_01_09.c3d (number and samples of 01_01_01.c3d once more)" in str(
        finding(recording, "broken trials")
    )
    files = lab(16, changes={7: {"trial_num": 3}})
    recording = read(exams.folder(tmp_path / "number", files))
    assert recording.trials["trial"].tolist() == list(range(1, 17))
    assert any("not unique" in sentence for sentence in recording.provenance)


def test_where_no_trial_is_left_the_first_reason_is_told(lab, exams, pushes, tmp_path):
    changes = {n: {"forces": with_nan(pushes[n - 1].force)} for n in (1, 2, 3)}
    with pytest.raises(InputError, match="not finite; none of the 3 trials can be used") as caught:
        read(exams.folder(tmp_path, lab(3, changes=changes)))
    assert (caught.value.row, caught.value.column) == (8, "Right_FS_ForceX")


# ---- a single trial ------------------------------------------------------------------------------


def test_a_single_trial_with_what_its_exam_shares(lab, exams, tmp_path):
    folder = exams.folder(tmp_path, lab(16))
    whole = read(folder)
    alone = read(folder / "01_03_02.c3d")
    # The handle's place is fitted to the one trial, in single precision.
    np.testing.assert_allclose(alone.position, whole.select([10]).position, atol=2e-8)
    np.testing.assert_array_equal(alone.force, whole.select([10]).force)
    assert alone.trials["condition"].tolist() == [whole.trials["condition"][10]]
    (folder / "01_03_02.c3d").rename(folder / "mine.c3d")
    np.testing.assert_array_equal(read(folder / "mine.c3d").force, alone.force)


def test_a_single_trial_without_it_says_what_is_missing(lab, exams, tmp_path, capsys):
    folder = exams.folder(tmp_path, lab(1))
    (folder / "common.c3d").unlink()
    for options in ([], ["--force-by", "limb"]):
        call = ["convert", str(folder / "01_01_01.c3d"), str(tmp_path / "out"), *options]
        assert main(call) == 2
        told = capsys.readouterr().err
        assert "common.c3d" in told
        assert "beside it" in told
    assert not (tmp_path / "out").exists()
    with pytest.raises(InputError, match="no common"):
        read(folder)


def test_what_trials_share_is_no_trial(lab, exams, tmp_path):
    with pytest.raises(InputError, match="no trial"):
        read(exams.folder(tmp_path, lab(1)) / "common.c3d")


# ---- whose force ---------------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("version", ["KINARM_EP_Rev1", "KINARM_H_R_002"])
def test_the_links_equations_are_those_of_their_bodies(exams, side, version):
    """Against d'Alembert's principle; the differences there are good to 1e-4 of the torques."""
    behind = 0.4 if version.startswith("KINARM_H") else 0.0
    made = exams.Robot(
        version, lengths=bench.LENGTHS, inertias=bench.INERTIAS | {"L2_L5_ANGLE": behind}
    )
    common = parse_c3d(exams.files([], made)["common.c3d"], "common.c3d")
    inertias = link_inertias(common, robot_of(common, side))
    t = np.arange(1000) / 1000
    phase = np.array([[0.3, 1.1]])
    links = [0.9, 2.0] + 0.3 * np.sin(9 * t[:, None] + phase)
    speed, rise = 2.7 * np.cos(9 * t[:, None] + phase), -24.3 * np.sin(9 * t[:, None] + phase)
    expected = bench.dalembert(links, -1.0 if side == "left" else 1.0, behind)
    inside = slice(10, -10)
    np.testing.assert_allclose(
        inertias.torque(links, speed, rise)[inside], expected[inside], atol=1e-4 * expected.std()
    )


@pytest.mark.parametrize("told", ["limb", "device"])
@pytest.mark.parametrize("held", ["limb", "device"])
def test_what_is_told_is_held_against_the_robot(lab, exams, tmp_path, capsys, told, held):
    exam = exams.folder(tmp_path / "exam", lab(16, force_by=held))
    call = ["convert", str(exam), str(tmp_path / "session"), "--force-by", told]
    assert main(call) == 0
    warned = capsys.readouterr().err
    recording = read(exam, force_by=told)
    assert ("force sign: told by the" in warned) == (told != held)
    assert finding(recording, "force sign").verdict == ("ok" if told == held else "warning")
    assert any(f.name == "force sign" for f in inspect(exam, force_by=told).checks)
    # What was told holds.
    first = recording.force[150] @ read(exam).force[150]
    assert (first > 0) == (told == held)


@pytest.mark.parametrize("unit_n", [9.80665, 1e-3])
@pytest.mark.parametrize("force_by", ["limb", "device"])
def test_a_force_in_another_unit_is_named(lab, exams, tmp_path, unit_n, force_by):
    recording = read(exams.folder(tmp_path, lab(16, force_by=force_by, unit_n=unit_n)))
    scale = finding(recording, "force scale")
    assert scale.verdict == "warning"
    assert f"{unit_n:.2g}"[:3] in scale.message
    assert f"by the {force_by}" in finding(recording, "force sign").message


@pytest.mark.parametrize("axes", [[[0, 1], [1, 0]], [[1, 0], [0, -1]], [[0, -1], [1, 0]]])
def test_a_sensor_with_other_axes_is_named(lab, exams, pushes, tmp_path, axes):
    changes = {n: {"forces": pushes[n - 1].force @ np.array(axes).T} for n in range(1, 9)}
    folder = exams.folder(tmp_path, lab(8, changes=changes))
    with pytest.raises(InputError, match="axes"):
        read(folder)
    message = finding(read(folder, force_by="limb"), "force axes").message
    told = np.array(re.findall(r"([+-]\d\.\d\d) [XY]", message), dtype=float).reshape(2, 2)
    # The hand's force is the inverse of what was done to it; friction is no part of the fit.
    np.testing.assert_allclose(told, np.array(axes).T, atol=0.03)


CANNOT = {
    "inertias": ({"inertias": {}}, {}),
    "were not recorded": ({}, {"motors": None}),
    "zero throughout": ({}, {"motors": np.zeros((500, 2))}),
    "moves for 0 s": ({}, {"links": np.tile([0.9, 2.3], (500, 1))}),
}


@pytest.mark.parametrize("reason", CANNOT)
def test_where_it_cannot_be_told_it_is_asked_for(lab, exams, tmp_path, reason):
    robot, fields = CANNOT[reason]
    files = lab(8, changes=dict.fromkeys(range(1, 9), fields), **robot)
    folder = exams.folder(tmp_path, files)
    with pytest.raises(InputError, match=reason) as caught:
        read(folder)
    assert "--force-by" in str(caught.value)
    assert finding(read(folder, force_by="limb"), "force sign").verdict == "cannot tell"


def test_short_trials_and_a_robot_of_two_links_suffice(lab, exams, pushes, tmp_path):
    """Crank, bar and motors are not in the file; trials last .15 s."""
    part = slice(150, 300)
    changes = {
        n: {
            "samples": 150,
            "links": pushes[(n - 1) % 8].links[part],
            "forces": -pushes[(n - 1) % 8].force[part],
            "motors": pushes[(n - 1) % 8].motors[part],
            "events": (),
        }
        for n in range(1, 17)
    }
    two = {name: value for name, value in bench.INERTIAS.items() if name[:2] in ("L1", "L2")}
    recording = read(exams.folder(tmp_path, lab(16, changes=changes, inertias=two)))
    assert "by the device" in finding(recording, "force sign").message


def test_noise_is_nobodys_force(lab, exams, pushes, tmp_path):
    rng = np.random.default_rng(5)
    changes = {n: {"forces": rng.normal(0, 20, (500, 2))} for n in range(1, 9)}
    with pytest.raises(InputError, match="balance"):
        read(exams.folder(tmp_path, lab(8, changes=changes)))


def test_a_left_robot_turns_the_other_way(exams, tmp_path):
    """The mirror image of a right robot: angles pi - a, torques and x turned."""
    trials = []
    for number in range(1, 9):
        made = bench.push(number)
        mirrored = {
            "links": np.pi - made.links,
            "forces": made.force * [-1, 1],
            "motors": -made.motors,
        }
        trials.append(bench.trial_of(exams, number, made, side="Left", **mirrored))
    shoulder = (-bench.SHOULDER[0], bench.SHOULDER[1])
    files = exams.files(trials, bench.robot_of(exams, shoulder=shoulder))
    recording = read(exams.folder(tmp_path, files))
    evidence = finding(recording, "force sign").message
    assert evidence.startswith("by the limb: inertial torque = 1.00 motors + 1.00 J^T F on link 1")


# ---- the handle ----------------------------------------------------------------------------------


def test_a_handle_off_its_link_is_fitted(exams, tmp_path):
    handle = (0.0021, 0.0007)
    trials = [
        bench.trial_of(exams, n, bench.push(n, handle=handle, amplitude=0.02)) for n in (1, 2, 3)
    ]
    files = exams.files(trials, bench.robot_of(exams, handle))
    recording = read(exams.folder(tmp_path, files), force_by="limb")
    hand = bench.places(np.concatenate([t.links for t in trials]), handle)
    np.testing.assert_allclose(recording.position, hand, atol=2e-7)
    assert any(
        "0.700 mm across link 2" in s and "2.100 mm beyond" in s for s in recording.provenance
    )


# ---- tables, conditions, choices -----------------------------------------------------------------


def test_tables_become_columns(lab, exams, tmp_path):
    trials = read(exams.folder(tmp_path, lab(16))).trials
    around = np.arange(16) % 8
    np.testing.assert_allclose(trials["direction_deg"], 45.0 * around, atol=1e-3)
    place = CENTRE + 0.1 * bench.unit(np.pi / 4 * around)
    np.testing.assert_allclose(trials[["end_target_x_m", "end_target_y_m"]], place, atol=1e-8)
    assert trials["condition"][2] == "TP_3 target 10 cm at 90 deg load 8 N at 90 deg"
    assert trials["tp_start_target"].unique().tolist() == [9.0]
    # Single precision is read as the decimal that it stands for.
    assert trials["tp_delay"].unique().tolist() == [0.665]
    assert trials["event_PERT_ON_s"].unique().tolist() == [0.1]
    assert trials["load_force_x"][0] == 8.0
    assert "target_on_time_x_m" not in trials


def test_without_loads_the_direction_is_that_of_the_targets(lab, exams, c3d, tmp_path):
    tables = bench.tables_of(c3d)
    del tables["LOAD_TABLE"]
    trials = read(exams.folder(tmp_path, lab(8, tables=tables))).trials
    np.testing.assert_allclose(trials["direction_deg"], 45.0 * np.arange(8), atol=1e-3)


@pytest.mark.parametrize("source", ["LOAD", "END_TARGET"])
def test_protocols_that_differ_in_direction_only_are_one_condition(
    lab, exams, c3d, tmp_path, source
):
    tables = bench.tables_of(c3d)
    del tables["TP_TABLE"]["LOAD" if source == "END_TARGET" else "END_TARGET"]
    folder = exams.folder(tmp_path / "one", lab(16, tables=tables))
    assert read(folder).trials["condition"].unique().tolist() == ["TP_1 to TP_8"]
    # A condition keeps its name whichever of its trials are chosen.
    assert read(folder, protocols=(3,)).trials["condition"].unique().tolist() == ["TP_1 to TP_8"]
    # Another setting that differs makes two of them.
    delay = [0.1] * 4 + [0.665] * 4 + [0.0] * 92
    tables["TP_TABLE"]["DELAY"] = c3d.floats(*delay)
    recording = read(exams.folder(tmp_path / "two", lab(16, tables=tables)))
    assert sorted(recording.trials["condition"].unique()) == ["delay 0.1", "delay 0.665"]
    assert any("differ in direction only" in sentence for sentence in recording.provenance)
    np.testing.assert_allclose(
        recording.trials["direction_deg"][:8], 45.0 * np.arange(8), atol=1e-3
    )


@pytest.mark.parametrize("by", [[], ["--by", "tp_start_target"]])
def test_an_exam_with_its_tables_goes_through_to_an_estimate(lab, exams, c3d, tmp_path, by):
    """The limb that was pushed comes back, from one call of convert and one of estimate."""
    tables = bench.tables_of(c3d)
    if not by:
        del tables["TP_TABLE"]["END_TARGET"]
    files = lab(24, tables=tables, force_by="device", noise_n=0.02, changes={5: EMPTY})
    exam, session = exams.zip(tmp_path / "exam.zip", files), tmp_path / "session"
    events = ["--onset-event", "PERT_ON", "--end-event", "PERT_OFF"]
    assert main(["convert", str(exam), str(session), *events]) == 0
    assert main(["estimate", str(session), "--out", str(tmp_path / "hand.csv"), *by]) == 0
    (made,) = read_results(tmp_path / "hand.csv")
    matrices = (made.inertia_with_handle, made.viscosity, made.stiffness)
    for found, true in zip(matrices, bench.LIMB, strict=True):
        assert np.linalg.norm(found - true) < 0.02 * np.linalg.norm(true)


def test_a_direction_that_some_trials_lack_is_no_column(lab, exams, tmp_path):
    files = lab(9, changes={9: {"name": "01_09_01.c3d"}})
    recording = read(exams.folder(tmp_path, files))
    assert "direction_deg" not in recording.trials
    assert any("No direction_deg" in s and "trials 9" in s for s in recording.provenance)


def test_the_row_that_a_trial_states_counts_before_its_name(lab, exams, tmp_path):
    trials = read(exams.folder(tmp_path, lab(8, changes={2: {"tp_row": 5}}))).trials
    assert trials["protocol"].tolist() == [1, 5, *range(3, 9)]
    assert trials["direction_deg"][1] == 180.0


def test_trials_can_be_chosen(lab, exams, tmp_path, capsys):
    changes = {3: {"is_error": 1}, 11: {"events": (("PERT_ON", 0.1),)}}
    exam = exams.zip(tmp_path / "exam.zip", lab(24, changes=changes))
    assert read(exam, protocols=(3,)).trials["trial"].tolist() == [3, 11, 19]
    assert read(exam, protocols=(3,), without_errors=True).trials["trial"].tolist() == [11, 19]
    options = ["--protocol", "3", "--protocol", "4", "--event", "PERT_OFF", "--without-errors"]
    assert main(["convert", str(exam), str(tmp_path / "session"), *options]) == 0
    chosen = read(tmp_path / "session")
    assert chosen.trials["trial"].tolist() == [4, 12, 19, 20]
    assert "Left out, marked as errors: trials 3." in chosen.provenance
    assert main(["inspect", str(exam), "--protocol", "9"]) == 2
    assert "no trial of protocol 9 (expected one of 1, 2, 3" in capsys.readouterr().err
    with pytest.raises(InputError, match="no trial is left of those asked for"):
        read(
            exams.zip(tmp_path / "one.zip", lab(3, changes=changes)),
            protocols=(3,),
            without_errors=True,
        )
