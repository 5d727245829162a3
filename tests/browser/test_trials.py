"""The page of trials in a real browser: look, leave out with a key, save the list."""

from __future__ import annotations

from dataclasses import replace

import pytest
from conftest import HOSTILE, violations

from armimpedance.hand.still.show import write_choice
from armimpedance.show.verbs.results import without_trials
from manipulandum_sim.hand import simulate


@pytest.fixture(scope="module")
def session():
    recording, _ = simulate("cocontraction", seed=5, sets=1, conditions=["cocontraction_10"])
    return replace(recording, trials=recording.trials.assign(condition=HOSTILE))


@pytest.fixture(scope="module")
def choice(session, tmp_path_factory):
    path = tmp_path_factory.mktemp("trials") / "choice.html"
    write_choice(session, path, HOSTILE, {2: "before"})
    return path


def test_a_key_leaves_a_trial_out_and_the_saved_list_is_read(opened, choice, session, tmp_path):
    seen = opened(choice)
    page = seen.page
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    third = page.locator("#list button").nth(2)
    assert third.get_attribute("aria-current") == "true"
    page.keyboard.press("x")
    page.locator("#why").fill("coughed")
    assert page.locator("#count").inner_text().startswith("2 of 8")
    with page.expect_download() as saved:
        page.locator("#save").click()
    saved.value.save_as(tmp_path / "left_out.csv")
    kept = without_trials(session, tmp_path / "left_out.csv")
    assert kept.n_trials == 6
    assert "coughed" in kept.provenance[-1]
    assert "before" in kept.provenance[-1]
    assert seen.console == []
    assert seen.beyond_the_file == []
    assert seen.dialogs == []


def test_what_is_left_out_can_be_taken_back(opened, choice):
    page = opened(choice).page
    page.locator("#list button").nth(1).click()
    assert page.locator("#toggle").inner_text() == "Take back"
    page.locator("#toggle").click()
    assert page.locator("#count").inner_text().startswith("0 of 8")


def test_every_trial_is_drawn_in_four_panels(opened, choice):
    page = opened(choice).page
    for number in range(8):
        page.locator("#list button").nth(number).click()
        drawn = page.locator("#panels path.own")
        assert drawn.count() == 4
        assert all(len(path.get_attribute("d")) > 200 for path in drawn.all())


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious(opened, choice, dark):
    page = opened(choice, dark=dark).page
    found = violations(page)
    told = [(v["id"], v["nodes"][0]["html"][:120]) for v in found if v["impact"] != "minor"]
    assert [one for one in told if one[0] != "region"] == []
