"""Workbooks open in LibreOffice and structs in Octave, with the numbers that Python has."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import NAMES


@pytest.fixture(scope="module")
def sheets(hand, in_calc, tmp_path_factory):
    path = tmp_path_factory.mktemp("book") / "results.xlsx"
    hand.write(path)
    return in_calc(path)


def as_table(rows):
    header, *body = rows
    return [dict(zip(header, row, strict=True)) for row in body]


def test_every_number_of_the_results_is_the_same_in_calc(sheets, hand):
    frame = hand.to_frame()
    for shown, (_, row) in zip(as_table(sheets["results"]), frame.iterrows(), strict=True):
        for name, cell in row.items():
            if isinstance(cell, float) and not np.isnan(cell):
                # Calc itself writes 15 digits
                assert float(shown[name]) == pytest.approx(cell, rel=1e-14), name


def test_names_that_look_like_formulas_stay_text_in_calc(sheets):
    shown = [row["condition"] for row in as_table(sheets["results"])]
    assert shown == list(NAMES)


def test_intervals_are_those_of_the_long_table(sheets, hand):
    known = {(str(r.condition), r.quantity): r for r in hand.to_long().itertuples()}
    rows = as_table(sheets["intervals"])
    assert len(rows) > 20 * len(NAMES)
    for row in rows:
        one = known[row["condition"], row["symbol"]]
        assert float(row["value"]) == pytest.approx(one.value, rel=1e-14)
        assert row["unit"] == one.unit
        if row["lower 95 %"]:
            assert float(row["lower 95 %"]) == pytest.approx(one.lower, rel=1e-14)
            assert float(row["upper 95 %"]) == pytest.approx(one.upper, rel=1e-14)


def test_the_sheets_are_there_and_no_cell_is_an_error(sheets):
    assert {"results", "intervals", "methods", "provenance", "columns"} <= set(sheets)
    cells = [cell for rows in sheets.values() for row in rows for cell in row]
    assert not [cell for cell in cells if cell.startswith(("#", "Err:"))]


def test_structs_open_in_octave_with_units(hand, in_octave, tmp_path):
    hand.write(tmp_path / "results.mat")
    printed = in_octave(
        tmp_path,
        "load results.mat;",
        "for r = results,",
        "  assert(all(all(r.stiffness_lower < r.stiffness & r.stiffness < r.stiffness_upper)));",
        "  assert(issymmetric(r.covariance) && rows(r.covariance) == 12);",
        "  assert(iscellstr(r.warnings) && strcmp(r.units.stiffness, 'N/m'));",
        "  printf('%s|%.17g|%.17g\\n', r.keys.condition, r.stiffness(1, 2), r.quality.dof);",
        "end",
    )
    rows = [line.rsplit("|", 2) for line in printed.splitlines()]
    assert [name for name, *_ in rows] == list(NAMES)
    assert [float(k) for _, k, _ in rows] == [one.stiffness[0, 1] for one in hand]
    assert [float(dof) for *_, dof in rows] == [one.dof for one in hand]
