"""The figure scripts: each draws, says what is simulated, and shows what the estimates say."""

from __future__ import annotations

import numpy as np
import pytest

from armimpedance.errors import InputError
from armimpedance_figures.build_all import CATALOGUE, chosen
from armimpedance_figures.experiment import study
from armimpedance_figures.source_figure import write


@pytest.fixture(scope="module")
def studied():
    """One set of disturbances per condition: enough to draw."""
    wanted = {
        "postures": ["posture_01", "posture_05", "posture_08"],
        "cocontraction": ["cocontraction_00", "cocontraction_10", "cocontraction_20"],
        "force": None,
    }
    return {
        name: study(name, subject="C", seed=3, sets=1, conditions=conditions)
        for name, conditions in wanted.items()
    }


@pytest.mark.parametrize("figure", CATALOGUE.values(), ids=CATALOGUE)
def test_figure_is_written_in_three_formats_the_same_twice(figure, studied, tmp_path):
    paths = write(figure, studied[figure.experiment], tmp_path)
    assert sorted(p.suffix for p in paths) == [".pdf", ".png", ".svg"]
    first = {p.suffix: p.read_bytes() for p in paths}
    again = {p.suffix: p.read_bytes() for p in write(figure, studied[figure.experiment], tmp_path)}
    assert first == again
    assert len(first[".png"]) > 20_000


@pytest.mark.parametrize("figure", CATALOGUE.values(), ids=CATALOGUE)
def test_caption_says_source_simulation_and_difference(figure, studied):
    caption = figure.caption(studied[figure.experiment])
    for part in ("Tsuji (1997), Fig.", "Simulated subject C", "Differs from the source"):
        assert part in caption


@pytest.mark.parametrize("figure", CATALOGUE.values(), ids=CATALOGUE)
def test_axes_have_units_and_text_is_readable(figure, studied):
    drawn = figure.draw(studied[figure.experiment])
    labels = [ax.get_xlabel() for ax in drawn.axes] + [ax.get_ylabel() for ax in drawn.axes]
    shown = [label for label in labels if label]
    assert shown
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
    assert [f.name for f in chosen(["fig07"])] == ["tsuji1997_fig07_ellipses_over_workspace"]
    assert len(chosen([])) == len(CATALOGUE)
    with pytest.raises(InputError, match="no figure 'fig99'"):
        chosen(["fig99"])
