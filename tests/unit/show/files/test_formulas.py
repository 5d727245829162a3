"""Texts that a spreadsheet would run stay text in a CSV file, and come back as they were."""

from __future__ import annotations

import csv

import pytest
from hypothesis import given, strategies as st

from armimpedance.hand.show import read_results, write_results
from armimpedance.show.files.content import guarded, runs_as_formula, unguarded

HOSTILE = ["=1+1", "+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", "\t=1", "'", "''", "'=1", "'-", "＝1"]
HARMLESS = ["", "-5", "+0.5", "-1e-3", "-inf", "a=b", "'a'", "0'", " =1", "007"]


@pytest.mark.parametrize("text", HOSTILE)
def test_a_formula_is_guarded(text):
    assert guarded(text) == f"'{text}"
    assert unguarded(guarded(text)) == text


@pytest.mark.parametrize("text", HARMLESS)
def test_other_texts_stay_as_they_are(text):
    assert guarded(text) == text
    assert unguarded(text) == text


@given(st.one_of(st.text(), st.text(alphabet="='+-@\t\r\n5e.aif＝")))
def test_every_text_comes_back_and_nothing_written_runs(text):
    assert unguarded(guarded(text)) == text
    assert not runs_as_formula(guarded(text))


@pytest.mark.parametrize("number", [-5, -0.25, float("-inf"), True])
def test_numbers_are_no_texts(number):
    assert guarded(number) is number


def test_conditions_come_back_and_the_file_holds_no_formula(tmp_path, make_estimate):
    path = tmp_path / "r.csv"
    names = [name for name in HOSTILE + HARMLESS if name]
    keys = [{"condition": name, "=group": name} for name in names]
    write_results([make_estimate(keys=one) for one in keys], path)
    assert [one.keys["condition"] for one in read_results(path)] == names
    assert "=group" in read_results(path)[0].keys
    with open(path, newline="", encoding="utf-8") as stream:
        cells = [cell for row in csv.reader(stream) for cell in row]
    assert not [cell for cell in cells if runs_as_formula(cell)]
