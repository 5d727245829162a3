"""Estimates: found by their names, shown with intervals, written as the command writes them."""

import copy
import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.hand.show import (
    Estimates,
    LabelledEstimate,
    plot_intervals,
    read_results,
    write_results,
)


@pytest.fixture
def hand(make_estimate):
    keys = [{"condition": "relaxed"}, {"condition": "stiff"}]
    return Estimates([make_estimate(seed=i, keys=k) for i, k in enumerate(keys)])


def test_a_name_and_a_number_give_labelled_matrices(hand):
    named = hand["stiff"]
    assert named is hand[1] is hand[("stiff",)]
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


def test_iteration_slices_and_items_give_the_same_estimates(hand):
    assert list(hand) == [hand[0], hand[1]] == list(hand[:])
    assert isinstance(hand[1:], Estimates)
    assert hand.items() == list(zip(hand.names, hand, strict=True))
    assert hand[["stiff"]][0] is hand["stiff"]
    assert {type(one) for one in (*hand, hand[0], hand["stiff"], hand[1:][0])} == {LabelledEstimate}


def test_a_labelled_matrix_is_the_matrix_and_what_is_made_of_it_is_plain(hand):
    K = hand[0].stiffness
    plain = K.value
    assert type(plain) is np.ndarray
    for made in (K @ K, K + 1, K.T, K[0], np.linalg.inv(K), K[:, 0]):
        assert type(made) is np.ndarray
    assert isinstance(K[0, 1], float)
    assert isinstance(K.sum(), float)
    assert repr(K.copy()) == repr(plain)
    with pytest.raises(ValueError, match="read-only"):
        K += 1


def test_an_estimate_keeps_its_labels_where_it_is_changed_or_sent(hand):
    changed = replace(hand[0], keys={"condition": "other"})
    sent = copy.deepcopy(hand[0])
    for one in (changed, sent):
        assert one.stiffness.unit == "N/m"
        np.testing.assert_array_equal(one.stiffness.low, hand[0].stiffness.low)


@pytest.mark.parametrize("given", [42, ["near"], {"a": 1}, [1.0, 2.0]])
def test_what_is_no_estimate_is_a_type_error_that_says_what_it_is(given):
    for take in (ai.plot_ellipses, ai.to_joint, ai.compare, ai.fit_posture):
        with pytest.raises((TypeError, InputError), match="no such file|int|list|dict|float"):
            take(given)
    with pytest.raises(TypeError, match=f"{type(given).__name__}.*ai.recording"):
        ai.estimate(given)


def test_one_estimate_stands_for_a_list_of_it(hand):
    assert ai.plot_ellipses(hand["stiff"]).lines
    assert ai.plot_ellipse(hand["stiff"]).lines


@pytest.mark.parametrize("name", ["tense", ("relaxed", "weighted"), ("tense",)])
def test_an_unknown_name_lists_the_names(hand, name):
    with pytest.raises(InputError, match="'relaxed', 'stiff'"):
        hand[name]


def test_names_of_several_columns(make_estimate):
    keys = [{"recording": d, "condition": c} for d in ("mon", "tue") for c in ("a", "b")]
    hand = Estimates([make_estimate(seed=i, keys=k) for i, k in enumerate(keys)])
    assert hand["tue", "a"] is hand[2]
    assert hand[["a", "b"][:0]].names == ()
    assert hand[[("mon", "a"), ("tue", "b")]].names == (hand.names[0], hand.names[3])
    assert hand.where(condition="a").names == hand[::2].names
    assert hand.where(condition=["a", "b"], recording="mon").names == hand[:2].names
    with pytest.raises(InputError, match="'day'.*recording"):
        hand.where(day=1)
    with pytest.raises(InputError, match=r"several groups .*\('mon', 'a'\)"):
        hand["a"]


def test_the_method_tells_estimates_of_one_group_apart(make_estimate):
    same = [make_estimate(method=m, keys={"condition": "a"}) for m in ("exact", "paper")]
    hand = Estimates(same)
    assert hand["a", "paper"] is hand["paper"] is hand[1]


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
