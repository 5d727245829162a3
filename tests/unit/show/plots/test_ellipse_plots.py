"""What is drawn is the matrix: its principal values, its place, its unit."""

import numpy as np
import pytest
from matplotlib.text import Text

from armimpedance.core.errors import InputError
from armimpedance.hand.show import (
    plot_ellipse,
    plot_ellipse_rose,
    plot_ellipses,
    plot_ellipses_over_levels,
)
from armimpedance.hand.show.ellipse_plot_parts import default_scale
from armimpedance.show.plots.style import new_axes, print_style

K = np.array([[104.8, -74.4], [-74.4, 179.3]])


def radii(line, centre=(0.0, 0.0)):
    return np.linalg.norm(line.get_xydata() - np.asarray(centre), axis=1)


def outlines(ax):
    """The closed lines of an ellipse's many points."""
    return [line for line in ax.lines if len(line.get_xdata()) > 50]


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


@pytest.mark.parametrize("scale", [1.0, 3e-4])
def test_extreme_radii_are_the_principal_values_of_the_symmetric_part(scale):
    skew = np.array([[0.0, 11.0], [-11.0, 0.0]])
    ax = plot_ellipse(K + skew, centre=(0.2, 0.5), scale=scale)
    (line,) = ax.lines
    r = radii(line, (0.2, 0.5)) / scale
    values = np.linalg.eigvalsh(K)
    # 200 points: between two of them the radius falls short by at most 1 - cos(pi/200).
    assert r.max() == pytest.approx(values[1], rel=2e-4)
    assert r.min() == pytest.approx(values[0], rel=2e-3)
    # and along the major axis it points where the eigenvector does
    far = line.get_xydata()[r.argmax()] - (0.2, 0.5)
    direction = np.linalg.eigh(K)[1][:, 1]
    assert abs(far @ direction) / np.linalg.norm(far) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize(
    ("which", "unit"), [("inertia", "(kg)"), ("viscosity", "(N s/m)"), ("stiffness", "(N/m)")]
)
def test_an_estimate_in_its_own_units_says_which(make_estimate, which, unit):
    ax = plot_ellipse(make_estimate(), which=which)
    assert unit in ax.get_xlabel()
    assert unit in ax.get_ylabel()
    assert radii(ax.lines[0]).max() == pytest.approx(
        np.linalg.eigvalsh(getattr(make_estimate(), which))[1], rel=2e-4
    )
    assert ax.get_aspect() == 1


def test_a_joint_level_estimate_has_joint_units(make_estimate):
    assert "(N m/rad)" in plot_ellipse(make_estimate(level="joint")).get_xlabel()


def test_a_matrix_without_an_ellipse_is_a_cross():
    ax = plot_ellipse([[1.0, 2.0], [2.0, 1.0]], centre=(3.0, 4.0))
    (line,) = ax.lines
    assert line.get_marker() == "x"
    assert line.get_xydata().tolist() == [[3.0, 4.0]]
    assert line.get_label() == "not positive definite"


@pytest.mark.parametrize("bad", [np.eye(3), [[1.0]], [1.0, 2.0]])
def test_only_two_axes_have_an_ellipse(bad):
    with pytest.raises(InputError, match="shape"):
        plot_ellipse(bad)


def test_unknown_matrix_is_refused(make_estimate):
    with pytest.raises(InputError, match="compliance"):
        plot_ellipse(make_estimate(), which="compliance")


def test_workspace_draws_each_at_its_hand(make_estimate):
    estimates = [make_estimate(x, y) for x in (-0.2, 0.0, 0.2) for y in (0.3, 0.5)]
    ax = plot_ellipses(estimates, scale=2e-4)
    drawn = outlines(ax)
    assert len(drawn) == 6
    for line, estimate in zip(drawn, estimates, strict=True):
        np.testing.assert_allclose(
            line.get_xydata()[:-1].mean(axis=0), estimate.position, atol=1e-9
        )
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x (m)", "y (m)")
    words = [text.get_text() for text in ax.findobj(Text)]
    assert "shoulder" in words
    assert {"x -0.2", "x 0", "x 0.2"} <= set(words)
    assert labels(ax)[-1].startswith("95 % band")


def test_scale_bar_is_as_long_as_it_says(make_estimate):
    ax = plot_ellipses([make_estimate()], scale=2e-4)
    (bar,) = [artist for artist in ax.artists if hasattr(artist, "size_bar")]
    assert bar.txt_label.get_text() == "200 N/m"
    (line,) = bar.size_bar.get_children()
    assert line.get_width() == pytest.approx(2e-4 * 200)


def test_default_scale_keeps_neighbours_apart(make_estimate):
    places = np.array([[x, y] for x in (-0.2, 0.0, 0.2) for y in (0.3, 0.4)])
    scale = default_scale([K] * 6, places)
    assert 0.3 * 0.1 < scale * np.linalg.eigvalsh(K)[1] < 0.5 * 0.1
    assert default_scale([K], places[:1]) > 0
    assert default_scale([K, K], places[[0, 0]]) > 0


def test_reference_is_wide_and_grey_below_the_estimate(make_estimate):
    estimates = [make_estimate(-0.2), make_estimate(0.2)]
    ax = plot_ellipses(
        estimates,
        which="inertia",
        reference=[1.1 * e.inertia for e in estimates],
        show_confidence=False,
    )
    drawn = outlines(ax)
    assert len(drawn) == 4
    # lines of one order are drawn one after another: the estimate's own come last
    assert [line.get_linewidth() > 2 for line in drawn] == [True, True, False, False]
    assert labels(ax) == ["model"]
    for model, own in zip(drawn[:2], drawn[2:], strict=True):
        centre = own.get_xydata()[:-1].mean(axis=0)
        ratio = radii(model, centre) / radii(own, centre)
        np.testing.assert_allclose(ratio, 1.1, rtol=1e-6)


def test_workspace_refuses_what_has_no_place_there(make_estimate):
    with pytest.raises(InputError, match="labels"):
        plot_ellipses([make_estimate()], labels=["a", "b"])
    with pytest.raises(InputError, match="nothing to draw"):
        plot_ellipses([])


def test_levels_are_told_apart_without_colour(make_estimate):
    estimates = [make_estimate(stiffness=g * K) for g in (1.0, 1.5, 2.0)]
    ax = plot_ellipses_over_levels(estimates, labels=["0 %", "10 %", "20 %"], reference=2.5 * K)
    drawn = outlines(ax)
    # the dashes themselves: matplotlib keeps them private, and names all patterns "--"
    patterns = [str(line._unscaled_dash_pattern) for line in drawn]
    assert len(set(patterns)) == 4
    assert len({line.get_color() for line in drawn}) == 4
    assert labels(ax) == ["0 %", "10 %", "20 %", "model"]
    largest = [radii(line).max() for line in drawn]
    np.testing.assert_allclose(np.array(largest) / largest[0], [1, 1.5, 2, 2.5])
    assert ax.get_xlim() == ax.get_ylim()


def test_rose_puts_each_at_its_force(make_estimate):
    angles = np.arange(8) * np.pi / 4
    targets = 9.8 * np.column_stack([np.cos(angles), np.sin(angles)])
    estimates = [make_estimate(force=force) for force in targets]
    for ax in (
        plot_ellipse_rose(estimates),
        plot_ellipse_rose([make_estimate(force=None)] * 8, forces_N=targets),
    ):
        centres = [line.get_xydata()[:-1].mean(axis=0) for line in outlines(ax)]
        np.testing.assert_allclose(centres, targets, atol=1e-9)
        assert "(N)" in ax.get_xlabel()
        assert "(N)" in ax.get_ylabel()
    with pytest.raises(InputError, match="force"):
        plot_ellipse_rose([make_estimate(force=None)])


def test_the_callers_axes_and_labels_are_kept(make_estimate):
    ax = new_axes()
    ax.set_xlabel("mine")
    assert plot_ellipse(make_estimate(), ax) is ax
    assert ax.get_xlabel() == "mine"


@pytest.mark.parametrize("letters", [3, 16, 30])
def test_names_of_any_length_stand_within_the_saved_figure(letters, make_estimate):
    three = [make_estimate(stiffness=k * K) for k in (1, 2, 3)]
    with print_style():
        ax = plot_ellipses_over_levels(three, labels=[c * letters for c in "aon"])
        ax.figure.canvas.draw()
        legend, paper = ax.get_legend().get_window_extent(), ax.figure.bbox
    assert legend.x0 >= 0
    assert legend.x1 <= paper.x1 + 1
