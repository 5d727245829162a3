"""The long table says what the wide one says: one row a number, with its unit and its limits."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.conventions import UNITS, element_names
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.hand.show import Estimates
from armimpedance.hand.show.results_csv import results_content
from armimpedance.show.files.tables import table_content, write_content
from armimpedance.show.files.words import RowAxes, meaning_of


@pytest.mark.study
def test_long_and_wide_hold_the_same_numbers(make_estimate):
    made = [make_estimate(k=k, seed=k, keys={"condition": f"c{k}", "set": k}) for k in (1, 2, 3)]
    result = Estimates(tuple(made))
    wide = result.to_frame()
    fields = {"value": "", "lower": "ci_low_", "upper": "ci_high_", "sd": "sd_"}
    seen = 0
    for row in result.to_long().itertuples():
        [own] = wide[wide["set"] == row.set].to_dict("records")
        assert (row.condition, row.method) == (own["condition"], own["method"])
        for field, before in fields.items():
            known = own.get(before + row.quantity)
            if known is not None and not pd.isna(known):
                assert getattr(row, field) == known
                seen += 1
    assert seen > 250


@pytest.mark.parametrize("level", ["hand", "joint"])
def test_every_element_has_its_unit_and_place(make_estimate, level):
    long = Estimates((make_estimate(level=level),)).to_long().set_index("quantity")
    for symbol in "MBK":
        for name in element_names(symbol, 2):
            assert long.loc[name, "unit"] == UNITS[level][symbol]
            assert (long.loc[name, "i"], long.loc[name, "j"]) == (int(name[-2]), int(name[-1]))


def test_an_antisymmetric_part_has_the_limits_of_its_own_error(make_estimate):
    made = make_estimate()
    [one] = [q for q in results_content([made]).long if q.quantity == "K_antisymmetric"]
    [element] = [q for q in results_content([made]).long if q.quantity == "K_12"]
    factor = (element.upper - element.value) / element.sd
    np.testing.assert_allclose([one.value - one.lower, one.upper - one.value], factor * one.sd)


def test_a_warning_is_the_verdict_of_its_row(make_estimate):
    made = [make_estimate(warnings=w, keys={"condition": n}) for n, w in (("a", ()), ("b", ("x",)))]
    long = Estimates(tuple(made)).to_long()
    assert long.groupby("condition")["verdict"].unique().map(list).to_dict() == {
        "a": ["ok"],
        "b": ["warning"],
    }


@pytest.mark.parametrize("ending", ["csv", "json", "parquet"])
def test_each_format_holds_the_long_table(tmp_path, make_estimate, ending):
    result = Estimates((make_estimate(keys={"condition": "a"}),))
    path = tmp_path / f"long.{ending}"
    result.write(path, long=True)
    if ending == "json":
        read = pd.DataFrame(json.loads(path.read_text()))
    else:
        read = pd.read_csv(path) if ending == "csv" else pd.read_parquet(path)
    pd.testing.assert_frame_equal(read, result.to_long(), check_dtype=False)


@pytest.mark.parametrize("ending", ["xlsx", "mat"])
def test_a_long_table_where_there_is_none_is_refused(tmp_path, make_estimate, ending):
    with pytest.raises(InputError, match="no long table"):
        Estimates((make_estimate(),)).write(tmp_path / f"r.{ending}", long=True)
    assert list(tmp_path.iterdir()) == []


def test_what_does_not_exist_has_no_row():
    rows = [{"g": "a", "x_m": 1.0}, {"g": "b", "x_m": None}, {"g": "c", "x_m": float("nan")}]
    long = table_content(rows, keys=("g",), described={"x_m": Meaning("a place", "m")}).long
    assert [(one.keys["g"], one.value, one.unit) for one in long] == [("a", 1.0, "m")]


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("position_1_m", "m"), ("force_2_N", "N"), ("torque_1_Nm", "N m"), ("q_elbow_rad", "rad"),
        ("K_size", "(N/m)^2"), ("K_shape", "1"), ("M_orientation_deg", "deg"), ("vaf", "1"),
        ("K_axis_1", "N/m"), ("K_axis_1_x", "1"), ("K_axis_1_turn_deg", "deg"),
        ("B_antisymmetric", "N s/m"), ("residual_sd", "N"), ("alpha_1", "1"),
    ],
)  # fmt: skip
def test_units_of_an_impedance_follow_from_its_names(column, unit):
    assert meaning_of(column).unit == unit


@pytest.mark.parametrize("column", ["sampling_rate", "stiffness_N_m", "share_percent", "delay_ms"])
def test_no_unit_is_guessed_of_a_column_that_nothing_describes(column):
    assert meaning_of(column).unit == ""
    assert meaning_of(column, described={column: Meaning("said", "Hz")}).unit == "Hz"


@pytest.mark.parametrize("ending", ["csv", "json", "parquet", "xlsx", "mat"])
def test_half_a_character_is_one_line_and_nothing_is_left(tmp_path, ending):
    content = table_content([{"condition": "\ud800", "x": 1.0}])
    with pytest.raises(InputError) as told:
        write_content(content, tmp_path / f"r.{ending}")
    assert "\n" not in str(told.value)
    assert list(tmp_path.iterdir()) == []


def test_a_row_at_the_joints_keeps_the_place_of_the_hand():
    place, angle = (meaning_of(f"position_1_{unit}", RowAxes("joint")) for unit in ("m", "rad"))
    assert (place.words, place.unit) == ("position x", "m")
    assert (angle.words, angle.unit) == ("angle of shoulder", "rad")
    assert meaning_of("force_3_N", RowAxes("joint", 4)).words == "force z"


def test_joints_that_were_recorded_themselves_are_no_shoulder():
    wrist = RowAxes.of({"level": "joint", "K_22": 1.0, "position_1_rad": 0.1})
    assert meaning_of("K_12", wrist).words == "stiffness: joint 1 torque per joint 2 angle"
    arm = RowAxes.of({"level": "joint", "K_22": 1.0, "q_shoulder_rad": 0.1})
    assert meaning_of("K_12", arm).words == "stiffness: shoulder torque per elbow angle"


def test_the_size_of_an_ellipsoid_is_a_volume():
    solid = meaning_of("K_size", RowAxes("hand", 3))
    assert solid.unit == "(N/m)^3"
    assert "ellipsoid" in solid.words
