"""The page to play with: what it computes is what Python predicts, and it can be used by anyone."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from conftest import HOSTILE, violations
from models_to_explore import SUBJECT, fitted, measured_hand

from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.ellipses import locus
from armimpedance.hand.levels import kinematic_arm
from armimpedance.hand.show import confidence_band
from armimpedance.limb.arm import hand_inertia
from armimpedance.muscles.models import at_hand, triple
from armimpedance.muscles.show import write_explore
from armimpedance.numerics.regression import t_factor

ARM = kinematic_arm(SUBJECT)
KINDS = ("moment-arms", "activation", "muscles")
#: Width of A4 less the margins of the page's style, CSS pixels.
PAPER_PX = round((210 - 2 * 14) / 25.4 * 96)
#: What the page's numbers may differ by, as a part of the largest element.
ALIKE = 1e-9
#: Hundreds of places at once, without a browser.
DRIVER = """
import { readFileSync } from "fs";
const { arm, models, points } = JSON.parse(readFileSync(process.argv[2]));
console.log(JSON.stringify(models.map((raw, i) => points[i].map(({ place, alpha, F }) => {
  const model = opened(raw);
  const q = model.joint_angles ?? anglesOf(arm, place);
  const made = predicted(model, arm, q, alpha, F);
  const { value, covariance } = made.hand.K;
  return { ...made, q, F, alpha, locus: locus(value, 361),
    M: times(toHand(arm, q), jointInertia(arm, q)),
    band: ellipseOf(value) ? bandOf(value, covariance, made.t, 361) : null };
}))));
"""


@pytest.fixture(scope="module")
def models():
    return fitted()


@pytest.fixture(scope="module")
def page_of(models, tmp_path_factory):
    """One page of all kinds with measured rows, one of a hostile name."""
    path = tmp_path_factory.mktemp("explore") / "explore.html"
    write_explore([*models.values(), measured_hand(HOSTILE)], path, recording=SUBJECT)
    return path


def alike(page, python):
    theirs = np.asarray(python, dtype=float)
    return np.abs(np.asarray(page) - theirs).max() <= ALIKE * np.abs(theirs).max()


def check(state, model, arm=ARM):
    """The numbers of one state of the page against `predict` and `at_hand`."""
    asked = {"moment-arms": ["q"], "activation": ["alpha"], "muscles": ["q", "alpha"]}
    joint = model.predict(*(state[name] for name in asked[state["kind"]]))
    hand = at_hand(joint, arm, state["F"])
    for level, theirs in (("joint", joint), ("hand", hand)):
        for symbol, which in (("K", "stiffness"), ("B", "viscosity")):
            made = state[level][symbol]
            assert alike(made["value"], getattr(theirs, which)[0])
            assert alike(made["half"], theirs.half_width(which)[0])
    if state["parts"]:
        check_parts(state, model, joint)
    assert state["reason"] == joint.reasons[0]
    assert state["extrapolated"] == bool(joint.extrapolated[0])
    return hand


def check_parts(state, model, joint):
    """What makes up K: it adds up, and each muscle's part has the interval of its own numbers."""
    assert alike(sum(np.array(part["value"]) for part in state["parts"]), joint.stiffness[0])
    alpha = np.array([state["alpha"]])
    if state["kind"] == "activation":
        value, sd = model.muscle_stiffness(alpha)[0], model.muscle_stiffness_sd(alpha)[0]
        expected = zip(value[:, None] * model.patterns, sd[:, None] * model.patterns, strict=True)
    else:
        form = model.equations.at(np.array([state["q"]]), alpha)
        expected = [part_of(form, model, muscle) for muscle in model.muscles]
    for part, (value, sd) in zip(state["parts"][1:], expected, strict=True):
        tiny = ALIKE * np.abs(joint.stiffness[0]).max()
        assert np.abs(part["value"] - value).max() <= tiny
        assert np.abs(part["half"] - t_factor(model.dof) * np.abs(sd)).max() <= tiny


def part_of(form, model, muscle):
    """What K loses without a muscle's stiffness, and its standard error."""
    named = [p.name for p in model.summary.parameters[: len(model.values)]]
    rising = np.array([name.startswith(f"f_{muscle}_") for name in named])
    own = rising | np.array([name.startswith(f"arm_{muscle}_") for name in named])
    K, slope = form.stiffness(model.values)
    without, _ = form.stiffness(np.where(rising, 0.0, model.values))
    covariance = model.covariance[np.ix_(own, own)]
    variance = np.einsum("ei,ij,ej->e", slope[0][:, own], covariance, slope[0][:, own])
    return K[0] - without[0], np.sqrt(np.maximum(variance, 0.0))


def check_outline(state, hand):
    """The ellipse and its band against those of the figures."""
    K = hand.stiffness_matrices[0]
    assert alike(state["locus"], locus(K, 361))
    if np.linalg.eigvalsh(K)[0] <= 0:
        assert state["band"] is None
        return
    covariance = np.zeros((12, 12))
    covariance[8:, 8:] = hand.element_covariance("stiffness")[0]
    quality = Quality(1, 1, 1.0, 1.0, 1.0, 1.0, 6, 1.0)
    none = np.eye(2)
    estimate = ImpedanceEstimate("hand", "-", none, none, K, covariance, hand.dof, quality)
    inner, outer = confidence_band(estimate, "stiffness", 361)
    assert alike(state["band"]["inner"], inner)
    assert alike(state["band"]["outer"], outer)


@pytest.mark.skipif(shutil.which("node") is None, reason="no node: the browser checks a few places")
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (1.0, -9.7)], ids=["flat", "upright"])
def test_the_scripts_numbers_are_pythons_at_a_hundred_places(models, page_of, gravity, tmp_path):
    arm = replace(ARM, gravity_m_s2=gravity)
    rng = np.random.default_rng(11)
    found = re.search(r'id="more">(.*?)</script>', page_of.read_text(encoding="utf-8"), re.DOTALL)
    more = json.loads(found[1])
    more["arm"]["gravity_m_s2"] = gravity
    points = [
        [
            {
                "place": (r * np.array([np.cos(a), np.sin(a)])).tolist(),
                "alpha": rng.uniform(0, 0.4, len(getattr(model, "muscles", ()))).tolist(),
                "F": rng.normal(0, 15, 2).tolist(),
            }
            for r, a in rng.uniform([0.1, -0.2], [0.62, np.pi], (100, 2))
        ]
        for model in models.values()
    ]
    (tmp_path / "in.json").write_text(json.dumps({**more, "points": points}))
    assets = files("armimpedance.show.pages").joinpath("assets")
    scripts = [assets.joinpath(name).read_text() for name in ("arm.js", "models.js")]
    (tmp_path / "all.mjs").write_text("\n".join([*scripts, DRIVER]))
    command = ["node", str(tmp_path / "all.mjs"), str(tmp_path / "in.json")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    for (kind, model), states in zip(models.items(), json.loads(done.stdout), strict=True):
        for state in states:
            q = np.array(state["q"])
            hand = check({**state, "kind": kind}, model, arm)
            check_outline(state, hand)
            assert alike(state["M"], triple(hand_inertia(arm.jacobian(q), arm.inertia(q))))


def state_of(page):
    return page.evaluate("window.exploreState")


def drag(page, handle, dx, dy):
    box = page.locator(f"#workspace .{handle} circle").last.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=3)
    page.mouse.up()


@pytest.mark.parametrize("kind", KINDS)
def test_hand_force_and_muscles_are_moved_and_the_numbers_are_pythons(
    opened, page_of, models, kind
):
    seen = opened(page_of, width=1300)
    page = seen.page
    page.select_option("#model", index=KINDS.index(kind))
    before = state_of(page)
    rng = np.random.default_rng(KINDS.index(kind))
    for _ in range(6):
        drag(page, "hand", *rng.uniform(-90, 90, 2))
        drag(page, "tip", *rng.uniform(-60, 60, 2))
        for slider in page.locator("#muscles input:not(#all_muscles)").all():
            slider.fill(
                str(round(rng.uniform(0, float(slider.get_attribute("max"))) / 0.005) * 0.005)
            )
        state = state_of(page)
        assert state["kind"] == kind
        check(state, models[kind])
        assert np.hypot(*state["F"]) > 0
        said = page.locator("#state").inner_text()
        assert (state["reason"] or "Inside") in said
    moved = not np.allclose(state["q"], before["q"])
    assert moved == (kind != "activation")
    assert seen.console == seen.beyond_the_file == seen.dialogs == []


def test_the_keyboard_moves_hand_and_force(opened, page_of):
    page = opened(page_of).page
    page.locator("#workspace .hand").focus()
    x, y = state_of(page)["place"]
    page.keyboard.press("ArrowLeft")
    page.keyboard.press("Shift+ArrowUp")
    assert state_of(page)["place"] == pytest.approx([x - 0.010, y + 0.001])
    page.locator("#workspace .tip").focus()
    page.keyboard.press("ArrowDown")
    assert state_of(page)["F"] == [0, -1]
    page.locator("#force_x").fill("12.5")
    assert state_of(page)["F"] == [12.5, -1]
    page.wait_for_function("document.getElementById('aloud').textContent.includes('major axis')")


def test_the_hand_stays_within_reach(opened, page_of):
    page = opened(page_of).page
    drag(page, "hand", 2000, -2000)
    assert np.hypot(*state_of(page)["place"]) == pytest.approx(0.31 + 0.33, abs=2e-4)
    assert "Extrapolated" in page.locator("#state").inner_text()


def test_a_measured_condition_is_gone_to_and_its_name_stays_text(opened, page_of):
    seen = opened(page_of)
    page = seen.page
    page.select_option("#model", index=2)
    page.select_option("#condition", index=1)
    row = measured_hand(HOSTILE)[0]
    state = state_of(page)
    assert state["q"] == pytest.approx(row.joint_angles)
    assert state["F"] == pytest.approx(row.force)
    assert state["alpha"] == pytest.approx(row.activation)
    assert HOSTILE in page.locator("#hand_table").inner_text()
    assert page.locator("#workspace .measured.chosen").count() == 1
    assert page.locator("img").count() == 0
    assert seen.dialogs == []


def test_a_hostile_muscle_stays_text_and_the_page_fits_on_paper(opened, models, tmp_path):
    activation = models["activation"]
    hostile = replace(activation, muscles=(HOSTILE, *activation.muscles[1:]))
    write_explore(hostile, tmp_path / "page.html", recording=SUBJECT)
    seen = opened(tmp_path / "page.html", width=PAPER_PX)
    page = seen.page
    page.locator("#muscles input").nth(1).fill("0.5")
    for place in ("#muscles", "#parts_table", "#state"):
        assert HOSTILE.partition("$")[0] in page.locator(place).inner_text()
    page.emulate_media(media="print")
    right = page.evaluate(
        "[...document.querySelectorAll('table, svg')].map((e) => e.getBoundingClientRect().right)"
    )
    assert max(right) <= PAPER_PX
    assert seen.console == seen.dialogs == []


def test_results_alone_show_the_arm_and_what_was_measured(opened, tmp_path):
    path = tmp_path / "hand.html"
    write_explore(measured_hand("relaxed"), path)
    seen = opened(path)
    assert seen.page.locator("#workspace .measured").count() == 2
    drag(seen.page, "hand", 30, 30)
    assert "No model" in seen.page.locator("#state").inner_text()
    assert "mm away" in seen.page.locator("#state").inner_text()
    assert seen.console == []


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_axe_finds_nothing_serious(opened, page_of, dark):
    page = opened(page_of, dark=dark).page
    page.select_option("#model", index=2)
    page.select_option("#condition", index=1)
    found = violations(page)
    serious = [v for v in found if v["impact"] in ("serious", "critical")]
    assert [(v["id"], v["nodes"][0]["html"][:120]) for v in serious] == []


def test_a_page_of_three_models_is_small(page_of):
    assert page_of.stat().st_size < 300_000
