"""Responses over time, and elements with their intervals."""

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.hand.show.intervals_plot import plot_intervals
from armimpedance.hand.still.show.plot import plot_response
from armimpedance.show.plots.style import new_figure


def test_response_shows_four_signals_and_the_prediction(response):
    predicted = 0.9 * response.force
    axes = plot_response(response, predicted, 0)
    assert axes.shape == (4, 2)
    assert [len(ax.lines) for ax in axes[:, 1]] == [2, 2, 2, 3]
    units = ["(mm)", "(m/s)", "(m/s²)", "(N)"]
    assert all(u in ax.get_ylabel() for u, ax in zip(units, axes[:, 0], strict=True))
    assert all("(ms)" in ax.get_xlabel() for ax in axes[-1])
    displacement = axes[0, 1].lines[1]
    np.testing.assert_allclose(displacement.get_xdata(), 1000 * response.lag_s)
    np.testing.assert_allclose(displacement.get_ydata(), 1000 * response.displacement[0, :, 1])
    measured, dashed = axes[3, 0].lines[1:]
    np.testing.assert_allclose(measured.get_ydata(), response.force[0, :, 0])
    np.testing.assert_allclose(dashed.get_ydata(), predicted[0, :, 0])
    assert dashed.is_dashed()
    assert not measured.is_dashed()


def test_response_takes_one_trial_s_prediction_and_the_caller_s_axes(response):
    grid = new_figure().subplots(4, 2)
    assert plot_response(response, response.force[0], 0, axes=grid) is grid
    joint = plot_response(response, response.force[0], 0, kind="joint")
    assert "(N m)" in joint[3, 0].get_ylabel()
    assert "(rad)" in joint[0, 0].get_ylabel()


@pytest.mark.parametrize(("index", "word"), [(2, "index 2"), (-1, "index -1"), (1, "trial 7")])
def test_response_refuses_a_trial_that_is_not_there(response, index, word):
    with pytest.raises(InputError, match=word):
        plot_response(response, response.force, index)


def test_response_refuses_other_shapes(response):
    with pytest.raises(InputError, match="predicted force"):
        plot_response(response, response.force[:, :-1], 0)
    with pytest.raises(InputError, match="axes of shape"):
        plot_response(response, response.force, 0, axes=new_figure().subplots(2, 2))


def test_intervals_are_as_wide_as_the_t_distribution_says(make_estimate):
    estimates = [make_estimate(0.1 * i) for i in range(3)]
    ax = plot_intervals(estimates, "K_22", truth=[180.0] * 3)
    assert "(N/m)" in ax.get_xlabel()
    assert ax.get_ylabel()
    assert [bars[0].get_xdata() for bars in ax.containers] == pytest.approx([179.3] * 3)
    segments = [bars[2][0].get_segments()[0] for bars in ax.containers]
    ends = np.array([segment[:, 0] for segment in segments])
    # 2.0227: 97.5 % point of t with 39 degrees of freedom; 6 N/m: the standard error
    np.testing.assert_allclose(ends - 179.3, [[-2.0227 * 6, 2.0227 * 6]] * 3, rtol=1e-4)
    assert [text.get_text() for text in ax.get_yticklabels()] == ["x 0", "x 0.1", "x 0.2"]


def test_intervals_of_what_is_not_there(make_estimate):
    with pytest.raises(InputError, match="K_33"):
        plot_intervals([make_estimate()], "K_33")
    with pytest.raises(InputError, match="nothing to draw"):
        plot_intervals([])
