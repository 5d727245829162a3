"""A recording's folder: what is read, that it comes back bit by bit, and every way to be wrong."""

import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from hypothesis.extra import numpy as hnp

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from armimpedance.recordings.tables.folder import read_folder, write_folder


def assert_same(a: Recording, b: Recording) -> None:
    """Every field equal to the last bit, types of the trial table's columns included."""
    for field in dataclasses.fields(Recording):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if field.name == "trials":
            pd.testing.assert_frame_equal(left, right, check_exact=True)
        elif field.name == "extra":
            assert list(left) == list(right)
            assert all(left[k].tobytes() == right[k].tobytes() for k in left)
        elif isinstance(left, np.ndarray):
            assert right is not None, field.name
            assert left.shape == right.shape, field.name
            assert left.tobytes() == right.tobytes(), field.name
        else:
            assert left == right, field.name


FINITE = st.floats(-1e99, 1e99)
NAMES = st.text("abcdefg éß", min_size=1, max_size=6).filter(lambda s: s.strip() == s)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    kind = draw(st.sampled_from(["hand", "joint"]))
    axes = draw(st.integers(2, 3) if kind == "hand" else st.integers(1, 3))
    lengths = draw(st.lists(st.integers(1, 9), min_size=1, max_size=4))
    total, n = sum(lengths), len(lengths)
    rate = draw(st.sampled_from([1000.0, 2048.0, 30.0, 1234.5]))
    muscles = tuple(draw(st.lists(NAMES, unique=True, max_size=3)))
    joints = draw(st.sampled_from([None, 2, 3] if kind == "hand" else [None, 2]))

    def array(width: int, bound: float = 1.2) -> np.ndarray:
        elements = st.floats(-bound, bound)
        return draw(hnp.arrays(np.float64, (total, width), elements=elements))

    trials = {
        "trial": draw(st.lists(st.integers(-5, 10**9), min_size=n, max_size=n, unique=True)),
        "condition": draw(st.lists(NAMES, min_size=n, max_size=n)),
        "set": list(range(n)),
        "direction_deg": draw(st.lists(FINITE, min_size=n, max_size=n)),
        "target_activation": [np.nan] * (n - 1) + [0.25],
        "is_error": draw(st.lists(st.booleans(), min_size=n, max_size=n)),
        "note": ['x,"y"'] * n,
    }
    return Recording(
        kind=kind,
        sample_rate_hz=rate,
        trials=pd.DataFrame(trials).astype({"condition": "str", "note": "str"}),
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.concatenate([0.1 + np.arange(length) / rate for length in lengths]),
        position=array(axes),
        force=draw(hnp.arrays(np.float64, (total, axes), elements=FINITE)),
        joint_angles=None if joints is None else array(joints, 6.0),
        emg=draw(hnp.arrays(np.float64, (total, len(muscles)), elements=FINITE))
        if muscles
        else None,
        muscles=muscles,
        emg_unit=draw(st.sampled_from(["V", "normalised"])),
        perturbation=draw(st.sampled_from(["returning", "stochastic"])),
        torque=draw(st.sampled_from([None, "interaction", "commanded"])),
        handle_mass_kg=draw(st.floats(0, 5)),
        shoulder_m=draw(st.sampled_from([None, np.full(axes, 0.1)])),
        gravity_m_s2=draw(st.sampled_from([None, (0.0,) * (axes - 1) + (-9.81,)])),
        subject=Subject(draw(NAMES), 65.25, None, draw(st.sampled_from([None, 0.3])), 0.34),
        extra={"gaze": array(1, 9.0)[:, 0]} if draw(st.booleans()) else {},
        provenance=tuple(draw(st.lists(NAMES, max_size=2))),
    )


@settings(max_examples=25, deadline=None, suppress_health_check=list(HealthCheck))
@given(recording=recordings())
def test_round_trip_is_exact(tmp_path_factory, recording):
    place = tmp_path_factory.mktemp("round")
    for table in ("parquet", "csv"):
        write_folder(recording, place / table, table)
        assert_same(recording, read_folder(place / table))


def test_both_tables_hold_the_same(tables, tmp_path):
    tables.samples["emg_biceps"] = 0.5
    recording = read_folder(tables.write("csv"))
    for table in ("parquet", "csv"):
        write_folder(recording, tmp_path / table, table)
        assert_same(recording, read_folder(tmp_path / table))


def test_what_the_columns_mean(tables):
    tables.samples = tables.samples.assign(
        q_shoulder_rad=0.9, q_elbow_rad=1.4, emg_biceps=0.1, emg_triceps=0.2, gaze_deg=3.0, note="a"
    )
    tables.metadata |= {
        "muscles": ["triceps", "biceps"],
        "emg_unit": "normalised",
        "handle_mass_kg": 0.164,
        "shoulder_m": [0.0, 0.0],
        "subject": {"id": "A", "mass_kg": 65},
        "colour": "red",
    }
    r = read_folder(tables.write())
    assert r.offsets.tolist() == [0, 50, 100]
    np.testing.assert_array_equal(r.position[:, 0], tables.samples["x_m"])
    np.testing.assert_array_equal(r.force[:, 1], tables.samples["fy_N"])
    np.testing.assert_array_equal(r.joint_angles[0], [0.9, 1.4])
    assert r.muscles == ("triceps", "biceps")
    np.testing.assert_array_equal(r.emg[0], [0.2, 0.1])
    assert set(r.extra) == {"gaze_deg"}
    assert r.subject == Subject("A", 65.0)
    assert any("note" in s for s in r.provenance)
    assert any("colour" in s for s in r.provenance)


@pytest.mark.parametrize("table", ["csv", "parquet"])
def test_force_by_the_device_is_turned_once(tables, table, tmp_path):
    by_limb = read_folder(tables.write(table))
    tables.metadata["force_by"] = "device"
    turned = read_folder(tables.write(table))
    np.testing.assert_array_equal(turned.force, -by_limb.force)
    assert any("sign" in s for s in turned.provenance)
    write_folder(turned, tmp_path / "again", table)
    assert json.loads((tmp_path / "again" / "recording.json").read_text())["force_by"] == "limb"
    assert_same(turned, read_folder(tmp_path / "again"))


def test_trials_may_stand_in_another_order_than_their_samples(tables):
    straight = read_folder(tables.write())
    tables.trials = tables.trials.iloc[::-1]
    turned = read_folder(tables.write())
    assert turned.trials["trial"].tolist() == [2, 1]
    np.testing.assert_array_equal(turned.force[turned.samples_of(0)], straight.force[50:])
    np.testing.assert_array_equal(turned.time_s[turned.samples_of(1)], straight.time_s[:50])


def test_three_axes_and_several_joints(tables):
    tables.samples = tables.samples.assign(z_m=0.3, fz_N=1.0)
    assert read_folder(tables.write()).axes == 3
    tables.metadata["kind"] = "joint"
    tables.samples = tables.samples.rename(
        columns={"x_m": "q1_rad", "y_m": "q2_rad", "fx_N": "tau1_Nm", "fy_N": "tau2_Nm"}
    )
    recording = read_folder(tables.write())
    assert recording.axes == 2
    assert set(recording.extra) == {"z_m", "fz_N"}


# ---- time ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("rate", "decimals"), [(1000, 3), (2000, 3), (2048, 4), (30, 3), (1000, 9), (48000, 4)]
)
def test_printed_times_are_granted_their_rounding(tables, rate, decimals):
    tables.metadata["sample_rate_hz"] = rate
    tables.samples["time_s"] = np.tile(np.round(np.arange(50) / rate + 0.5, decimals), 2)
    tables.trials = tables.trials[["trial", "condition"]]
    assert read_folder(tables.write()).n_trials == 2


def test_a_quartz_clock_may_be_off_by_ppm(tables):
    tables.metadata["sample_rate_hz"] = 1000
    n = 60_000
    time = np.arange(n) / 1000 * (1 + 50e-6)
    tables.trials = tables.trials.iloc[:1]
    tables.samples = pd.DataFrame({"trial": 1, "time_s": time, "x_m": 0.0, "y_m": 0.0})
    tables.samples = tables.samples.assign(fx_N=0.0, fy_N=0.0)
    assert read_folder(tables.write("parquet")).n_trials == 1


# ---- bad input: file, row, column ---------------------------------------------------------------


def refused(path) -> InputError:
    with pytest.raises(InputError) as caught:
        read_folder(path)
    assert "\n" not in str(caught.value)
    return caught.value


def set_cell(frame: pd.DataFrame, row: int, column: str, value: object) -> pd.DataFrame:
    frame = frame.astype({column: object}) if isinstance(value, str | None) else frame.copy()
    frame.loc[row, column] = value
    return frame


@pytest.mark.parametrize("table", ["csv", "parquet"])
@pytest.mark.parametrize("column", ["x_m", "fy_N", "time_s", "trial"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite_samples(tables, table, column, value):
    tables.samples = tables.samples.astype({column: float})
    tables.samples.loc[7, column] = value
    error = refused(tables.write(table))
    assert error.file.name == f"samples.{table}"
    assert error.column == column
    # Row 7 from 0 is line 9 of a CSV file with its header, and row 8 of a Parquet table.
    assert error.row == (9 if table == "csv" else 8)


@pytest.mark.parametrize("table", ["csv", "parquet"])
def test_text_in_a_number_column(tables, table):
    tables.samples["x_m"] = tables.samples["x_m"].astype(str)
    tables.samples.loc[3, "x_m"] = "abc"
    error = refused(tables.write(table))
    assert "'abc'" in error.problem
    assert (error.row, error.column) == (5 if table == "csv" else 4, "x_m")


def test_blank_lines_do_not_shift_the_row(tables):
    path = tables.write() / "samples.csv"
    lines = path.read_text().splitlines()
    lines[8] = lines[8].replace(lines[8].split(",")[2], "oops")
    lines.insert(4, "")
    path.write_text("\n".join(lines) + "\n")
    assert refused(tables.path).row == 10


def test_error_found_after_reading_names_the_line_too(tables):
    tables.samples.loc[30, "x_m"] = 431.0
    path = tables.write() / "samples.csv"
    lines = path.read_text().splitlines()
    lines.insert(4, "")
    path.write_text("\n".join(lines) + "\n")
    error = refused(tables.path)
    assert "millimetres" in error.problem
    assert lines[error.row - 1].split(",")[2] == "431.0"


def test_a_line_with_too_few_cells(tables):
    path = tables.write() / "samples.csv"
    lines = path.read_text().splitlines()
    lines[10] = "1,0.009,0.1"
    path.write_text("\n".join(lines))
    error = refused(tables.path)
    assert error.row == 11
    assert "3 cells" in error.problem


@pytest.mark.parametrize("table", ["csv", "parquet"])
@pytest.mark.parametrize("column", ["trial", "time_s", "x_m", "y_m", "fx_N", "fy_N"])
def test_missing_sample_column(tables, table, column):
    tables.samples = tables.samples.drop(columns=column)
    error = refused(tables.write(table))
    assert error.column == column
    assert error.file.name == f"samples.{table}"


def test_half_of_the_arm_angles(tables):
    tables.samples["q_elbow_rad"] = 1.0
    assert refused(tables.write()).column == "q_shoulder_rad"


def test_muscle_without_a_column(tables):
    tables.samples["emg_biceps"] = 1.0
    tables.metadata["muscles"] = ["biceps", "triceps"]
    assert refused(tables.write()).column == "emg_triceps"


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("samples.csv", "", "empty"),
        ("samples.csv", "trial,time_s,x_m,y_m,fx_N,fy_N\n", "no samples"),
        ("samples.csv", "trial;time_s;x_m\n1;0;1\n", "commas"),
        ("samples.csv", "trial,time_s,x_m,y_m,fx_N,fy_N,x_m\n1,0,0,0,0,0,0\n", "twice"),
        ("trials.csv", "", "empty"),
        ("trials.csv", "trial,condition\n", "no trials"),
        ("trials.csv", "trial,condition,trial\n1,a,1\n", "twice"),
        ("trials.csv", "trial,condition\n1,a\n2\n", "1 cells"),
        ("trials.csv", "trial,condition\n1,a\n1,b\n", "appears twice"),
        ("trials.csv", "trial,condition\n1,\n", "empty cell"),
        ("trials.csv", "trial,condition\n1.5,a\n", "whole number"),
        ("trials.csv", "trial,condition\n,a\n", "empty cell"),
        ("trials.csv", "trial\n1\n", "no such column"),
        ("trials.csv", "condition\na\n", "no such column"),
        ("trials.csv", "trial,condition,direction_deg\n1,a,north\n", "not a finite number"),
        ("trials.csv", "trial,condition,onset_s\n1,a,nan\n", "not a finite number"),
        ("trials.csv", "trial,condition,onset_s\n1,a,\n", "empty cell"),
        ("trials.csv", "trial,condition,q_elbow_rad\n1,a,90\n", "degrees"),
        ("recording.json", "", "empty"),
        ("recording.json", "[1]", "no object"),
        ("recording.json", '{"format": NaN}', "NaN"),
        ("recording.json", '{"kind": "hand", "kind": "joint"}', "twice"),
    ],
)
def test_broken_files(tables, name, content, problem):
    (tables.write() / name).write_text(content)
    error = refused(tables.path)
    assert error.file.name == name
    assert problem in str(error)


@pytest.mark.parametrize("name", ["recording.json", "trials.csv", "samples.csv"])
def test_missing_files(tables, name):
    (tables.write() / name).unlink()
    refused(tables.path)


@pytest.mark.parametrize("name", ["recording.json", "trials.csv"])
def test_not_utf8(tables, name):
    (tables.write() / name).write_bytes("trial,condition\n1,é\n".encode("utf-16"))
    assert refused(tables.path).file.name == name


def test_no_folder(tmp_path):
    assert "no such folder" in str(refused(tmp_path / "none"))


def test_both_sample_files(tables):
    tables.write("csv")
    tables.write("parquet")
    assert "both" in str(refused(tables.path)) or "may differ" in str(refused(tables.path))


def test_truncated_parquet(tables):
    path = tables.write("parquet") / "samples.parquet"
    path.write_bytes(path.read_bytes()[:-40])
    assert refused(tables.path).file.name == "samples.parquet"


def test_broken_json_names_line_and_character(tables):
    (tables.write() / "recording.json").write_text('{\n"format": "x"\n"version": 1}')
    error = refused(tables.path)
    assert error.row == 3
    assert "character 1 " in error.problem


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("format", "other"),
        ("version", 2),
        ("version", "1"),
        ("kind", "foot"),
        ("sample_rate_hz", 0),
        ("sample_rate_hz", -1000),
        ("sample_rate_hz", "fast"),
        ("sample_rate_hz", True),
        ("sample_rate_hz", 10**300),
        ("force_by", "robot"),
        ("perturbation", "steps"),
        ("torque", "measured"),
        ("handle_mass_kg", -0.1),
        ("shoulder_m", 0),
        ("shoulder_m", [0, "a"]),
        ("shoulder_m", [0, 450]),
        ("shoulder_m", [0.0]),
        ("gravity", -9.81),
        ("gravity", [0, -9810]),
        ("gravity", [0, 0, -9.81]),
        ("subject", "A"),
        ("muscles", "biceps"),
        ("muscles", ["a", "a"]),
        ("emg_unit", "mV"),
        ("provenance", [1]),
    ],
)
def test_wrong_field(tables, key, value):
    tables.metadata[key] = value
    error = refused(tables.write())
    assert error.file.name == "recording.json"
    assert error.column == key


def test_a_number_that_no_float_holds_is_named_with_its_line(tables):
    tables.metadata["sample_rate_hz"] = 10**400
    folder = tables.write()
    error = refused(folder)
    line = (folder / "recording.json").read_text().splitlines()[error.row - 1]
    assert "sample_rate_hz" in line


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("mass_kg", "heavy"),
        ("mass_kg", -1),
        ("height_m", 175),
        ("upper_arm_m", 300),
        ("id", []),
        ("length_sd_m", 5),
        ("mass_sd_kg", -1),
    ],
)
def test_wrong_subject(tables, key, value):
    tables.metadata["subject"] = {key: value}
    assert refused(tables.write()).column == f"subject.{key}"


@pytest.mark.parametrize("key", ["format", "version", "kind", "sample_rate_hz"])
def test_missing_field(tables, key):
    del tables.metadata[key]
    error = refused(tables.write())
    assert (error.column, error.problem) == (key, "is missing")


@pytest.mark.parametrize("table", ["csv", "parquet"])
def test_time_running_back(tables, table):
    tables.samples.loc[20, "time_s"] = 0.005
    error = refused(tables.write(table))
    assert (error.row, error.column) == (22 if table == "csv" else 21, "time_s")


def test_time_standing_still(tables):
    tables.samples.loc[20, "time_s"] = tables.samples.loc[19, "time_s"]
    assert (refused(tables.write()).row) == 22


@pytest.mark.parametrize("rate", [999.0, 990, 1024, 500, 2000, 1, 100000])
def test_time_disagreeing_with_the_rate(tables, rate):
    tables.metadata["sample_rate_hz"] = rate
    tables.trials = tables.trials.iloc[:1]
    n = 3000
    time = np.arange(n) / 1000
    tables.samples = pd.DataFrame({"trial": 1, "time_s": time, "x_m": 0.0, "y_m": 0.0})
    tables.samples = tables.samples.assign(fx_N=0.0, fy_N=0.0)
    assert refused(tables.write("parquet")).column == "time_s"


def test_a_lost_sample(tables):
    tables.samples = tables.samples.drop(index=30).reset_index(drop=True)
    error = refused(tables.write("parquet"))
    assert error.row == 31
    assert "gap" in error.problem


def test_samples_as_time(tables):
    tables.samples["time_s"] = np.tile(np.arange(50.0), 2)
    assert refused(tables.write()).column == "time_s"


def test_trial_without_samples(tables):
    tables.trials.loc[2] = [3, "relaxed", 0.0, 0.01, 0.04]
    error = refused(tables.write())
    assert (error.file.name, error.row, error.column) == ("trials.csv", 4, "trial")


def test_samples_without_a_trial(tables):
    tables.trials = tables.trials.iloc[:1]
    error = refused(tables.write())
    assert (error.file.name, error.row) == ("samples.csv", 52)


def test_trial_in_two_pieces(tables):
    tables.samples.loc[90:, "trial"] = 1
    error = refused(tables.write("parquet"))
    assert (error.row, error.column) == (91, "trial")


def test_trial_number_that_is_not_whole(tables):
    tables.samples["trial"] = tables.samples["trial"].astype(float)
    tables.samples.loc[4, "trial"] = 1.5
    assert "whole" in refused(tables.write()).problem


@pytest.mark.parametrize(("column", "value"), [("onset_s", -0.01), ("onset_s", 0.5), ("end_s", 1)])
def test_onset_or_end_outside(tables, column, value):
    tables.trials[column] = tables.trials[column].astype(float)
    tables.trials.loc[1, column] = value
    error = refused(tables.write())
    assert (error.file.name, error.row, error.column) == ("trials.csv", 3, column)


def test_end_before_onset(tables):
    tables.trials.loc[1, "end_s"] = 0.01
    error = refused(tables.write())
    assert (error.row, error.column) == (3, "end_s")


@pytest.mark.parametrize("shoulder", [None, [0.0, 0.0]])
@pytest.mark.parametrize("offset_mm", [True, False])
def test_millimetres(tables, shoulder, offset_mm):
    """Given in mm, counted from the shoulder or from each disturbance's start (5 mm out)."""
    tables.metadata["shoulder_m"] = shoulder
    for column in ("x_m", "y_m"):
        metres = tables.samples[column]
        tables.samples[column] = 1000 * (metres if offset_mm else metres - metres[0])
    error = refused(tables.write())
    assert "millimetres" in error.problem
    assert error.column in ("x_m", "y_m")


@pytest.mark.parametrize("shoulder", [None, [0.0, 0.0]])
def test_millimetres_of_a_hand_that_hardly_moves(tables, shoulder):
    tables.metadata["shoulder_m"] = shoulder
    tables.samples["y_m"] = 431.0 + 100.0 * (tables.samples["y_m"] - 0.4)
    assert "millimetres" in refused(tables.write()).problem


def test_degrees(tables):
    tables.metadata["kind"] = "joint"
    tables.samples = tables.samples[["trial", "time_s"]].assign(q1_rad=90.0, tau1_Nm=1.0)
    assert "degrees" in refused(tables.write()).problem


def test_a_large_workspace_is_not_taken_for_millimetres(tables):
    tables.samples["x_m"] = np.linspace(-1.0, 1.0, 100)
    tables.samples["y_m"] += 1.5
    read = read_folder(tables.write())
    np.testing.assert_array_equal(read.position, tables.samples[["x_m", "y_m"]])


# ---- writing ------------------------------------------------------------------------------------


def test_further_column_with_a_taken_name_is_refused(tables, tmp_path):
    recording = read_folder(tables.write())
    for name in ("x_m", "z_m", "q_elbow_rad", " gaze", "trial"):
        clash = dataclasses.replace(recording, extra={name: np.zeros(100)})
        with pytest.raises(InputError) as caught:
            write_folder(clash, tmp_path / "out")
        assert caught.value.column in (name, "fz_N", "q_shoulder_rad")
        assert not (tmp_path / "out").exists()


def test_one_axis_of_a_hand_has_no_form(tables, tmp_path):
    recording = read_folder(tables.write())
    one = dataclasses.replace(
        recording, position=recording.position[:, :1], force=recording.force[:, :1]
    )
    with pytest.raises(InputError):
        write_folder(one, tmp_path / "out")
