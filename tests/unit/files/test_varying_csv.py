"""VARYING.csv and the text of a joint: what a script and a reader get."""

import csv

import numpy as np
import pytest

from armimpedance.elbow.result import ChannelSnr, ElbowFit, VaryingImpedance, Whiteness
from armimpedance.errors import InputError, RecordError
from armimpedance.files.varying_csv import COLUMNS, write_varying
from armimpedance.regression import FitSummary, NamedParameter
from armimpedance.report.elbow_text import elbow_object, elbow_text, varying_text


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
        "inertia": NamedParameter("I", 0.07, 0.001, 0.002, "kg m^2"),
        "snr": ChannelSnr(30.0, None),
        "dof": 12.0,
        "warnings": ("varies as fast as a window", "another"),
    }
    return VaryingImpedance(**{**given, **changes})


def a_fit(p=0.5):
    parameters = tuple(
        NamedParameter(name, value, 0.01 * value, 0.02 * value, unit)
        for name, value, unit in (("I", 0.07, "kg m^2"), ("B", 3.0, "x"), ("K", 9.0, "Nm/rad"))
    )
    summary = FitSummary("iv", 900, 12.0, 3.0, 3, 0.98, 0.97, parameters, ("a warning",))
    white = Whiteness(12.0, p, 20, 0.1)
    return ElbowFit(
        summary, np.eye(3), ChannelSnr(31.2, None), white, ("low-pass 10 Hz",), {"a": 1}
    )


def test_the_csv_says_what_the_result_says(tmp_path):
    course = a_course()
    write_varying(course, tmp_path / "course.csv")
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
        write_varying(a_course(), tmp_path / "none" / "course.csv")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "change", [{"B": np.ones(9)}, {"K": np.full(10, np.nan)}, {"offsets": np.array([0, 10])}]
)
def test_a_course_that_cannot_be_is_refused(change):
    with pytest.raises(RecordError):
        a_course(**change)


def test_the_text_holds_values_intervals_and_warnings():
    text = elbow_text(a_fit(), {"trial 1": a_fit(), "trial 2": a_fit()})
    assert "0.0700 (0.0673 to 0.0727)" in text or "0.0700" in text
    assert "torque 31 dB, angle no noise seen" in text
    assert "residuals: white" in text
    assert "mean ± sd" in text
    assert "[1] a warning" in text
    assert max(map(len, text.splitlines())) <= 100
    assert "residuals: correlated" in elbow_text(a_fit(p=1e-4))


def test_the_text_of_a_course_holds_its_range_and_warnings():
    text = varying_text(a_course(), ("a note",))
    assert text.startswith("a note")
    assert "10 points of 2 trials" in text
    assert "[2] another" in text


def test_what_fit_json_adds_is_plain():
    import json

    from armimpedance.json_text import finite

    added = elbow_object(a_fit(), {"trial 1": a_fit()})
    content = json.loads(json.dumps(finite(added)))
    assert content["snr_db"] == {"torque": 31.2, "angle": None}
    assert [p["name"] for p in content["parts"][0]["parameters"]] == ["I", "B", "K"]
    assert content["residual_whiteness"]["lags"] == 20


def test_a_fit_of_other_parameters_is_refused():
    fit = a_fit()
    with pytest.raises(RecordError, match="I, B, K"):
        ElbowFit(
            FitSummary("x", 1, 1, 1, 1, 1, 1, fit.summary.parameters[:2]),
            np.eye(3),
            fit.snr,
            fit.whiteness,
        )
