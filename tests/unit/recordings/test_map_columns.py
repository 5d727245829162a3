"""Proposed mappings: right where names, units and data tell, and silent on nothing they cannot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from mapped_files import cells, long_table, struct_array, trials_of, write_mat73

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.recordings import open_recording, propose_mapping
from armimpedance.recordings.mapped.columns_toml import read_mapping
from armimpedance.recordings.mapped.evidence import read_name


def saved(table: pd.DataFrame, path: Path, **how: object) -> Path:
    table.to_csv(path, index=False, **how)
    return path


def renamed(recording: Recording, *names: str) -> pd.DataFrame:
    """Trial, condition, time, position, force under other names."""
    return long_table(recording).drop(columns=["onset", "end"]).set_axis(list(names), axis=1)


#: Names as labs write them -> words that the proposal must hold.
NAMES = {
    "plain": ("trial", "cond", "t", "x (m)", "y (m)", "Fx (N)", "Fy (N)"),
    "camel": ("TrialNum", "Condition", "Time_s", "HandX_m", "HandY_m", "ForceX_N", "ForceY_N"),
    "robot": ("trial", "condition", "time [s]", "Right_HandX [m]", "Right_HandY [m]",
              "Right_FS_ForceX [N]", "Right_FS_ForceY [N]"),
    "german": ("Versuch", "Bedingung", "Zeit / s", "Ort x / m", "Ort y / m", "Kraft x in N",
               "Kraft y in N"),
    "french": ("essai", "condition", "temps [s]", "position X [m]", "position Y [m]",
               "force X [N]", "force Y [N]"),
    "ros": ("trial", "type", "/clock.stamp [s]", "/ee/pose.position.x [m]",
            "/ee/pose.position.y [m]", "/ft/wrench.force.x [N]", "/ft/wrench.force.y [N]"),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_with_units_leave_only_the_force_open(
    name: str, truth: Recording, tmp_path: Path
) -> None:
    names = NAMES[name]
    path = saved(renamed(truth, *names), tmp_path / "a.csv")
    proposed = propose_mapping(path)
    proposed.place.write_text(proposed.text, encoding="utf-8")
    # Whose force it is stays open, with the line of its section.
    with pytest.raises(InputError, match=r"row \d+, column force.by"):
        read_mapping(proposed.place)
    proposed.place.write_text(proposed.text.replace('# by = "limb"', 'by = "limb"'), "utf-8")
    mapping = read_mapping(proposed.place)
    assert mapping.position.columns == names[3:5]
    assert mapping.force.columns == names[5:7]
    assert mapping.trials.column == names[0]
    assert mapping.values["condition"].column == names[1]
    read = open_recording(path)
    assert isinstance(read, Recording)
    assert read.force.tobytes() == truth.force.tobytes()
    assert read.trials["trial"].tolist() == truth.trials["trial"].tolist()


def test_without_units_the_data_tell_time_and_metres_but_not_the_force(
    truth: Recording, tmp_path: Path
) -> None:
    table = renamed(truth, "trial", "cond", "time", "x", "y", "fx", "fy")
    table["time"] *= 1000.0
    text = propose_mapping(saved(table, tmp_path / "a.csv")).text
    assert 'unit = "ms"' in text
    assert 'unit = "m"' in text
    assert 'unit = "?"' in text.partition("[force]")[2]
    slow = 100.0 * np.sin(np.arange(len(table)) / 900)
    for axis in ("x", "y"):
        table[axis] = 1000.0 * table[axis] + slow
    text = propose_mapping(saved(table, tmp_path / "a.csv")).text
    assert 'unit = "mm"' in text.partition("[position]")[2]


def test_a_span_that_can_be_cm_or_mm_is_not_decided(truth: Recording, tmp_path: Path) -> None:
    table = renamed(truth, "trial", "cond", "time", "x", "y", "fx", "fy")
    table[["x", "y"]] *= 1000.0
    proposed = propose_mapping(saved(table, tmp_path / "a.csv"))
    assert any("unit of position" in question for question in proposed.cannot_tell)
    (tmp_path / "columns.toml").write_text(proposed.text.replace('# by = "limb"', 'by = "limb"'))
    with pytest.raises(InputError, match=r"column position.unit: is not decided"):
        open_recording(tmp_path / "a.csv")


@pytest.mark.parametrize("sign", [1, -1])
def test_the_sign_of_the_force_is_evidence_never_a_decision(
    sign: int, truth: Recording, tmp_path: Path
) -> None:
    table = renamed(truth, *NAMES["plain"])
    table[["Fx (N)", "Fy (N)"]] *= sign
    proposed = propose_mapping(saved(table, tmp_path / "a.csv"))
    # The simulated manipulandum pushes: the limb's force is against the acceleration.
    speaks = "limb" if sign > 0 else "device"
    assert f'the sign of M speaks for "{speaks}"' in proposed.text
    assert "\nby = " not in proposed.text.partition("[force]")[2].partition("[trials]")[0]


def test_marks_gaps_and_single_files(truth: Recording, tmp_path: Path) -> None:
    table = renamed(truth, *NAMES["plain"]).drop(columns=["trial", "cond"])
    table["t"] += np.repeat(9.0 * np.arange(truth.n_trials), np.diff(truth.offsets))
    assert 'by = "gap"' in propose_mapping(saved(table, tmp_path / "a.csv")).text
    table["t"] = np.arange(len(table)) / 1000.0
    table["trigger"] = (np.arange(len(table)) % 1000 > 700) * 5.0
    text = propose_mapping(saved(table, tmp_path / "a.csv")).text
    assert 'by = "edge"' in text
    assert 'before_s = "?"' in text
    table = table.drop(columns="trigger")
    proposed = propose_mapping(saved(table, tmp_path / "a.csv"))
    assert any("where trials begin" in question for question in proposed.cannot_tell)
    saved(table, tmp_path / "b.csv")
    assert 'files = "*.csv"' in propose_mapping(tmp_path).text


def test_matlab_layouts(truth: Recording, tmp_path: Path) -> None:
    trials = trials_of(truth)
    scipy.io.savemat(tmp_path / "a.mat", {"trials": struct_array(trials), "fs": 1000.0})
    write_mat73(tmp_path / "b.mat", {"trials": trials, "fs": 1000.0})
    one, other = (propose_mapping(tmp_path / f"{n}.mat").text for n in "ab")
    # HDF5 sorts the fields of a struct.
    assert sorted(one.splitlines()[1:]) == sorted(other.splitlines()[1:])
    assert '["trials.pos(:,1)", "trials.pos(:,2)"]' in one
    assert 'condition = "trials.cond"' in one
    n = min(len(t["t"]) for t in trials)
    cube = {"pos": np.stack([t["pos"][:n] for t in trials])}
    cube["force"] = np.stack([t["force"][:n] for t in trials])
    scipy.io.savemat(tmp_path / "c.mat", {**cube, "Fs": 1000.0})
    text = propose_mapping(tmp_path / "c.mat").text
    assert '["pos(*,:,1)", "pos(*,:,2)"]' in text
    assert 'by = "columns"' in text
    assert "sample_rate_hz = 1000.0" in text
    scipy.io.savemat(tmp_path / "d.mat", {"a": cells([np.arange(9.0), np.arange(8.0)])})
    proposed = propose_mapping(tmp_path / "d.mat")
    assert 'kind = "?"' in proposed.text


def test_joints(tmp_path: Path) -> None:
    t = np.arange(3000) / 500.0
    table = pd.DataFrame({"t": t, "angle [deg]": 20 * np.sin(t), "torque [Nm]": np.cos(t)})
    proposed = propose_mapping(saved(table, tmp_path / "a.csv"))
    assert 'kind = "joint"' in proposed.text
    assert 'unit = "deg"' in proposed.text
    assert 'unit = "N m"' in proposed.text


def test_columns_without_a_meaning_stay_open(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    smooth = np.cumsum(rng.normal(size=(500, 2)), axis=0) / 1e3
    table = pd.DataFrame(np.column_stack([smooth, rng.normal(size=(500, 2))]))
    path = saved(table, tmp_path / "a.csv", header=False)
    proposed = propose_mapping(path)
    question = next(q for q in proposed.cannot_tell if "smooth to rough" in q)
    assert question.index("column 1") < question.index("column 3")
    assert any("sample rate" in q for q in proposed.cannot_tell)
    (tmp_path / "columns.toml").write_text(proposed.text)
    with pytest.raises(InputError, match="not decided"):
        open_recording(path)


@pytest.mark.parametrize(
    ("name", "role"),
    [
        *(("x", "position"), ("HandX", "position"), ("Fx", "force"), ("FS_ForceX", "force")),
        *(("x_vel", "other"), ("hand_velocity_x", "other"), ("target_x", "commanded")),
        *(("q_fer_joint1", "angle"), ("qd_fer_joint1", "other"), ("tau3", "torque")),
        *(("EMG_biceps", "emg"), ("Biceps", "emg"), ("sampleRate", "rate"), ("frame", "sample")),
        *(("perturb_on", "trigger"), ("trials.pos(:,1)", "position"), ("x_min", "position")),
    ],
)
def test_names(name: str, role: str) -> None:
    assert read_name(name).role == role


def test_a_file_of_labview_has_its_names_and_its_time(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    head = "LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\t\n\n"
    names = "X_Value\tPos_X\tPos_Y\tForce_X\tForce_Y\tComment\n"
    place = np.cumsum(np.cumsum(rng.normal(size=(400, 2)), axis=0), axis=0) * 1e-7
    rows = np.column_stack([np.arange(400) / 1000, place, rng.normal(size=(400, 2))])
    body = "".join("\t".join(f"{v:.9f}" for v in row) + "\n" for row in rows)
    (tmp_path / "a.lvm").write_text(head + names + body)
    text = propose_mapping(tmp_path / "a.lvm").text
    assert 'column = "X_Value"' in text
    assert '["Pos_X", "Pos_Y"]' in text
    assert '["Force_X", "Force_Y"]' in text
