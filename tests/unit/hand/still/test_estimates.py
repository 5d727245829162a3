"""Estimates: found by their names, shown with intervals, written as the command writes them."""

import json

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.show import Estimates, plot_intervals, read_results, write_results


@pytest.fixture
def hand(make_estimate):
    keys = [{"condition": "relaxed"}, {"condition": "stiff"}]
    return Estimates([make_estimate(seed=i, keys=k) for i, k in enumerate(keys)])


def test_a_name_gives_labelled_matrices_and_a_number_the_record(hand):
    named = hand["stiff"]
    assert named.estimate is hand[1] is hand[("stiff",)].estimate
    assert named.quality is hand[1].quality
    K = named.stiffness
    assert (K.symbol, K.unit, K.axes) == ("K", "N/m", ("x", "y"))
    np.testing.assert_array_equal(np.asarray(K), hand[1].stiffness)
    np.testing.assert_array_equal(K.sd, hand[1].sd[2])
    row = hand.to_frame().iloc[1]
    assert K.low[0, 1] == row["ci_low_K_12"]
    assert K.high[1, 0] == row["ci_high_K_21"]
    assert K.to_frame().loc[("x", "y"), "value"] == hand[1].stiffness[0, 1]
    assert repr(K).startswith("K (N/m)")
    assert len(repr(K).splitlines()) == 3
    assert named.ellipse().size > 0


def test_iteration_and_slices_give_plain_records(hand):
    assert list(hand) == [hand[0], hand[1]] == list(hand[:])
    assert isinstance(hand[1:], Estimates)


@pytest.mark.parametrize("name", ["tense", ("relaxed", "weighted"), ("tense",)])
def test_an_unknown_name_lists_the_names(hand, name):
    with pytest.raises(InputError, match="'relaxed', 'stiff'"):
        hand[name]


def test_names_of_several_columns(make_estimate):
    keys = [{"recording": d, "condition": c} for d in ("mon", "tue") for c in ("a", "b")]
    hand = Estimates([make_estimate(seed=i, keys=k) for i, k in enumerate(keys)])
    assert hand["tue", "a"].estimate is hand[2]
    with pytest.raises(InputError, match=r"several groups .*\('mon', 'a'\)"):
        hand["a"]


def test_the_method_tells_estimates_of_one_group_apart(make_estimate):
    same = [make_estimate(method=m, keys={"condition": "a"}) for m in ("exact", "paper")]
    hand = Estimates(same)
    assert hand["a", "paper"].estimate is hand["paper"].estimate is hand[1]


def test_labels_of_joints_and_muscles(make_estimate):
    joint = Estimates([make_estimate(level="joint", keys={"condition": "a"})])
    assert joint["a"].stiffness.axes == ("shoulder", "elbow")
    muscles = Estimates([make_estimate(level="muscle", muscles=("<b>", "m"), keys={"c": "a"})])
    assert muscles["a"].stiffness.axes == ("<b>", "m")
    assert "<b>" not in muscles["a"]._repr_html_()


def test_files_are_those_of_the_command(hand, tmp_path):
    hand.to_csv(tmp_path / "a.csv")
    write_results(list(hand), tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    hand.write(tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == hand.to_dict()
    hand.write(tmp_path / "a.parquet")
    frame = hand.to_frame()
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "a.parquet"), frame)
    header = (tmp_path / "a.csv").read_text().splitlines()[0]
    assert header.split(",") == list(frame.columns)
    assert float(frame["K_11"][0]) == read_results(tmp_path / "a.csv")[0].stiffness[0, 0]
    with pytest.raises(InputError, match="ends in .csv"):
        hand.to_csv(tmp_path / "a.json")
    with pytest.raises(InputError, match="txt"):
        hand.write(tmp_path / "a.txt")


def test_the_short_texts_are_short_and_escaped(make_estimate):
    many = Estimates([make_estimate(keys={"condition": f"<i>{n}</i>"}) for n in range(30)])
    assert len(repr(many).splitlines()) <= 12
    assert "20 of them not shown" in repr(many)
    assert "<i>" not in many._repr_html_()


def test_an_estimate_in_full_and_intervals_over_the_groups(hand):
    assert "stiffness K (N/m)" in str(hand["stiff"])
    ax = plot_intervals(hand, "K_22")
    assert [label.get_text() for label in ax.get_yticklabels()] == ["relaxed", "stiff"]


def test_a_fit_shows_itself_in_few_lines():
    from armimpedance.numerics.regression import fit, trial_factors

    rng = np.random.default_rng(0)
    W = rng.standard_normal((5, 40, 13))
    names = [f"a{i}" for i in range(13)]
    made = fit(trial_factors(W, W[..., :1], regressors=names, outputs=["y"]))
    assert len(repr(made).splitlines()) == 12
    assert list(made.to_frame().index) == names == [one["name"] for one in made.to_dict()]
