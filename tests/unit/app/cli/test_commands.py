"""The commands as a user calls them: what they print, write, and refuse."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armimpedance.__main__ import main
from armimpedance.hand.show import read_results
from armimpedance.recordings.tables.folder import write_folder


@pytest.fixture(scope="module")
def session(limb, tmp_path_factory):
    """A small recording on disk, as CSV, so that tests can damage single cells."""
    folder = tmp_path_factory.mktemp("lab") / "session"
    recording = limb.record(
        sets=2,
        force_noise=0.02,
        shoulder_m=np.zeros(2),
        subject=subject(),
    )
    recording = recording.with_step("moved into reach", position=recording.position - [0.4, -0.1])
    write_folder(recording, folder, table="csv")
    return folder


def subject():
    from armimpedance.core.records import Subject

    return Subject("S", 65.0, 1.70, 0.30, 0.34)


@pytest.fixture
def copy(session, tmp_path):
    """A copy of the session to damage."""
    return Path(shutil.copytree(session, tmp_path / "session"))


def refused(capsys, *arguments):
    """The one line on stderr of a call that must exit with 2."""
    with_code = None
    try:
        with_code = main([str(a) for a in arguments])
    except SystemExit as end:
        with_code = end.code
    captured = capsys.readouterr()
    assert with_code == 2, captured.err
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1, captured.err
    return lines[0]


def test_estimate_writes_what_it_prints(session, tmp_path, capsys):
    out = tmp_path / "hand.csv"
    assert main(["estimate", str(session), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "Stiffness K (N/m)" in printed
    table = pd.read_csv(out, keep_default_na=False)
    assert len(table) == 1
    assert table["condition"][0] == "c"
    assert table["n_trials"][0] == 16
    for column in ("K_11", "sd_K_12", "ci_low_K_22", "K_orientation_deg", "multiple_correlation"):
        assert np.isfinite(float(table[column][0])), column


def test_json_holds_the_same(session, tmp_path, capsys):
    csv, as_json = tmp_path / "a.csv", tmp_path / "a.json"
    main(["estimate", str(session), "--out", str(csv)])
    main(["estimate", str(session), "--out", str(as_json), "--format", "json"])
    row = json.loads(as_json.read_text())[0]
    assert np.ravel(row["K"])[0] == pytest.approx(float(pd.read_csv(csv)["K_11"][0]))


def test_several_recordings_keep_apart(session, copy, tmp_path, capsys):
    other = copy.rename(copy.with_name("tuesday"))
    out = tmp_path / "both.csv"
    assert main(["estimate", str(session), str(other), "--out", str(out)]) == 0
    assert pd.read_csv(out)["recording"].tolist() == ["session", "tuesday"]


def test_map_to_the_joints_and_without_force_term(session, tmp_path, capsys):
    hand, joint, bare = (tmp_path / f"{n}.csv" for n in ("hand", "joint", "bare"))
    main(["estimate", str(session), "--out", str(hand)])
    call = ["map", str(hand), "--recording", str(session), "--to", "joint", "--out"]
    assert main([*call, str(joint)]) == 0
    assert main([*call, str(bare), "--no-force-term"]) == 0
    (with_term,), (without,) = read_results(joint), read_results(bare)
    assert with_term.level == "joint"
    assert with_term.joint_angles is not None
    # The difference is Gamma of the mean force, small here as the hand bears almost none.
    assert 0 < np.abs(with_term.stiffness - without.stiffness).max() < 0.5


def test_inspect_says_what_is_there(session, capsys):
    assert main(["inspect", str(session)]) == 0
    printed = capsys.readouterr().out
    assert "16 trials, 1 condition," in printed
    assert "handle_mass_kg" in printed
    assert "STOP" not in printed


def test_inspect_stops_at_a_turned_sensor(copy, capsys):
    settings = json.loads((copy / "recording.json").read_text())
    settings["force_by"] = "device"
    (copy / "recording.json").write_text(json.dumps(settings))
    assert "force sign" in refused(capsys, "inspect", copy)


def test_convert_between_tables(session, tmp_path, capsys):
    out = tmp_path / "parquet"
    assert main(["convert", str(session), str(out)]) == 0
    assert (out / "samples.parquet").exists()
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    main(["estimate", str(session), "--out", str(first)])
    main(["estimate", str(out), "--out", str(second)])
    assert pd.read_csv(first)["K_11"][0] == pd.read_csv(second)["K_11"][0]


def test_convert_replaces_a_recording_only_where_it_is_told_to(session, tmp_path, capsys):
    out = tmp_path / "copy"
    call = ["convert", str(session), str(out)]
    assert main(call) == 0
    assert "exists already" in refused(capsys, *call, "--table", "csv")
    assert (out / "samples.parquet").exists()
    assert main([*call, "--table", "csv", "--replace"]) == 0
    assert not (out / "samples.parquet").exists()
    assert "is read and written" in refused(capsys, "convert", out, out, "--replace")
    (out / "notes.txt").write_text("mine")
    assert "notes.txt" in refused(capsys, *call, "--replace")


def test_convert_takes_what_the_files_do_not_say(session, tmp_path, capsys):
    out = tmp_path / "stated"
    call = ["convert", str(session), str(out), "--handle-mass-kg", "0.2", "--upper-arm-m", "0.31"]
    assert main([*call, "--shoulder-m", "0.1", "-0.2"]) == 0
    stated = json.loads((out / "recording.json").read_text())
    assert stated["handle_mass_kg"] == 0.2
    assert stated["shoulder_m"] == [0.1, -0.2]
    assert stated["subject"]["upper_arm_m"] == 0.31
    assert stated["subject"]["forearm_hand_m"] == 0.34
    assert "mass between sensor and hand 0.2 kg" in capsys.readouterr().out
    refused(capsys, "convert", session, tmp_path / "no", "--upper-arm-m", "-0.3")
    refused(capsys, "convert", session, tmp_path / "no", "--handle-mass-kg", "-1")
    assert not (tmp_path / "no").exists()


@pytest.mark.study
def test_simulate_writes_recording_and_truth_and_replaces_them_when_told_to(tmp_path, capsys):
    out = tmp_path / "new" / "session"
    call = ["simulate", "cocontraction", "--sets", "1", "--noise", "sensor", "--out", str(out)]
    assert main(call) == 0
    assert "--replace" in refused(capsys, *call)
    assert main([*call, "--replace"]) == 0
    truth = json.loads((out / "truth.json").read_text())
    assert len(truth["conditions"]) == 7
    assert main(["inspect", str(out)]) == 0


def damage_samples(folder, row, column, text):
    """Replace one cell; `row` as an editor counts lines."""
    path = folder / "samples.csv"
    lines = path.read_text().splitlines()
    cells = lines[row - 1].split(",")
    cells[lines[0].split(",").index(column)] = text
    lines[row - 1] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("text", ["", "nan", "inf", "abc"])
def test_a_bad_cell_is_named(copy, tmp_path, capsys, text):
    damage_samples(copy, 57, "fx_N", text)
    out = tmp_path / "out.csv"
    line = refused(capsys, "estimate", copy, "--out", out)
    assert "samples.csv, row 57, column fx_N" in line
    assert not out.exists()


def test_time_running_back_is_named(copy, tmp_path, capsys):
    damage_samples(copy, 57, "time_s", "0.001")
    line = refused(capsys, "estimate", copy, "--out", tmp_path / "o.csv")
    assert "row 57, column time_s" in line


def change_trials(folder, **columns):
    path = folder / "trials.csv"
    table = pd.read_csv(path)
    for name, values in columns.items():
        if values is None:
            table = table.drop(columns=name)
        else:
            table[name] = values
    table.to_csv(path, index=False)


def change_settings(folder, **fields):
    path = folder / "recording.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


DAMAGE = {
    "no trials.csv": (lambda f: (f / "trials.csv").unlink(), "trials.csv"),
    "empty samples.csv": (lambda f: (f / "samples.csv").write_text(""), "samples.csv"),
    "broken JSON": (lambda f: (f / "recording.json").write_text("{"), "recording.json"),
    "unknown kind": (lambda f: change_settings(f, kind="foot"), "kind"),
    "missing column": (lambda f: change_trials(f, condition=None), "condition"),
    "twice the same trial": (lambda f: change_trials(f, trial=[1, 1, *range(3, 17)]), "trial"),
    "a trial without samples": (lambda f: change_trials(f, trial=[99, *range(2, 17)]), "99"),
    "onset outside": (lambda f: change_trials(f, onset_s=7.0), "onset_s"),
    "another rate": (lambda f: change_settings(f, sample_rate_hz=500), "time_s"),
}


@pytest.mark.parametrize(("damage", "names"), DAMAGE.values(), ids=DAMAGE)
def test_bad_recordings_are_one_line_and_nothing_is_written(copy, tmp_path, capsys, damage, names):
    damage(copy)
    out = tmp_path / "out.csv"
    line = refused(capsys, "estimate", copy, "--out", out)
    assert names in line
    assert not out.exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["session"]


def test_millimetres_given_as_metres(copy, tmp_path, capsys):
    table = pd.read_csv(copy / "samples.csv")
    table[["x_m", "y_m"]] *= 1000
    table.to_csv(copy / "samples.csv", index=False)
    assert "millimetres" in refused(capsys, "estimate", copy, "--out", tmp_path / "o.csv")


def test_one_direction_only_says_which(limb, tmp_path, capsys):
    write_folder(limb.record(directions=1, sets=8), tmp_path / "line", table="parquet")
    line = refused(capsys, "estimate", tmp_path / "line", "--out", tmp_path / "o.csv")
    assert "one direction only (1.00, 0.00)" in line or "(-1.00, " in line
    assert f"{tmp_path / 'line'}: directions: condition c" in line


def test_no_movement(limb, tmp_path, capsys):
    write_folder(limb.record(sets=1, amplitude=0.0), tmp_path / "still", table="parquet")
    assert "no movement" in refused(capsys, "estimate", tmp_path / "still")


@pytest.mark.parametrize(
    "arguments",
    [
        ["estimate", "nowhere"],
        ["estimate", "SESSION", "--method", "magic"],
        ["estimate", "SESSION", "--by", "posture"],
        ["estimate", "SESSION", "--by", "K_11"],
        ["estimate", "SESSION", "--by", "q_shoulder_rad"],
        ["estimate", "SESSION", "--out", "no/such/folder/x.csv"],
        ["map", "nowhere.csv", "--recording", "SESSION", "--to", "joint", "--out", "x.csv"],
        ["simulate", "dancing", "--out", "x"],
        ["simulate", "force", "--subject", "Z", "--out", "x"],
        ["simulate", "force", "--servo", "soft", "--out", "x"],
        ["simulate", "force", "--sets", "0", "--out", "x"],
        ["figures", "--only", "fig99", "--out", "x"],
        ["convert", "SESSION", "x", "--emg", "ACH0"],
        ["fly"],
        [],
    ],
    ids=" ".join,
)
def test_wrong_calls_are_one_line_and_write_nothing(
    arguments, session, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    refused(capsys, *[str(session) if a == "SESSION" else a for a in arguments])
    assert list(tmp_path.iterdir()) == []


def test_help_of_every_command_has_an_example(capsys):
    from armimpedance.app.cli.main import COMMANDS

    for name in COMMANDS:
        with pytest.raises(SystemExit):
            main([name, "--help"])
        assert f"armimpedance {name}" in capsys.readouterr().out.split("Examples")[1]


def with_the_other_sign(folder):
    table = pd.read_csv(folder / "samples.csv")
    table[["fx_N", "fy_N"]] *= -1
    table.to_csv(folder / "samples.csv", index=False)


def test_a_stop_is_one_line_that_says_how_to_go_on(copy, tmp_path, capsys):
    with_the_other_sign(copy)
    line = refused(capsys, "estimate", copy, "--out", tmp_path / "o.csv")
    assert "force sign" in line
    assert "--despite 'force sign'" in line
    assert "force sign" in refused(capsys, "reflex", copy)
    assert "force sign" in refused(capsys, "plan", "--pilot", copy)
    assert "force sign" in refused(capsys, "compare", copy, "--by", "set")


def test_despite_writes_rows_that_are_marked(copy, tmp_path, capsys):
    with_the_other_sign(copy)
    out = tmp_path / "o.csv"
    options = ["--despite", "force sign", "--out", str(out)]
    assert main(["estimate", str(copy), *options]) == 0
    capsys.readouterr()
    assert "despite force sign" in pd.read_csv(out)["warnings"].iloc[0]
    assert "no check 'sign'" in refused(capsys, "estimate", copy, "--despite", "sign")


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("armimpedance es", {"estimate"}),
        ("armimpedance passive --cut", {"--cutoff-hz"}),
        ("armimpedance passive --style ", {"print", "talk"}),
    ],
)
def test_the_shell_is_offered_what_may_follow(typed, offered, tmp_path):
    asked = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_SHELL": "bash",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(tmp_path / "words"),
        "COMP_LINE": typed,
        "COMP_POINT": str(len(typed)),
        "COMP_TYPE": "9",
    }
    done = subprocess.run([sys.executable, "-m", "armimpedance"], env={**os.environ, **asked})
    assert done.returncode == 0
    assert {word.strip() for word in (tmp_path / "words").read_text().split("\n")} == offered
