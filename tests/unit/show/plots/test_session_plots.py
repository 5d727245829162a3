"""Pictures of a session and of results: what is drawn is the data, and can be read in print."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.text import Text
from sessions import pushes

import armimpedance as ai
from armimpedance.core.errors import InputError
from armimpedance.hand.levels.show import plot_force_term
from armimpedance.hand.still.show import (
    outlying_trials,
    plot_estimates,
    plot_fit,
    plot_motion_and_force,
    plot_quality,
    plot_residuals,
    plot_trials,
)
from armimpedance.hand.still.show.aligned_trials import align, fitted_force
from armimpedance.muscles.models import JointPrediction, JointRows
from armimpedance.muscles.show import plot_model_fit, plot_predictions
from armimpedance.show.plots import drawn_for, print_style, save_with_caption
from armimpedance.show.plots.style import LEAST_POINTS, ONE_COLUMN_IN, TWO_COLUMNS_IN

HOSTILE = r"$\frac{1}{0}$ <b>_x^2 $"


@pytest.fixture(scope="module")
def session():
    """Two conditions; one has a name that is no mathematics."""
    recording = pushes(3)
    table = recording.trials.replace({"condition": {"cocontraction_30": HOSTILE}})
    return replace(recording, trials=table)


@pytest.fixture(scope="module")
def estimates(session):
    return list(ai.estimate(session))


@pytest.fixture(scope="module")
def figures(session, estimates):
    """Every picture of the session."""
    return everything(session, estimates)


def everything(session, estimates):
    joint = [ai.to_joint(estimates, recording=session, force_term=one) for one in (True, False)]
    return {
        "quality": plot_quality(session),
        "trials": plot_trials(session, {"condition": HOSTILE}),
        "fit": plot_fit(session, estimates[1]),
        "residuals": plot_residuals(session, estimates[1]),
        "motion": plot_motion_and_force(session, estimates[0]),
        "estimates": plot_estimates(estimates),
        "rows": plot_estimates(estimates * 4),
        "force term": plot_force_term(*joint),
    }


def draw(figure):
    """As `save` draws it: ticks are made at the last moment."""
    with print_style():
        figure.draw_without_rendering()


def texts_of(figure):
    """Every text that is seen, after the layout has settled."""
    draw(figure)
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text.get_figure() is not None
    ]


def shown_ticks(axis):
    low, high = sorted(axis.get_view_interval())
    ticks = [tick for tick in axis.get_major_ticks() if low - 1e-9 <= tick.get_loc() <= high + 1e-9]
    return [tick.label1 for tick in ticks if tick.label1.get_visible() and tick.label1.get_text()]


def overlapping(figure):
    """Pairs of tick labels of one axis, and panels' titles, that touch each other."""
    draw(figure)
    groups = [shown_ticks(axis) for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)]
    groups.append([ax.title for ax in figure.axes if ax.title.get_text()])
    for group in groups:
        boxes = [(text.get_text(), text.get_window_extent()) for text in group]
        for (one, a), (other, b) in combinations(boxes, 2):
            if a.overlaps(b):
                yield one, other


@pytest.mark.study
def test_letters_are_as_large_as_print_asks_and_do_not_collide(figures):
    for name, figure in figures.items():
        assert min(text.get_fontsize() for text in texts_of(figure)) >= LEAST_POINTS, name
        assert list(overlapping(figure)) == [], name
        width = figure.get_figwidth()
        assert width == pytest.approx(ONE_COLUMN_IN) or width == pytest.approx(TWO_COLUMNS_IN)


def test_a_hostile_name_stays_text(estimates):
    texts = texts_of(plot_estimates(estimates)) + texts_of(plot_estimates(estimates * 4))
    names = [text for text in texts if text.get_text() == HOSTILE]
    assert len(names) > 2
    assert not any(text.get_parse_math() for text in names)


@pytest.mark.study
def test_a_talk_has_larger_letters_on_a_larger_figure(session, estimates, figures):
    with drawn_for("talk"):
        made = everything(session, estimates)
        for name, figure in made.items():
            assert list(overlapping(figure)) == [], name
            assert min(text.get_fontsize() for text in texts_of(figure)) >= 11, name
            assert figure.get_figwidth() > figures[name].get_figwidth()
    with pytest.raises(InputError, match="poster"), drawn_for("poster"):
        pass


def test_trials_are_drawn_as_recorded(session):
    figure = plot_trials(session, {"condition": "cocontraction_10"})
    rows = np.flatnonzero(session.trials["condition"] == "cocontraction_10")
    drawn = [segment for c in figure.axes[0].collections for segment in c.get_segments()]
    assert len(drawn) == len(rows)
    aligned = align(session, rows)
    ends = sorted(float(segment[:, 1].max()) for segment in drawn)
    thin = aligned.moved[:, aligned.thin(), 0]
    np.testing.assert_allclose(ends, sorted(1e3 * thin.max(axis=1)))
    onset = np.abs(drawn[0][:, 0]).argmin()
    assert abs(drawn[0][onset, 1]) < 0.05


def test_a_trial_that_runs_away_is_named_and_others_are_not(session):
    assert outlying_trials(session) == ()
    row = 5
    force = session.force.copy()
    at = session.samples_of(row)
    force[at, 0] += 8 * np.sin(np.linspace(0, 20, at.stop - at.start))
    number = int(session.trials["trial"].iloc[row])
    spoiled = replace(session, force=force)
    assert outlying_trials(spoiled) == (number,)
    assert outlying_trials(spoiled, {"condition": HOSTILE}) in ((), (number,))
    labels = [text.get_text() for text in plot_quality(spoiled).legends[0].get_texts()]
    assert f"unlike the others: trial {number}" in labels
    # many marked trials: every legend stays on the paper
    every = session.trials["trial"].to_list()
    for figure in (
        plot_trials(session, {"condition": HOSTILE}, every[-12:]),
        plot_quality(session, every),
    ):
        draw(figure)
        for legend in figure.legends:
            box = legend.get_window_extent()
            assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    with pytest.raises(InputError, match="no trial of condition"):
        plot_trials(session, {"condition": "nowhere"})


def test_the_best_and_the_worst_trial_are_those_of_the_residuals(session, estimates):
    shown = fitted_force(session, estimates[0])
    part = (shown.residual**2).sum(axis=(1, 2)) / (shown.measured**2).sum(axis=(1, 2))
    np.testing.assert_allclose(shown.explained, 1 - part)
    axes = plot_fit(session, estimates[0]).axes
    for ax, trial in ((axes[0], part.argmin()), (axes[2], part.argmax())):
        assert f"trial {shown.trial[trial]}," in ax.get_title()
        measured, fitted = ax.lines[1:]
        np.testing.assert_allclose(measured.get_ydata(), shown.measured[trial, :, 0])
        np.testing.assert_allclose(fitted.get_ydata(), shown.fitted[trial, :, 0])


def test_what_is_extrapolated_makes_no_specks_of_the_others():
    values, known = [[15.0, 6.0, 16.0]], [[[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]]
    far = [[1500.0, 60.0, 1600.0]]
    given = (values + far, values + far, known * 2, known * 2, 10.0, [False, True], ["", "far"])
    predicted = JointPrediction([[1.0, 1.5], [0.1, 0.2]], *given)
    figure = plot_predictions(predicted)
    widths = 2 * figure.axes[0].collections[0]._widths
    assert widths.min() > 0.2
    assert list(overlapping(figure)) == []
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["measured region", "extrapolated"]


def test_a_model_s_picture_holds_the_symmetric_part_of_each_row():
    K = np.array([[[15.0, 5.0], [7.0, 16.0]], [[20.0, 6.0], [6.0, 18.0]]])
    rows = JointRows([[1.0, 1.5], [1.1, 1.4]], K, K / 10)
    triples = [[15.0, 6.0, 16.0], [20.0, 6.0, 18.0]]
    none = np.zeros((2, 3, 3))
    predicted = JointPrediction(
        rows.joint_angles, triples, np.array(triples) / 10, none, none, 9.0, [False] * 2, [""] * 2
    )
    for ax in plot_model_fit(predicted, rows).axes:
        points = ax.containers[0].lines[0]
        np.testing.assert_allclose(points.get_xdata(), points.get_ydata())


def test_a_caption_stands_beside_or_below(tmp_path, session):
    figure = plot_trials(session, {"condition": HOSTILE})
    height = figure.get_figheight()
    written = save_with_caption(figure, tmp_path / "a", ("svg",), "A caption with a $ in it.")
    assert [path.name for path in written] == ["a.svg", "a.txt"]
    assert (tmp_path / "a.txt").read_text() == "A caption with a $ in it.\n"
    assert figure.get_figheight() == height
    (baked,) = save_with_caption(figure, tmp_path / "b", ("png",), "A caption.", baked=True)
    assert baked.name == "b.png"
    assert figure.get_figheight() > height
    assert not (tmp_path / "b.txt").exists()
