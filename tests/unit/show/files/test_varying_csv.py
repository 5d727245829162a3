"""VARYING.csv and the text of a joint: what a script and a reader get."""

import csv
import json

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError, RecordError
from armimpedance.joint.elbow.elbow_result import ChannelSnr, ElbowFit, VaryingImpedance, Whiteness
from armimpedance.joint.elbow.show.text import elbow_text, varying_text
from armimpedance.numerics.regression import Parameters
from armimpedance.show.files import write_content


def a_course(**changes):
    time = np.tile(np.arange(5) * 0.1, 2)
    given = {
        "method": "smoother",
        "trials": ("3", "7"),
        "offsets": np.array([0, 5, 10]),
        "time_s": time,
        "B": 1 + time,
        "K": 20 + np.arange(10.0),
        "sd_B": np.full(10, 0.1),
        "sd_K": np.full(10, 2.0),
        "parameters": Parameters(("I",), ("kg m^2",), [0.07], [[0.002**2]], dof=12.0),
        "snr": ChannelSnr(30.0, None),
        "warnings": ("varies as fast as a window", "another"),
    }
    return VaryingImpedance(**{**given, **changes})


UNITS = ("kg m^2", "N m s/rad", "N m/rad")
COLUMNS = (
    *("time_s", "B", "K", "ci_low_B", "ci_high_B", "ci_low_K", "ci_high_K", "sd_B", "sd_K"),
    *("I", "ci_low_I", "ci_high_I", "trial", "method", "warnings"),
)


def a_fit(p=0.5, names=("I", "B", "K"), **changes):
    values = np.array([0.07, 3.0, 9.0])[: len(names)]
    covariance = np.diag((0.02 * values) ** 2)
    given = {
        "method": "iv",
        "parameters": Parameters(
            names, UNITS[: len(names)], values, covariance, plain_covariance=covariance / 4
        ),
        "n": 900,
        "cond_raw": 12.0,
        "cond_scaled": 3.0,
        "rank": 3,
        "r2": 0.98,
        "snr": ChannelSnr(31.2, None),
        "whiteness": Whiteness(12.0, p, 20, 0.1),
        "preparation": ("low-pass 10 Hz",),
        "warnings": ("a warning",),
        "details": {"a": 1},
    }
    return ElbowFit(**{**given, **changes})


def test_the_csv_says_what_the_result_says(tmp_path):
    course = a_course()
    write_content(course.content, tmp_path / "course.csv")
    with open(tmp_path / "course.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert list(rows[0]) == list(COLUMNS)
    assert [r["trial"] for r in rows] == ["3"] * 5 + ["7"] * 5
    for name in ("time_s", "B", "K", "sd_K"):
        np.testing.assert_allclose([float(r[name]) for r in rows], getattr(course, name))
    band = course.band("K")
    np.testing.assert_allclose([float(r["ci_low_K"]) for r in rows], band[:, 0])
    np.testing.assert_allclose([float(r["ci_high_K"]) for r in rows], band[:, 1])
    assert rows[0]["warnings"] == "varies as fast as a window; another"


def test_the_band_is_that_of_the_t_distribution():
    from scipy.stats import t

    band = a_course().band("B")
    np.testing.assert_allclose((band[:, 1] - band[:, 0]) / 2, t.ppf(0.975, 12) * 0.1)


def test_nothing_is_left_where_the_csv_cannot_be_written(tmp_path):
    with pytest.raises(InputError):
        write_content(a_course().content, tmp_path / "none" / "course.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "change", [{"B": np.ones(9)}, {"K": np.full(10, np.nan)}, {"offsets": np.array([0, 10])}]
)
def test_a_course_that_cannot_be_is_refused(change):
    with pytest.raises(RecordError):
        a_course(**change)


@pytest.mark.parametrize("ending", [".json", ".parquet"])
def test_other_endings_hold_numbers_of_full_precision(tmp_path, ending):
    course = a_course(B=np.linspace(1, 2, 10) / 3)
    path = tmp_path / f"course{ending}"
    write_content(course.content, path)
    read = pd.read_parquet if ending == ".parquet" else lambda file: json.loads(file.read_text())
    table = pd.DataFrame(read(path))
    assert list(table.columns) == list(COLUMNS)
    np.testing.assert_array_equal(table["B"], course.B)
    with pytest.raises(InputError, match="ending"):
        write_content(course.content, tmp_path / "course.txt")


def test_a_course_shows_itself_in_a_few_lines():
    course = a_course(method="<b>", warnings=tuple(f"<script>{k}" for k in range(20)))
    assert len(repr(course).splitlines()) <= 12
    assert "B from 1 to 1.4 N m s/rad" in repr(course)
    assert "<script>" not in course._repr_html_()
    assert "<b>" not in course._repr_html_()
    assert course.inertia.ci95 == pytest.approx((0.07 - 2.179 * 0.002, 0.07 + 2.179 * 0.002), 1e-3)
    assert course.to_dict()["course"]["K"] == course.K.tolist()


def test_a_fit_shows_itself_in_a_few_lines():
    fit = a_fit(warnings=tuple(f"<script>{k}" for k in range(20)), joint=2)
    assert len(repr(fit).splitlines()) <= 12
    assert "K of joint 2 = 9 N m/rad" in repr(fit)
    assert "<script>" not in fit._repr_html_()
    frame = fit.to_frame()
    assert list(frame.index) == ["I", "B", "K"]
    assert list(frame.columns) == ["joint", "value", "sd", "ci_low", "ci_high", "unit"]
    assert fit["B"] == fit.viscosity


def test_the_text_holds_values_intervals_and_warnings():
    text = elbow_text(a_fit(parts={"trial 1": a_fit(), "trial 2": a_fit()}))
    assert "0.0700 (0.0673 to 0.0727)" in text or "0.0700" in text
    assert "torque 31 dB, angle no noise seen" in text
    assert "residuals: white" in text
    assert "mean ± sd" in text
    assert "[1] a warning" in text
    assert max(map(len, text.splitlines())) <= 100
    assert "residuals: correlated" in elbow_text(a_fit(p=1e-4))


def test_the_text_of_a_course_holds_its_range_and_warnings():
    text = varying_text(a_course(notes=("a note",)))
    assert text.startswith("a note")
    assert "10 points of 2 trials" in text
    assert "[2] another" in text


def test_what_fit_json_adds_is_plain():
    from armimpedance.core.json_text import finite

    fit = a_fit(parts={"trial 1": a_fit()})
    content = json.loads(json.dumps(finite(fit.to_dict())))
    assert content["snr_db"] == {"torque": 31.2, "angle": None}
    assert [p["name"] for p in content["parts"][0]["parameters"]] == ["I", "B", "K"]
    assert content["residual_whiteness"]["lags"] == 20


def test_a_fit_of_other_parameters_is_refused():
    with pytest.raises(RecordError, match="I, B, K"):
        a_fit(names=("I", "B"))
