"""The documentation site, once it is built: ``SITE=out/site make test-browser``."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from conftest import violations

SITE = os.environ.get("SITE", "")
PAGES = [
    "index.html",
    "gallery.html",
    "explanation/hand.html",
    "tutorials/planning.html",
    "reference/api/ai/estimate.html",
    "reference/commands/estimate.html",
]

#: What a visitor types -> the page that answers, which comes first.
ASKED = {
    "force sign": "how_to/force_sign",
    "mat file": "how_to/matlab",
    "Kinarm": "how_to/kinarm",
    "EMG": "how_to/one_joint_emg",
    "joint reflex": "how_to/one_joint_reflex",
    "ellipse": "how_to/figure",
    "units": "reference/conventions",
    "stiffness negative": "how_to/negative_stiffness",
    "how many trials": "how_to/plan",
    "my own robot": "tutorials/own_robot",
    "compare two postures": "how_to/compare",
    "filtered force": "how_to/filtered_force",
    "delayed": "how_to/filtered_force",
    "error bars": "explanation/intervals",
    "confidence interval": "explanation/intervals",
    "Excel": "how_to/results",
    "columns": "reference/columns",
    "which muscles": "how_to/muscle_shares",
    "leave out trials": "how_to/leave_out",
    "STOP": "how_to/despite",
}

pytestmark = pytest.mark.skipif(not SITE, reason="SITE names no built site")


@pytest.fixture
def visit(chromium):
    """Open a page of the site: ``visit(name, width)`` gives the page and what it asked for."""
    contexts = []

    def call(name, *, width=1200, scheme="light"):
        context = chromium.new_context(
            color_scheme=scheme, viewport={"width": width, "height": 900}
        )
        contexts.append(context)
        page, asked = context.new_page(), []
        page.on("request", lambda request: asked.append(request.url))
        file, _, query = name.partition("?")
        page.goto((Path(SITE).absolute() / file).as_uri() + (f"?{query}" if query else ""))
        return page, asked

    yield call
    for context in contexts:
        context.close()


@pytest.mark.parametrize("name", PAGES)
@pytest.mark.parametrize(("width", "scheme"), [(1200, "light"), (1200, "dark"), (390, "light")])
def test_a_page_can_be_read_by_everybody_and_asks_nobody(visit, name, width, scheme):
    page, asked = visit(name, width=width, scheme=scheme)
    found = violations(page)
    assert [v["id"] for v in found if v["impact"] in ("serious", "critical")] == []
    wider = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
    assert page.evaluate(wider) <= 0
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


def test_search_needs_no_network(visit):
    page, asked = visit("search.html?q=reflex")
    # they are added one by one
    page.locator("#search-results li a").nth(10).wait_for()
    assert all(url.startswith("file:") for url in asked)


def test_search_shows_first_the_page_that_answers(visit):
    page, _ = visit("index.html")
    search = (Path(SITE).absolute() / "search.html").as_uri()
    found = {}
    for asked in ASKED:
        page.goto(f"{search}?q={asked.replace(' ', '+')}")
        page.get_by_text("Search finished").first.wait_for()
        first = page.locator("#search-results li > a").first.get_attribute("href")
        found[asked] = first.partition(".html")[0]
    assert found == ASKED


def test_one_finds_the_way_from_the_first_page_to_a_tutorial(visit):
    page, _ = visit("index.html")
    page.get_by_text("I have a Kinarm", exact=True).click(force=True)
    page.wait_for_url("**/tutorials/exam_to_figure.html")
    page.locator("article img").first.wait_for()


def test_a_picture_of_the_gallery_leads_to_its_command(visit):
    page, _ = visit("gallery.html")
    page.locator(".picture-link").first.click()
    page.wait_for_url("**#picture-1")
    page.locator("#picture-1").wait_for()
