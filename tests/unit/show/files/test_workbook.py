"""A workbook holds every double, no formula, nothing of the clock, and says what it cannot hold."""

from __future__ import annotations

import math
import zipfile

import numpy as np
import openpyxl
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.hand.show import Estimates
from armimpedance.show.files.content import About, Content
from armimpedance.show.files.tables import table_content, write_content


def cells_of(path, sheet="results"):
    page = openpyxl.load_workbook(path)[sheet]
    return [[cell.value for cell in row] for row in page.iter_rows()]


def written(tmp_path, rows, **more):
    path = tmp_path / "r.xlsx"
    write_content(table_content(rows), path, **more)
    return path


def test_every_double_comes_back_to_the_last_bit(tmp_path):
    draws = np.random.default_rng(1)
    numbers = [0.1 + 0.2, 5e-324, 1.7976931348623157e308, -0.0, math.pi, 1 / 3]
    numbers += (draws.standard_normal(300) * 10.0 ** draws.integers(-300, 300, 300)).tolist()
    path = written(tmp_path, [{"x": x} for x in numbers])
    assert pd.read_excel(path)["x"].tolist() == numbers


def test_results_are_those_of_the_data_frame(tmp_path, make_estimate):
    made = [make_estimate(seed=s, keys={"condition": f"c{s}", "day": s}) for s in range(3)]
    result = Estimates(tuple(made))
    result.write(tmp_path / "r.xlsx")
    read = pd.read_excel(tmp_path / "r.xlsx", sheet_name="results")
    pd.testing.assert_frame_equal(read, result.to_frame(), check_dtype=False, check_exact=True)


@pytest.mark.parametrize("text", ["=1+1", "+1", "-x", "@A1", "#N/A", "\t=1", "{=1}", "TRUE", "1e5"])
def test_a_text_is_no_formula_no_error_and_no_number(tmp_path, text):
    page = openpyxl.load_workbook(written(tmp_path, [{"=name": text}]))["results"]
    for cell, known in ((page["A1"], "=name"), (page["A2"], text)):
        assert (cell.value, cell.data_type) == (known, "s")
    for name in zipfile.ZipFile(tmp_path / "r.xlsx").namelist():
        assert b"<f>" not in zipfile.ZipFile(tmp_path / "r.xlsx").read(name)


def test_control_characters_are_written_as_the_standard_says(tmp_path):
    path = written(tmp_path, [{"a": "x\x00y\x07", "b": "_x0007_"}])
    assert cells_of(path)[1] == ["x_x0000_y_x0007_", "_x005F_x0007_"]


def test_what_is_no_number_is_empty_or_said(tmp_path):
    row = {
        "n": None,
        "nan": float("nan"),
        "inf": -math.inf,
        "big": 2**63 + 1,
        "yes": np.bool_(True),
    }
    assert cells_of(written(tmp_path, [{"a": "x", **row}]))[1] == [
        "x", None, None, "-inf", str(2**63 + 1), True,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([{"a": "x" * 32_768}], "32768 characters"),
        ([{f"c{i}": 1 for i in range(16_385)}], "16385 columns"),
        ([{"a": 1}] * 1_048_576, "1048577 rows"),
    ],
    ids=["text", "columns", "rows"],
)
def test_what_a_workbook_cannot_hold_is_one_line_and_leaves_nothing(tmp_path, rows, told):
    content = Content(list(rows[0]), rows, lambda: ())
    with pytest.raises(InputError, match=told) as error:
        write_content(content, tmp_path / "r.xlsx")
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_the_longest_text_is_held(tmp_path):
    assert cells_of(written(tmp_path, [{"a": "x" * 32_767}]))[1] == ["x" * 32_767]


@pytest.mark.parametrize("ending", ["xlsx", "mat"])
def test_the_same_result_is_the_same_bytes(tmp_path, make_estimate, ending, monkeypatch):
    result = Estimates((make_estimate(keys={"condition": "a"}),))
    result.write(tmp_path / f"one.{ending}")
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.asctime", lambda *_: "later")
    result.write(tmp_path / f"two.{ending}")
    one, two = (tmp_path / f"{name}.{ending}" for name in ("one", "two"))
    assert one.read_bytes() == two.read_bytes()


def test_checks_methods_and_provenance_stand_beside_the_numbers(tmp_path, make_estimate):
    made = [make_estimate(keys={"condition": n}, warnings=("too few", n)) for n in ("a", "b")]
    checks = (Finding("delay", "ok", "0.1 ms", smallest="0.3 ms"),)
    about = About(made=(("seed", "3"),), checks=checks)
    Estimates(tuple(made)).write(tmp_path / "r.xlsx", about=about)
    told = cells_of(tmp_path / "r.xlsx", "checks")[1:]
    assert told[0][:4] == ["ok", "delay", "0.1 ms", "0.3 ms"]
    assert ["warning", None, "too few", None, "all rows"] in told
    assert [row[4] for row in told if row[2] == "b"] == ["b"]
    methods = dict(cells_of(tmp_path / "r.xlsx", "methods"))
    assert "delay" in methods["methods"]
    assert methods["seed"] == "3"
    assert methods["software"].startswith("armimpedance ")


def test_the_header_stays_and_numbers_show_digits_of_their_size(tmp_path, make_estimate):
    Estimates((make_estimate(keys={"condition": "a"}),)).write(tmp_path / "r.xlsx")
    book = openpyxl.load_workbook(tmp_path / "r.xlsx")
    assert all(page.freeze_panes.endswith("2") for page in book)
    page = book["intervals"]
    header = [cell.value for cell in page[1]]
    for row in page.iter_rows(min_row=2):
        value = row[header.index("value")]
        half = row[header.index("upper 95 %")].value
        if half is not None and value.number_format.startswith("0.0"):
            half -= value.value
            step = 10.0 ** -(len(value.number_format) - 2)
            assert step <= 10 * half


@pytest.mark.study
def test_a_large_table_is_written_in_little_time_and_memory(tmp_path):
    import time
    import tracemalloc

    rows = [{"trial": i, "x": i / 7, "y": -i / 3} for i in range(5_000)]
    content = table_content(rows, quantities=lambda: ())
    tracemalloc.start()
    start = time.perf_counter()
    write_content(content, tmp_path / "r.xlsx")
    seconds, (_, peak) = time.perf_counter() - start, tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 10e6
    assert seconds < 30
