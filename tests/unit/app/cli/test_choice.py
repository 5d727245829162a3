"""The same options choose trials in every analysis, and a word that nearly fits is named."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from sessions import pushes

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.app.cli.main import COMMANDS, make_parser
from armimpedance.core.errors import InputError
from armimpedance.show.verbs.chosen import ChosenPath
from manipulandum_sim.passive import simulate_passive


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("choice") / "session"
    ai.write_recording(pushes(), folder)
    return folder


def conditions(path):
    return sorted(set(pd.read_csv(path)["condition"]))


@pytest.mark.usefixtures("undrawn")
def test_where_is_the_same_in_every_analysis(session, tmp_path, run):
    only = ["--where", "condition == 'cocontraction_10'"]
    out = tmp_path / "a.csv"
    assert run("estimate", session, *only, "--out", out) == 0
    assert conditions(out) == ["cocontraction_10"]
    assert run("compare", session, "--by", "set", *only, "--permutations", 9) == 0
    assert run("reflex", session, *only) == 0
    assert run("report", session, *only, "--out", tmp_path / "c.html") == 0
    assert "cocontraction_30" not in (tmp_path / "c.html").read_text()


def test_trials_that_are_left_out_are_left_out_of_a_comparison(session, tmp_path, run):
    (tmp_path / "left.csv").write_text("trial,why\n1,cough\n2,\n")
    for more in ([], ["--leave-out", tmp_path / "left.csv"]):
        out = tmp_path / f"{len(more)}.csv"
        assert run("compare", session, *more, "--out", out, "--permutations", 9) == 0
    whole, part = (pd.read_csv(tmp_path / f"{n}.csv") for n in (0, 2))
    assert len(whole) == len(part)
    assert not np.allclose(whole["change"], part["change"], equal_nan=True)
    kept = ai.estimate(session, leave_out=[1, 2])
    changed = ai.estimate(ChosenPath.of(session, None, None, tmp_path / "left.csv"))
    np.testing.assert_array_equal(kept[0].stiffness, changed[0].stiffness)


def test_a_choice_that_cannot_be_made_is_one_line(session, tmp_path, refusal):
    assert "zone" in refusal("compare", session, "--where", "zone == 'a'")
    (tmp_path / "left.csv").write_text("trial,why\n999,\n")
    assert "999" in refusal("reflex", session, "--leave-out", tmp_path / "left.csv")


def test_results_hold_no_trials_to_choose_from(session, tmp_path, refusal):
    out = tmp_path / "hand.csv"
    ai.estimate(session).to_csv(out)
    (tmp_path / "left.csv").write_text("trial,why\n1,\n")
    page = ("--out", tmp_path / "page.html")
    for line in (
        ("compare", out, "--where", "set == 1"),
        ("compare", out, "--leave-out", tmp_path / "left.csv"),
        ("report", out, "--where", "set == 1", *page),
        ("report", out, "--leave-out", tmp_path / "left.csv", *page),
    ):
        assert line[2] in refusal(*line)


def test_a_path_with_a_choice_is_a_path(session):
    chosen = ChosenPath.of(session, "set == 1", None, None)
    assert chosen == session
    assert str(chosen) == str(session)
    assert chosen.parent == session.parent
    assert ai.read(chosen).n_trials == ai.read(session).n_trials / 2
    assert ChosenPath.of(session, None, None, None) is session


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    folder = tmp_path_factory.mktemp("swing") / "p5"
    ai.write_recording(simulate_passive("p5", duration_s=1.0)[0], folder)
    return folder


def test_a_swing_has_no_numbered_trials(swing):
    with pytest.raises(InputError, match="numbered trials"):
        ai.read(ChosenPath.of(swing, None, None, swing / "none.csv"))


@pytest.fixture
def run():
    return lambda *words: main([str(word) for word in words])


@pytest.mark.parametrize(
    ("call", "near"),
    [
        (["estimat"], "estimate"),
        (["map-colums"], "map-columns"),
        (["estimate", "x", "--methd", "exact"], "--method"),
        (["therapy", "robt"], "robot"),
        (["therapy", "robot", "x", "--drawings", "y", "--validte", "z"], "--validate"),
    ],
)
def test_a_word_that_nearly_fits_is_named(call, near, refusal):
    line = refusal(*call)
    assert f"did you mean {near}?" in line
    assert len(line) < 200


def test_the_overview_holds_every_command_once():
    overview = make_parser([]).format_help()
    for name in COMMANDS:
        assert overview.count(f"\n  {name} ") == 1, name
