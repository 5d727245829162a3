"""The figure scripts: each draws, says what is simulated, and shows what the estimates say."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.show.plots.captions import add_caption
from armimpedance.show.plots.style import new_figure, print_style
from armimpedance_figures.build_all import CATALOGUE, chosen
from armimpedance_figures.source_figure import FORMATS, write
from armimpedance_figures.tsuji1997 import (
    fig14_single_joint_activation as fig14,
    over_posture,
    where_models_extrapolate as where,
)
from armimpedance_figures.tsuji1997.every import draw_group, in_groups
from armimpedance_figures.tsuji1997.study import study

pytestmark = pytest.mark.study

#: Of the hand's experiments; the others have tests of their own.
OF_THE_HAND = {name: f for name, f in CATALOGUE.items() if f.study is study}
#: Drawn by nothing but what was there before the models.
ESTIMATES = {name: f for name, f in OF_THE_HAND.items() if f.fit is None}
MODELS = {name: f for name, f in OF_THE_HAND.items() if f.fit is not None}


@pytest.fixture(scope="module")
def studied():
    """One set of disturbances per condition: enough to draw."""
    wanted = {
        "postures": None,
        "cocontraction": ["cocontraction_00", "cocontraction_10", "cocontraction_20"],
        "force": None,
    }
    return {
        name: study(name, subject="C", seed=3, sets=1, conditions=conditions)
        for name, conditions in wanted.items()
    }


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Surfaces of few points: what a figure is made of stays the same."""
    for module in (over_posture, fig14, where):
        monkeypatch.setattr(module, "COUNT", 13)


@pytest.fixture(scope="module")
def given(studied):
    """What each figure's functions are called with."""
    return {f.name: f.given(of(studied, f)) for f in OF_THE_HAND.values()}


def of(studied, figure):
    return [studied[name] for name in figure.experiments]


@pytest.mark.parametrize("figure", ESTIMATES.values(), ids=ESTIMATES)
def test_figure_of_estimates_is_the_same_twice(figure, studied, tmp_path):
    """All three formats twice of one figure; they are written by the same function for all."""
    formats = FORMATS if figure is next(iter(ESTIMATES.values())) else ["svg"]
    first, again = (
        {p.suffix: p.read_bytes() for p in write(figure, of(studied, figure), tmp_path, formats)}
        for _ in range(2)
    )
    assert sorted(first) == sorted([".txt", *(f".{name}" for name in formats)])
    assert first == again
    assert len(first[".svg"]) > 20_000


@pytest.mark.parametrize("figure", MODELS.values(), ids=MODELS)
def test_figure_of_a_model_is_the_same_twice(figure, studied, tmp_path):
    """From the fit on; one format is enough, the others are written by the same function."""
    first, again = (
        {p.suffix: p.read_bytes() for p in write(figure, of(studied, figure), tmp_path, ["svg"])}
        for _ in range(2)
    )
    assert first == again
    assert set(first) == {".svg", ".txt"} | (set() if figure.table is None else {".csv"})
    assert len(first[".svg"]) > 20_000


@pytest.mark.parametrize("figure", OF_THE_HAND.values(), ids=OF_THE_HAND)
def test_caption_says_source_simulation_and_difference(figure, given):
    caption = figure.caption(*given[figure.name])
    for part in ("Tsuji (1997)", "Simulated subject C", "Differs from the source"):
        assert part in caption
    assert "nan" not in caption
    assert "  " not in caption


@pytest.mark.parametrize("words", ["WWWWWW " * 60, "illicit " * 90, "a word of each kind " * 30])
def test_captions_fill_their_lines_and_stay_inside_the_figure(words):
    with print_style():
        figure = new_figure(7.2, 3.0)
        figure.add_subplot()
        add_caption(figure, words)
        figure.draw_without_rendering()
        box = figure.texts[0].get_window_extent()
    assert box.x1 <= figure.bbox.x1
    assert box.x1 > 0.85 * figure.bbox.x1
    assert box.y0 >= 0


@pytest.mark.parametrize("figure", OF_THE_HAND.values(), ids=OF_THE_HAND)
def test_axes_have_units_and_text_is_readable(figure, given):
    drawn = figure.draw(*given[figure.name])
    labels = [ax.get_xlabel() for ax in drawn.axes] + [ax.get_ylabel() for ax in drawn.axes]
    shown = [label for label in labels if label]
    assert shown or "_table" in figure.name
    assert all("(" in label and ")" in label for label in shown)
    for ax in drawn.axes:
        assert ax.title.get_fontsize() >= 7
        assert all(t.get_fontsize() >= 7 for t in ax.texts)


def test_model_inertia_is_that_of_the_simulated_limb(studied):
    """Two ways through Winter's table: forearm and hand by parallel axes in the analysis, by the
    table's own row in the simulator, whose radius of gyration is 8 % smaller: 3 % in Lambda_e."""
    each = studied["postures"]
    for found in each.hand:
        true = each.truth.M_e[each.truth.index(found.keys["condition"])]
        assert np.linalg.norm(each.model_inertia(found) - true) < 0.03 * np.linalg.norm(true)


def test_names_choose_figures():
    assert [f.name for f in chosen(["1997_fig07"])] == ["tsuji1997_fig07_ellipses_over_workspace"]
    assert len(chosen([])) == len(CATALOGUE)
    with pytest.raises(InputError, match="no figure 'fig99'"):
        chosen(["fig99"])


def test_what_cannot_be_drawn_from_a_part_is_left_out_in_words(tmp_path):
    names = ("tsuji1997_fig10_stiffness_over_posture", "tsuji1997_table1_posture_fits")
    some = ["posture_01", "posture_05", "posture_08", "posture_11"]
    few = {"postures": study("postures", subject="C", seed=3, sets=1, conditions=some)}
    every = [draw_group(*group, tmp_path, ["png"]) for group in in_groups(few)]
    written = {path.name for drawn in every for path in drawn.paths}
    assert {f"{names[1]}.{ending}" for ending in ("png", "txt", "csv")} < written
    assert not any(name.startswith(names[0]) for name in written)
    sentences = [sentence for drawn in every for sentence in drawn.left_out]
    assert any(
        s.startswith(f"{names[0]} left out: 4 postures for the 6 coefficients") for s in sentences
    )


def test_groups_hold_every_figure_once_with_no_more_than_it_is_drawn_from(studied):
    groups = in_groups(studied)
    assert sorted(name for names, _ in groups for name in names) == sorted(OF_THE_HAND)
    for names, given_ in groups:
        for name in names:
            figure = OF_THE_HAND[name]
            assert set(given_) == set(figure.experiments)
            assert all((one.samples is not None) == figure.samples for one in given_.values())


def test_what_has_no_samples_says_so(studied):
    with pytest.raises(InputError, match="force without its samples"):
        _ = studied["force"].without_samples().recording
