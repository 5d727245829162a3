"""The page of a hand that moves says how it was estimated, and counts each reach once."""

from __future__ import annotations

import pytest

import armimpedance as ai
from armimpedance.app.report.write import report_page
from armimpedance.show.pages.asked import Asked
from armimpedance.show.pages.rendering import html_of
from manipulandum_sim.movement import simulate_movement


@pytest.mark.study
def test_the_methods_paragraph_is_that_of_reaches(tmp_path):
    recording, _ = simulate_movement(seed=4, repeats=2, unperturbed=15, phases=(0.4, 0.6))
    found = ai.movement(recording, course=True)
    found.to_csv(tmp_path / "course.csv")
    page = html_of(report_page(Asked((tmp_path / "course.csv",))))
    assert "free reaches" in page
    # 2 phases of 16 pushes, which all rows share
    assert "from 32 pushed reaches" in page
    assert "displacement from rest" not in page
