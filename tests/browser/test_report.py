"""The report page in a real browser."""

from __future__ import annotations

import io
import json

import matplotlib.image
import numpy as np
import pytest
from conftest import HOSTILE, violations

#: Width of A4 less the margins of the page's style, CSS pixels.
PAPER_PX = round((210 - 2 * 14) / 25.4 * 96)
#: A point of a path, where its line is.
ON_THE_LINE = """(path) => {
  path.scrollIntoView({ block: "center" });
  const at = path.getPointAtLength(path.getTotalLength() / 2);
  const place = new DOMPoint(at.x, at.y).matrixTransform(path.getScreenCTM());
  return [place.x, place.y];
}"""


def colours(element):
    """How many colours a screenshot of an element has."""
    pixels = matplotlib.image.imread(io.BytesIO(element.screenshot()), format="png")
    return len(np.unique((255 * pixels[..., :3]).astype(int).reshape(-1, 3), axis=0))


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_is_said_or_asked_and_every_picture_is_there(opened, report, dark):
    seen = opened(report, dark=dark)
    pictures = seen.page.query_selector_all("figure img, .vega svg.marks")
    assert len(pictures) >= 5
    for picture in pictures:
        assert picture.is_visible()
        assert colours(picture) > 10
    assert seen.console == []
    assert seen.beyond_the_file == []
    assert seen.dialogs == []


def test_a_value_under_the_pointer_is_told_with_its_interval(opened, report):
    page = opened(report).page
    page.locator(".vega svg.marks .mark-symbol path").first.hover()
    said = page.locator(".pointer").inner_text()
    assert "95 %" in said
    assert "size" in said


def test_a_choice_in_the_table_shows_in_every_panel_and_can_be_taken_back(opened, report):
    page = opened(report).page
    faint = "path[opacity='0.12'], line[opacity='0.12']"
    assert page.locator(faint).count() == 0
    page.locator("button.choose", has_text="stiff").first.click()
    page.wait_for_selector(".choose[aria-pressed=true]")
    page.wait_for_function(f"document.querySelectorAll({json.dumps(faint)}).length >= 4")
    assert page.locator(".choose[aria-pressed=true]").count() == 3
    page.locator("button.choose", has_text="stiff").first.click()
    page.wait_for_function(f"document.querySelectorAll({json.dumps(faint)}).length === 0")


def test_trials_of_the_chosen_group_are_shown_and_one_can_be_picked(opened, report):
    page = opened(report).page
    panels = page.locator(".vega").nth(1).locator("svg.marks .mark-line path")
    before = panels.first.get_attribute("d")
    page.locator("button.choose", has_text="stiff").first.click()
    page.wait_for_function(
        "old => document.querySelectorAll('.vega')[1].querySelector('.mark-line path')"
        ".getAttribute('d') !== old",
        arg=before,
    )
    page.mouse.click(*panels.first.evaluate(ON_THE_LINE))
    page.wait_for_selector(".vega path[stroke-width='3']")


def test_the_keyboard_reaches_everything(opened, report):
    page = opened(report).page
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    page.locator("button.choose").first.focus()
    page.keyboard.press("Enter")
    assert page.locator(".choose[aria-pressed=true]").count() == 3
    assert page.locator("#said").inner_text().endswith("is chosen")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious(opened, report, dark):
    page = opened(report, dark=dark).page
    found = violations(page)
    serious = [v for v in found if v["impact"] in ("serious", "critical")]
    told = [(v["id"], v["nodes"][0]["html"][:120]) for v in serious]
    assert told == []


def test_a_hostile_name_stays_text(opened, report):
    seen = opened(report)
    assert HOSTILE in seen.page.locator("table").first.inner_text()
    seen.page.locator("button.choose").first.click()
    assert HOSTILE in seen.page.locator("#said").inner_text()
    assert seen.page.locator("img[src=x]").count() == 0
    assert seen.dialogs == []


def test_no_picture_is_cut_on_paper(opened, report, tmp_path):
    page = opened(report, width=PAPER_PX).page
    page.emulate_media(media="print")
    right = page.evaluate(
        "[...document.querySelectorAll('figure img, .vega svg')]"
        ".map((e) => e.getBoundingClientRect().right)"
    )
    assert right
    assert max(right) <= PAPER_PX
    page.pdf(path=tmp_path / "report.pdf", format="A4", prefer_css_page_size=True)
    assert (tmp_path / "report.pdf").stat().st_size > 20_000


def test_numbers_and_pictures_can_be_saved(opened, report, tmp_path):
    page = opened(report).page
    with page.expect_download() as saved:
        page.locator("[data-csv=results]").first.click()
    saved.value.save_as(tmp_path / "results.csv")
    header, *rows = (tmp_path / "results.csv").read_text().splitlines()
    assert header.startswith("condition,n_trials")
    assert len(rows) == 2
    assert rows[0].startswith('"<img')
    for kind in ("svg", "vega"):
        with page.expect_download() as saved:
            page.locator(f"[data-{kind}]").first.click()
        saved.value.save_as(tmp_path / f"{kind}.svg")
        assert "<svg" in (tmp_path / f"{kind}.svg").read_text()[:2000]


@pytest.mark.parametrize("kind", ["svg", "vega"])
def test_a_picture_is_saved_for_print_with_three_hundred_dots_an_inch(
    opened, report, tmp_path, kind
):
    page = opened(report).page
    button = page.locator(f"[data-{kind}][data-png]").first
    with page.expect_download() as saved:
        button.click()
    saved.value.save_as(tmp_path / "picture.png")
    pixels = matplotlib.image.imread(tmp_path / "picture.png")
    height, width = pixels.shape[:2]
    whole = button.locator("xpath=ancestor::figure").locator("img, svg.marks").first
    box = whole.evaluate(
        "e => [e.naturalWidth ?? e.clientWidth, e.naturalHeight ?? e.clientHeight]"
    )
    np.testing.assert_allclose([width, height], np.multiply(box, 300 / 96), rtol=0.01)
    assert len(np.unique(pixels[..., 0])) > 20
