"""From a simulated therapy session to the patient's contribution, as a user calls the commands."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pandas as pd
import pytest
from therapy_sessions import RESTLESS, SEED

import manipulandum_sim.therapy as rig
from armimpedance.__main__ import main
from armimpedance.joint.therapy.show.contributions import SAMPLE_COLUMNS
from armimpedance.joint.therapy.show.models_json import read_arm, read_robot
from manipulandum_sim.therapy.truth import TherapyTruth

pytestmark = pytest.mark.study

#: Columns of RESULT.csv, in their order.
COLUMNS = (
    *("trial", "condition", "movement", "axis", "n_samples", "duration_s", "still_share"),
    *("share_percent", "sd_share", "ci_low_share", "ci_high_share", "share_valid"),
    *("robot_inertia_percent",),
    *("projection_percent", "sd_projection", "ci_low_projection", "ci_high_projection"),
    *("projection_valid", "ratio_percent", "sd_ratio", "ci_low_ratio", "ci_high_ratio"),
    *("ratio_valid", "sum_ratio", "ratio_all_samples_percent"),
    *("reference_percent", "sd_reference", "reference_valid"),
    *("mean_support_Nm", "mean_arm_Nm", "mean_reference_Nm"),
    *("lowering_share", "saturated_share"),
    *(f"variance_from_{part}" for part in ("robot", "mass", "elastic", "between", "noise")),
    "notes",
)


def call(*arguments):
    assert main([str(a) for a in arguments]) == 0


@pytest.fixture(scope="module")
def folder(tmp_path_factory, therapy_calibration, therapy_alone):
    """Two simulated recordings, the robot and the arm that were identified from them."""
    home = tmp_path_factory.mktemp("therapy")

    def session(*, subject, seed, **_):
        assert (subject, seed) == (RESTLESS, SEED)
        return therapy_alone

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rig, "simulate_calibration", lambda **_: therapy_calibration)
        patch.setattr(rig, "simulate_therapy", session)
        call("simulate", "therapy-calibration", "--out", home / "calibration")
        call(
            "simulate",
            "therapy",
            *("--subject", RESTLESS),
            "--seed",
            SEED,
            *("--out", home / "session"),
        )
    drawings = home / "calibration" / "drawings.json"
    robot = home / "robot.json"
    call("therapy", "robot", home / "calibration", "--drawings", drawings, "--out", robot)
    call("therapy", "arm", home / "session", "--robot", robot, "--out", home / "arm.json")
    return home


def contribution(folder, *options):
    known = ("--robot", folder / "robot.json", "--arm", folder / "arm.json")
    call("therapy", "contribution", folder / "session", *known, *options)


def table(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def results(folder):
    """RESULT.csv, SAMPLES.csv."""
    out, samples = folder / "result.csv", folder / "samples.csv"
    contribution(folder, "--out", out, "--samples", samples)
    return table(out), table(samples)


def test_simulated_folders_hold_recording_drawings_and_truth(folder):
    for name in ("calibration", "session"):
        found = {path.name for path in (folder / name).iterdir()}
        assert found == {
            *("recording.json", "trials.csv", "samples.parquet", "drawings.json", "truth.json")
        }
        assert read_robot(folder / name / "drawings.json").loads is None
    truth = TherapyTruth.read(folder / "session" / "truth.json")
    assert truth.subject == RESTLESS
    assert truth.n_trials == 12


@pytest.mark.parametrize("name", ["calibration", "session"])
def test_inspect_calls_them_usable(folder, name, capsys):
    call("inspect", folder / name)
    said = capsys.readouterr().out
    assert "`therapy robot`, `arm` and `contribution` take such a recording" in said
    # axes that are held stay within their encoders' steps, which is no fault
    assert re.search("^Usable$", said, re.MULTILINE)


@pytest.mark.parametrize("name", ["robot", "arm"])
def test_files_hold_what_every_fit_says_of_itself(folder, name):
    content = json.loads((folder / f"{name}.json").read_text())
    kinds = {"method": str, "n": int, "cond_raw": float, "cond_scaled": float, "rank": int}
    kinds |= {"r2": float, "vaf": float, "warnings": list, "parameters": list}
    assert {key: type(content[key]) for key in kinds} == kinds
    fields = {"name", "joint", "value", "sd", "sd_robust", "ci95", "rel_sd_percent"}
    fields |= {"well_identified", "unit"}
    for parameter in content["parameters"]:
        assert set(parameter) == fields
        low, high = parameter["ci95"]
        if parameter["value"] is not None:
            assert low < parameter["value"] < high
            assert parameter["sd_robust"] > 0
        else:
            assert low is high is None


def test_robot_and_arm_are_read_back(folder):
    robot, arm = read_robot(folder / "robot.json"), read_arm(folder / "arm.json")
    content = json.loads((folder / "robot.json").read_text())
    coulomb = [p["value"] for p in content["parameters"] if p["name"] == "tau_c"]
    np.testing.assert_array_equal(robot.identified.term("coulomb"), coulomb)
    assert (arm.subject, arm.robot) == (RESTLESS, robot.name)
    assert [(e.axis, e.repeatable) for e in arm.elastic] == [
        ("elevation", True),
        ("horizontal", False),
    ]


def test_what_is_printed_fits_a_terminal_and_a_reader(folder, capsys):
    drawings = folder / "calibration" / "drawings.json"
    call("therapy", "robot", folder / "calibration", "--drawings", drawings)
    call("therapy", "arm", folder / "session", "--robot", folder / "robot.json")
    contribution(folder)
    lines = capsys.readouterr().out.splitlines()
    assert not [line for line in lines if "nan" in line or re.search(r"\de[+-]\d", line)]
    assert max(map(len, lines)) <= 100


def test_rows_and_columns_of_the_results(results):
    rows, samples = results
    assert tuple(rows[0]) == COLUMNS
    assert tuple(samples[0]) == SAMPLE_COLUMNS
    conditions = [row["condition"] for row in rows]
    assert conditions == 3 * ["passive"] + 3 * ["half_active"]
    for row in rows:
        assert row["axis"] == "elevation"
        for name in ("share", "projection", "ratio"):
            low, value, high = (
                float(row[key]) for key in (f"ci_low_{name}", f"{name}_percent", f"ci_high_{name}")
            )
            assert low < value < high
            assert row[f"{name}_valid"] == "True"


def test_samples_add_up_to_the_results(results):
    rows, samples = results
    for row in rows:
        own = [s for s in samples if s["trial"] == row["trial"]]
        counted = [s for s in own if s["counts"] == "True"]
        assert len(counted) == int(row["n_samples"])
        assert 1 - len(counted) / len(own) == pytest.approx(float(row["still_share"]), abs=1e-9)
        user, arm, motor, robot = (
            np.array([float(s[f"tau_{name}_Nm"]) for s in counted])
            for name in ("user", "arm", "motor", "robot")
        )
        # ten digits are written
        np.testing.assert_allclose(robot + arm, motor + user, atol=1e-7)
        assert 100 * user.sum() / arm.sum() == pytest.approx(float(row["ratio_percent"]), rel=1e-7)
        projection = 100 * (user @ arm) / (arm @ arm)
        assert projection == pytest.approx(float(row["projection_percent"]), rel=1e-7)
        support = (arm - user).mean()
        assert support == pytest.approx(float(row["mean_support_Nm"]), rel=1e-7, abs=1e-7)
        each = np.array([float(s["contribution_percent"]) for s in counted])
        np.testing.assert_allclose(each, 100 * user / arm, rtol=1e-6, atol=1e-6)


def test_conditions_come_out_as_what_they_are(folder, results):
    truth = TherapyTruth.read(folder / "session" / "truth.json")
    for row in results[0]:
        true, off = truth.contribution[int(row["trial"]) - 1], 4 * float(row["sd_ratio"])
        # of those samples from onset to end that move; four standard errors
        assert abs(float(row["ratio_all_samples_percent"]) - true) < off


def test_an_axis_that_did_not_repeat_is_left_out_with_a_sentence(folder, results, tmp_path, capsys):
    capsys.readouterr()
    contribution(folder)
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("left out: ") == 1
    for word in ("axis horizontal", "too different", "N m (rms); --unrepeatable goes on"):
        assert word in said.split("left out: ")[1]
    contribution(folder, "--unrepeatable", "--out", tmp_path / "all.csv")
    assert "left out" not in capsys.readouterr().out
    rows = table(tmp_path / "all.csv")
    assert [row["axis"] for row in rows] == 6 * ["elevation"] + 6 * ["horizontal"]
    assert rows[:6] == results[0]


def test_nothing_but_such_an_axis_is_refused(folder, refusal, tmp_path):
    from armimpedance.recordings.tables.folder import read_folder, write_folder

    recording = read_folder(folder / "session")
    rows = (recording.trials["movement"] == "horizontal").to_numpy()
    write_folder(recording.select(rows), tmp_path / "horizontal")
    known = ("--robot", folder / "robot.json", "--arm", folder / "arm.json")
    said = refusal(
        "therapy", "contribution", tmp_path / "horizontal", *known, "--out", "result.csv"
    )
    for word in (str(folder / "arm.json"), "axis horizontal", "--unrepeatable to go on"):
        assert word in said


def test_the_live_form_says_the_same(folder, capsys):
    capsys.readouterr()
    contribution(folder, "--condition", "passive", "--live")
    printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 100
    (said,) = re.findall(r"live: .*", " ".join(printed.split()))
    (largest,) = re.findall(r"at most (\S+) from the results in one piece", said)
    assert float(largest) <= 1e-9
    assert said.endswith("the same flags")


def test_one_condition_gives_its_rows_and_again_the_same_bytes(folder, results, tmp_path):
    once, again = tmp_path / "once.csv", tmp_path / "again.csv"
    for path in (once, again):
        contribution(folder, "--condition", "half_active", "--out", path)
    assert table(once) == results[0][3:6]
    assert once.read_bytes() == again.read_bytes()
    assert set(tmp_path.iterdir()) == {once, again}


def test_other_endings_hold_the_same_table(folder, results, tmp_path):
    for name in ("result.json", "result.parquet"):
        contribution(folder, "--condition", "half_active", "--out", tmp_path / name)
    rows = json.loads((tmp_path / "result.json").read_text())
    again = pd.read_parquet(tmp_path / "result.parquet")
    assert tuple(rows[0]) == tuple(again.columns) == COLUMNS
    assert again["share_percent"].tolist() == [row["share_percent"] for row in rows]
    for row, written in zip(rows, results[0][3:6], strict=True):
        assert f"{row['share_percent']:.10g}" == written["share_percent"]


def test_figures_are_drawn_where_they_were_asked_for(folder, tmp_path):
    contribution(folder, "--condition", "half_active", "--figure", tmp_path / "movements.png")
    robot = ("--robot", folder / "robot.json")
    call("therapy", "arm", folder / "session", *robot, "--figure", tmp_path / "passive.svg")
    assert (tmp_path / "movements.png").read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in (tmp_path / "passive.svg").read_bytes()
    # and the caption of each beside it
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".svg", ".txt"}
    assert len(list(tmp_path.iterdir())) == 4
