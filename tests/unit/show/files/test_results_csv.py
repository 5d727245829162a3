"""RESULTS.csv: nothing is lost on the way, and what is wrong is named by file, row and column."""

import csv
import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.ellipses import ellipse_of
from armimpedance.hand.show import read_results, write_results

FIELDS = [f.name for f in dataclasses.fields(ImpedanceEstimate)]


def same(a: ImpedanceEstimate, b: ImpedanceEstimate) -> None:
    """Every field equal to the last bit."""
    for name in FIELDS:
        left, right = getattr(a, name), getattr(b, name)
        if isinstance(left, np.ndarray):
            assert left.shape == right.shape, name
            assert left.tobytes() == right.tobytes(), name
        elif name == "quality":
            # nan is not equal to itself, but its text is
            assert repr(left) == repr(right)
        elif name == "shared_errors":
            assert {n: e.tobytes() for n, e in left.items()} == {
                n: e.tobytes() for n, e in right.items()
            }
        elif name == "keys":
            assert dict(left) == dict(right)
            assert [type(v) for v in left.values()] == [type(v) for v in right.values()]
        else:
            assert left == right, name


def table(path):
    with open(path, newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


# Derived columns (areas, ratios) must not overflow, so neither do the numbers come near to it.
ANGLES = st.floats(-6.0, 6.0)
NUMBERS = st.floats(-1e12, 1e12).map(lambda v: v if abs(v) > 1e-12 else 0.0)
WORDS = st.text(st.characters(exclude_categories=["Cs", "Cc", "Nd", "Zl", "Zp"]), min_size=1)
SENTENCES = WORDS.filter(lambda text: "; " not in text and not text.endswith(";"))


@st.composite
def estimates(draw):
    k = draw(st.integers(1, 3))
    square = arrays(np.float64, (k, k), elements=NUMBERS)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    half = draw(st.floats(0, 1e3)) * rng.uniform(-1, 1, (3 * k * k,) * 2)
    covariance = half @ half.T
    unknown = st.just(float("nan")) | st.floats(0, 1e9)
    level = draw(st.sampled_from(["hand", "joint", "muscle"]))
    axes = k if level == "hand" else draw(st.integers(1, 3))
    vector = st.none() | arrays(np.float64, axes, elements=NUMBERS)
    keys = {
        "condition": draw(WORDS),
        "day": draw(st.integers(-9, 9) | WORDS),
        "load": draw(NUMBERS),
    }
    quality = Quality(
        draw(st.integers(0, 500)), draw(st.integers(0, 10**6)), draw(unknown), draw(unknown),
        draw(unknown), draw(unknown), draw(st.integers(0, 27)), draw(unknown),
        draw(st.none() | st.floats(0, 1)),
    )  # fmt: skip
    return ImpedanceEstimate(
        level=level,
        method=draw(WORDS),
        inertia=draw(square),
        viscosity=draw(square),
        stiffness=draw(square),
        covariance=(covariance + covariance.T) / 2,
        dof=draw(st.floats(1, 1e6) | st.just(float("inf"))),
        quality=quality,
        inertia_with_handle=draw(square),
        keys=keys,
        position=draw(vector),
        force=draw(vector),
        joint_angles=draw(st.none() | arrays(np.float64, st.integers(1, 4), elements=ANGLES)),
        torque=draw(st.none() | arrays(np.float64, st.integers(1, 4), elements=NUMBERS)),
        activation=draw(st.none() | arrays(np.float64, st.integers(1, 12), elements=NUMBERS)),
        activation_sd=draw(st.none() | arrays(np.float64, st.integers(1, 12), elements=NUMBERS)),
        muscles=tuple(draw(st.lists(SENTENCES, max_size=3))),
        shoulder_m=draw(vector),
        shared_errors=draw(
            st.dictionaries(WORDS, arrays(np.float64, 3 * k * k, elements=NUMBERS), max_size=2)
        ),
        warnings=tuple(draw(st.lists(SENTENCES, max_size=2))),
        provenance=tuple(draw(st.lists(SENTENCES, max_size=2))),
    )


@pytest.mark.study
@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(estimates(), min_size=1, max_size=2))
def test_what_is_written_is_read_back_to_the_last_bit(tmp_path, written):
    path = tmp_path / "RESULTS.csv"
    write_results(written, path)
    for a, b in zip(written, read_results(path), strict=True):
        same(a, b)


def test_reading_and_writing_again_gives_the_same_bytes(tmp_path, make_estimate):
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    write_results([make_estimate(k=k, seed=k) for k in (2, 1, 3)], first)
    write_results(read_results(first), second)
    assert first.read_bytes() == second.read_bytes()


def test_a_warning_comes_back_as_one(tmp_path, make_estimate):
    path = tmp_path / "RESULTS.csv"
    said = ("reflex: 2.1 % of K; the interval allows for it", "clock: steady")
    write_results([dataclasses.replace(make_estimate(), warnings=said)], path)
    (back,) = read_results(path)
    assert [text.split(":")[0] for text in back.warnings] == ["reflex", "clock"]
    assert back.warnings[0].split() == said[0].replace(";", ",").split()


def test_columns_of_the_contract_hold_what_they_are_named_after(tmp_path, make_estimate):
    estimate = make_estimate()
    path = tmp_path / "RESULTS.csv"
    write_results([estimate], path)
    (row,) = table(path)
    assert row["condition"] == "relaxed"
    assert row["n_trials"] == "40"
    assert row["level"] == "hand"
    assert float(row["position_2_m"]) == estimate.position[1]
    assert float(row["force_1_N"]) == estimate.force[0]
    assert float(row["q_elbow_rad"]) == 1.57
    assert float(row["K_12"]) == estimate.stiffness[0, 1]
    assert float(row["B_21"]) == estimate.viscosity[1, 0]
    assert float(row["M_with_handle_11"]) == estimate.inertia_with_handle[0, 0]
    assert float(row["sd_K_22"]) == np.sqrt(estimate.covariance[11, 11])
    # 97.5 % point of t with 39 degrees of freedom: 2.0227 in any table
    half = (float(row["ci_high_K_22"]) - float(row["ci_low_K_22"])) / 2
    assert half / float(row["sd_K_22"]) == pytest.approx(2.0227, abs=5e-5)
    ellipse = ellipse_of(estimate, "viscosity")
    assert float(row["B_size"]) == ellipse.size
    assert float(row["B_orientation_deg"]) == pytest.approx(180 / np.pi * ellipse.orientation_rad)
    assert float(row["ci_low_B_shape"]) == ellipse.interval()[2, 0]
    assert float(row["ci_high_B_orientation_deg"]) == pytest.approx(
        180 / np.pi * ellipse.interval()[1, 1]
    )
    c = estimate.covariance
    assert float(row["K_antisymmetric"]) == pytest.approx(
        (float(row["K_12"]) - float(row["K_21"])) / 2
    )
    assert float(row["sd_K_antisymmetric"]) ** 2 == pytest.approx(
        (c[9, 9] + c[10, 10] - 2 * c[9, 10]) / 4
    )
    assert row["warnings"] == "onsets were detected"


def test_columns_follow_the_contract_s_order_when_numbers_of_axes_mix(tmp_path, make_estimate):
    path = tmp_path / "RESULTS.csv"
    write_results([make_estimate(k=1), make_estimate(k=3), make_estimate(k=2)], path)
    header = path.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert len(set(header)) == len(header)
    k_columns = [name for name in header if name.startswith("K_") and name[2:].isdigit()]
    assert k_columns == [f"K_{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    rows = table(path)
    assert rows[0]["K_12"] == ""
    assert rows[0]["K_size"] == ""
    assert rows[2]["K_33"] == ""
    assert float(rows[2]["K_size"]) > 0


def test_angle_and_torque_of_a_recording_of_joints_are_named_so(tmp_path, make_estimate):
    ankle = make_estimate(k=1, level="joint", joint_angles=None, shoulder_m=None)
    mapped = make_estimate(k=2, level="joint")
    path = tmp_path / "RESULTS.csv"
    write_results([ankle, mapped], path)
    first, second = table(path)
    assert float(first["position_1_rad"]) == ankle.position[0]
    assert float(first["force_1_Nm"]) == ankle.force[0]
    assert first["position_1_m"] == ""
    assert float(second["position_2_m"]) == mapped.position[1]
    assert second["force_1_Nm"] == ""


def test_no_ellipse_where_a_matrix_is_not_positive_definite(tmp_path, make_estimate):
    path = tmp_path / "RESULTS.csv"
    write_results([make_estimate(stiffness=[[1.0, 3.0], [3.0, 1.0]])], path)
    (row,) = table(path)
    assert row["K_size"] == row["ci_low_K_shape"] == ""
    assert float(row["B_size"]) > 0


def outside(path, make_estimate, **cells):
    """What a script that keeps to the contract, and to no more, would write."""
    write_results([make_estimate(warnings=())], path)
    (row,) = table(path)
    for name in ("covariance", "dof", "n_rows", "rank", "residual_sd", "cond_raw", "provenance"):
        del row[name]
    row |= cells
    with open(path, "w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, [name for name, text in row.items() if text is not None])
        writer.writeheader()
        writer.writerow({name: text for name, text in row.items() if text is not None})
    return path


def test_a_file_without_covariance_gives_independent_errors_and_says_so(tmp_path, make_estimate):
    (read,) = read_results(outside(tmp_path / "r.csv", make_estimate))
    np.testing.assert_allclose(
        read.covariance, np.diag(np.diag(make_estimate().covariance)), rtol=1e-14
    )
    assert "covariance" in " ".join(read.warnings)
    assert read.dof == 39


@pytest.mark.parametrize(
    ("column", "text", "words"),
    [
        ("sd_B_12", None, ("column sd_B_12", "no such column")),
        ("sd_B_12", "-1", ("row 2", "column sd_B_12", "at least 0")),
        ("K_12", "stiff", ("row 2", "column K_12", "'stiff'", "a finite number")),
        ("K_12", "", ("row 2", "column K_12", "empty")),
        ("K_12", "inf", ("row 2", "column K_12", "finite")),
        ("B_11", "nan", ("row 2", "column B_11", "finite")),
        ("M_22", None, ("column M_22", "no such column")),
        ("level", "foot", ("row 2", "column level", "'foot'", "hand or joint or muscle")),
        ("n_trials", "many", ("row 2", "column n_trials", "'many'")),
        ("n_trials", "4.5", ("row 2", "column n_trials", "whole")),
        ("n_trials", None, ("column n_trials",)),
        ("covariance", "[1, 2", ("row 2", "column covariance", "78 finite numbers")),
        ("covariance", "[1, 2]", ("row 2", "column covariance", "78 finite numbers")),
        ("covariance", json.dumps([float("nan")] * 78), ("row 2", "column covariance")),
        ("shared_errors", "[1, 2", ("row 2", "column shared_errors", "12 finite numbers")),
        ("shared_errors", "7", ("row 2", "column shared_errors", "12 finite numbers")),
        ("shared_errors", '{"reflex": 1}', ("row 2", "column shared_errors", "reflex")),
        ("shared_errors", '{"reflex": ["a"]}', ("row 2", "column shared_errors")),
        ("shared_errors", json.dumps({"x": [float("inf")] * 12}), ("row 2", "finite numbers")),
        ("shared_errors", "[" * 5000, ("row 2", "column shared_errors")),
        ("covariance", json.dumps([-1.0] * 78), ("row 2", "column covariance", "negative")),
        ("position_2_m", "", ("row 2", "column position_2_m", "axes: 2")),
        ("force_1_N", "", ("row 2", "column force_1_N", "empty")),
        ("dof", "0", ("row 2", "degrees of freedom")),
    ],
)
def test_bad_content_is_refused_by_row_and_column(tmp_path, make_estimate, column, text, words):
    path = outside(tmp_path / "r.csv", make_estimate, **{column: text})
    with pytest.raises(InputError) as error:
        read_results(path)
    message = str(error.value)
    assert "\n" not in message
    for word in (str(path), *words):
        assert word in message


@pytest.mark.parametrize(
    "content", [b"", b"condition,n_trials\n", b"a,a\n1,2\n", b"a,b\n1,2,3,4\n", b"\xff\xfe\x00a,\n"]
)
def test_a_file_that_is_no_table_is_refused(tmp_path, content):
    path = tmp_path / "r.csv"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"r\.csv"):
        read_results(path)


def test_a_file_that_went_through_a_data_frame_is_read(tmp_path, make_estimate):
    path = tmp_path / "r.csv"
    written = [make_estimate(seed=1), make_estimate(k=1)]
    write_results(written, path)
    pd.read_csv(path, dtype=str).to_csv(path)
    for a, b in zip(written, read_results(path), strict=True):
        same(a, b)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.csv"):
        read_results(tmp_path / "none.csv")


@pytest.mark.parametrize("name", ["K_11", "level", "q_elbow_rad", "ci_low_M_size", "warnings"])
def test_a_group_named_like_a_result_is_refused_and_nothing_is_written(
    tmp_path, make_estimate, name
):
    path = tmp_path / "r.csv"
    with pytest.raises(InputError, match=name):
        write_results([make_estimate(keys={name: "a"})], path)
    assert list(tmp_path.iterdir()) == []


def test_an_old_file_survives_a_failure(tmp_path, make_estimate):
    path = tmp_path / "r.csv"
    write_results([make_estimate()], path)
    before = path.read_bytes()
    with pytest.raises(InputError):
        write_results([], path)
    # A lone surrogate cannot be encoded: the writing breaks off in the middle.
    with pytest.raises(InputError, match="no character"):
        write_results([make_estimate(), make_estimate(method="\ud800")], path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_line_breaks_in_a_text_do_not_break_the_row(tmp_path, make_estimate):
    path = tmp_path / "r.csv"
    write_results([make_estimate(keys={"condition": 'a\nb\r\nc, "d"'})], path)
    assert len(path.read_text(encoding="utf-8").splitlines()) == 2
    assert read_results(path)[0].keys["condition"] == 'a b c, "d"'


def test_group_values_keep_their_kind(tmp_path, make_estimate):
    keys = {"condition": "10", "day": np.int64(3), "load": np.float64(0.1), "code": "007"}
    path = tmp_path / "r.csv"
    write_results([make_estimate(keys=keys | {"unknown": float("nan")})], path)
    assert dict(read_results(path)[0].keys) == {
        "condition": "10", "day": 3, "load": 0.1, "code": "007",
    }  # fmt: skip
