"""MATLAB structs hold what the estimates hold; names that MATLAB would not take are mended."""

from __future__ import annotations

import keyword
import re

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.io import loadmat

from armimpedance.core.conventions import UNITS
from armimpedance.core.described import Meaning
from armimpedance.hand.show import Estimates
from armimpedance.hand.show.quantities import half_widths
from armimpedance.show.files.matlab import Names, course_struct
from armimpedance.show.files.tables import table_content, write_content

VALID = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,62}")


def loaded(path):
    return loadmat(path, struct_as_record=False, squeeze_me=True)


@pytest.mark.parametrize("k", [1, 2, 3])
def test_structs_hold_matrices_limits_covariance_and_units(tmp_path, make_estimate, k):
    made = [make_estimate(k=k, seed=s, keys={"condition": f"é{s}", "day": s}) for s in (1, 2, 3)]
    Estimates(tuple(made)).write(tmp_path / "r.mat")
    results = loaded(tmp_path / "r.mat")["results"]
    assert len(results) == 3
    for struct, one in zip(results, made, strict=True):
        assert (struct.keys.condition, struct.keys.day) == (one.keys["condition"], one.keys["day"])
        for i, field in enumerate(("inertia", "viscosity", "stiffness")):
            value, half = getattr(one, field), half_widths(one)[i]
            for name, known in (("", value), ("_lower", value - half), ("_upper", value + half)):
                np.testing.assert_array_equal(getattr(struct, field + name), np.squeeze(known))
            assert getattr(struct.units, field) == UNITS["hand"]["MBK"[i]]
        np.testing.assert_array_equal(struct.covariance, one.covariance)
        assert len(struct.covariance_names) == 3 * k * k


@pytest.mark.parametrize("warnings", [(), ("one",), ("one", "two")])
def test_warnings_are_cells_of_texts(tmp_path, make_estimate, warnings):
    Estimates((make_estimate(warnings=warnings),)).write(tmp_path / "r.mat")
    [struct] = loadmat(tmp_path / "r.mat", struct_as_record=False)["results"].ravel()
    assert struct.warnings.dtype == object
    assert [str(cell[0]) for cell in struct.warnings.ravel()] == list(warnings)


def test_names_that_matlab_would_not_take_are_mended_and_told(tmp_path):
    names = ["2nd day", "_x", "for", "a" * 80, "a" * 79 + "b", "K é", "x_"]
    rows = [dict.fromkeys(names, 1.0) | {"day": "=1"}]
    write_content(table_content(rows, keys=("day",)), tmp_path / "r.mat")
    read = loaded(tmp_path / "r.mat")
    told = {one.field: one.name for one in read["mended_names"]}
    assert set(told.values()) == set(names) - {"x_"}
    fields = read["results"]._fieldnames
    assert all(VALID.fullmatch(name) and not keyword.iskeyword(name) for name in fields)
    assert set(told) <= set(fields)


@given(st.lists(st.text(max_size=90), unique=True, max_size=20))
def test_different_names_stay_different_and_valid(texts):
    names = Names()
    made = [names.of(text) for text in texts]
    assert len(set(made)) == len(texts)
    assert all(VALID.fullmatch(name) for name in made)
    assert {names.mended.get(name, name): name for name in made} == dict(
        zip(texts, made, strict=True)
    )


def test_a_table_without_structs_of_its_own_has_a_field_a_column(tmp_path):
    rows = [
        {"condition": "a", "x_m": 1.5, "ok": True, "warnings": "one; two"},
        {"condition": "b", "x_m": None, "ok": False, "warnings": ""},
    ]
    described = {"x_m": Meaning("a place", "m")}
    write_content(table_content(rows, keys=("condition",), described=described), tmp_path / "r.mat")
    one, two = loaded(tmp_path / "r.mat")["results"]
    assert (one.keys.condition, one.x_m, one.units.x_m, one.ok) == ("a", 1.5, "m", 1)
    assert list(one.warnings) == ["one", "two"]
    assert np.isnan(two.x_m)


def test_a_course_is_one_struct_of_vectors(tmp_path):
    rows = [{"time_s": i / 10, "K": None if i == 1 else float(i), "valid": i > 1} for i in range(3)]
    columns = ["time_s", "K", "valid"]
    described = {"time_s": Meaning("time", "s"), "K": Meaning("stiffness", "N m/rad")}
    content = table_content(rows, structs=lambda: [course_struct(columns, rows, described)])
    write_content(content, tmp_path / "course.mat")
    course = loaded(tmp_path / "course.mat")["results"]
    np.testing.assert_array_equal(course.time_s, [0.0, 0.1, 0.2])
    np.testing.assert_array_equal(course.K, [0.0, np.nan, 2.0])
    assert course.valid.tolist() == [0, 0, 1]
    assert (course.units.time_s, course.units.K) == ("s", "N m/rad")
