"""Every result of every topic says of each of its numbers what it is, in every form."""

from __future__ import annotations

import json
from functools import cache
from numbers import Real

import numpy as np
import pandas as pd
import pytest
from sessions import pushes, swing

import armimpedance as ai
from armimpedance.core.described import Meaning, meaning_in, meanings
from armimpedance.joint.therapy.share.result import CONTRIBUTION
from armimpedance.joint.therapy.show.contributions import SAMPLES
from armimpedance.numerics.regression import Derived, with_derived
from armimpedance.show.files.words import RowAxes, meaning_of
from manipulandum_sim.body import simulate_body
from manipulandum_sim.elbow import simulate_bench, simulate_elbow


def session():
    return pushes(sets=1)


@cache
def bench():
    return simulate_bench(0.07, 1.2, 20.0, duration_s=6.0, snr_db=40.0)[0]


def _people():
    made = {
        name: [ai.NamedParameter("k", value, 0.1, 0.1, "N m/rad") for value in values]
        for name, values in {"one": (2.0, 2.5, 3.0), "two": (4.0, 4.5, 5.5)}.items()
    }
    return ai.discriminate(made)


RESULTS = {
    "estimate": lambda: ai.estimate(session()),
    "joint": lambda: ai.to_joint(ai.estimate(session()), recording=session()),
    "muscles": lambda: ai.to_muscle(ai.estimate(session()), arm="planar6"),
    "reflex": lambda: ai.reflex(pushes(1, ("cocontraction_10",))),
    "compare": lambda: ai.compare(session()),
    "inspect": lambda: ai.inspect(session()),
    "elbow": lambda: ai.elbow(bench()),
    "over time": lambda: ai.elbow_over_time(bench(), method="windows"),
    "law": lambda: ai.emg_law(simulate_elbow("cocontraction", repetitions=1, duration_s=2.0)[0]),
    "passive": lambda: ai.passive(swing(), quadratic=True, method="ls"),
    "body": lambda: ai.body(simulate_body(("all_joints",))[0], method="ls", noise_draws=0),
    "discriminate": _people,
}


@cache
def result(name):
    return RESULTS[name]()


def _numbers(content):
    """Columns that hold numbers and do not name a row."""
    for name in content.columns:
        cells = [row.get(name) for row in content.rows]
        known = [cell for cell in cells if cell is not None]
        numeric = known and all(isinstance(c, Real) and not isinstance(c, bool) for c in known)
        if numeric and name not in content.keys:
            yield name


def _unit(content, name):
    """The unit of a column, or the column of units."""
    if unit := meaning_of(name, RowAxes.of(content.rows[0]), content.described).unit:
        return unit
    return "unit" if "unit" in content.columns and meaning_in(content.described, name) else ""


@pytest.mark.parametrize("name", RESULTS)
def test_every_number_of_a_result_has_its_unit(name):
    content = result(name).content
    numbers = list(_numbers(content))
    assert numbers or name == "inspect"
    # a measure of two groups has the unit that the people's numbers have
    own = ("value", "ci_low", "ci_high") if name == "discriminate" else ()
    assert [column for column in numbers if not _unit(content, column)] == list(own)


@pytest.mark.parametrize("name", RESULTS)
def test_every_form_of_a_result_holds_its_numbers(name, tmp_path):
    one = result(name)
    for ending in ("csv", "json", "parquet", "xlsx", "mat"):
        one.write(tmp_path / f"r.{ending}")
    assert json.loads((tmp_path / "r.json").read_text())
    long = one.to_long()
    one.write(tmp_path / "long.csv", long=True)
    assert len(pd.read_csv(tmp_path / "long.csv")) == len(long) > 0
    sheet = pd.read_excel(tmp_path / "r.xlsx", sheet_name="columns")
    assert set(sheet["column"]) == set(one.content.columns)


@pytest.mark.parametrize("name", sorted(set(RESULTS) - {"inspect"}))
def test_labelled_arrays_hold_the_table(name):
    one = result(name)
    arrays, rows = one.to_xarray(), one.content.rows
    assert arrays.sizes["row"] == len(rows)
    sized = [a for a in arrays.data_vars.values() if a.dtype == float and "long_name" in a.attrs]
    held = sum(int(np.isfinite(a.values).sum()) for a in sized)
    numbers = [
        row[c]
        for row in rows
        for c in _numbers(one.content)
        if row.get(c) is not None and np.isfinite(row[c])
    ]
    assert held == len(numbers) > 0


def test_a_matrix_is_one_array_with_its_unit():
    hand = result("estimate")
    arrays = hand.to_xarray()
    np.testing.assert_array_equal(arrays["K"], [one.stiffness for one in hand])
    np.testing.assert_array_equal(arrays["sd_K"], [one.sd[2] for one in hand])
    assert arrays["K"].attrs["units"] == "N/m"
    assert arrays["K"].sel(row="cocontraction_10", i="x", j="y") == hand[0].stiffness[0, 1]
    assert result("joint").to_xarray()["K"].attrs["units"] == "N m/rad"
    assert list(arrays["position_m"].axis.values) == ["x", "y"]


def test_only_what_names_a_row_is_its_index():
    arrays = ai.estimate(session(), by=("condition", "set")).to_xarray()
    assert list(arrays["row"].values) == list(arrays["condition"].values)
    # one condition in two sets: the set names a row, its provenance does not
    again = ai.estimate(
        pushes(conditions=("cocontraction_10",)), by=("condition", "set")
    ).to_xarray()
    assert list(again["row"].values) == list(again["set"].values)
    assert again["K"].attrs["long_name"] == "stiffness"
    assert again["ci_low_K"].attrs["long_name"] == "lower 95 % limit: stiffness"


def test_classical_errors_of_what_follows_go_the_same_way():
    fit = result("passive")[0].parameters
    lag = {"lag": Derived(Meaning("time constant", "s"), lambda p: p["h"] / p["k"])}
    every = with_derived(fit, lag)
    at = [every.names.index(name) for name in ("k", "h", "lag")]
    k, h = fit["k"].value, fit["h"].value
    slope = np.array([-h / k**2, 1 / k])
    for own, made in (
        (fit.covariance, every.covariance),
        (fit.plain_covariance, every.plain_covariance),
    ):
        C = own[np.ix_(at[:2], at[:2])]
        np.testing.assert_allclose(made[at[2], at[2]], slope @ C @ slope, rtol=1e-6)
        np.testing.assert_allclose(made[np.ix_(at[:2], at[:2])], C, rtol=1e-6)


def test_columns_of_therapy_are_described():
    for columns in (CONTRIBUTION, SAMPLES):
        assert all(column.words for column in columns)
        texts = ("trial", "condition", "movement", "axis", "notes", "counts", "valid")
        unitless = [name for name, one in meanings(columns).items() if not one.unit]
        assert all(name in texts or name.endswith("_valid") for name in unitless)
