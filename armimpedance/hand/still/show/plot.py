"""Figs 6 and 7 of Tsuji (1997) from own data: motion and force, ellipses at the hand's places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, MATRICES, UNITS, Kind, group_name
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate, Recording, Response
from armimpedance.hand.ellipses import Which
from armimpedance.hand.show.ellipse_map_plot import plot_ellipses
from armimpedance.hand.show.ellipse_plot import plot_ellipses_over_levels
from armimpedance.hand.show.ellipse_plot_parts import ONE_PLACE_M, one_legend
from armimpedance.hand.show.ellipsoid_plot import plot_ellipsoids
from armimpedance.hand.still.show.aligned_trials import ROWS_PER_KERNEL, predicted_force, rows_of
from armimpedance.numerics.signals import choose_span, cut_windows, ramp_basis, respond
from armimpedance.show.plots import (
    OKABE_ITO,
    ONE_COLUMN_IN,
    TWO_COLUMNS_IN,
    Series,
    draw_elements,
    draw_ellipses,
    name_rows,
    new_figure,
    panel_letters,
    print_style,
    row_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

# Response of one hand to a disturbance, and the force predicted by the estimated impedance.

#: Rows of the figure: field, label, factor from the record's unit.
_ROWS: dict[str, tuple[tuple[str, str, float], ...]] = {
    "hand": (
        ("displacement", "displacement\n(mm)", 1e3),
        ("velocity", "velocity\n(m/s)", 1.0),
        ("acceleration", "acceleration\n(m/s²)", 1.0),
        ("force", "force\n(N)", 1.0),
    ),
    "joint": (
        ("displacement", "displacement\n(rad)", 1.0),
        ("velocity", "velocity\n(rad/s)", 1.0),
        ("acceleration", "acceleration\n(rad/s²)", 1.0),
        ("force", "torque\n(N m)", 1.0),
    ),
}


def plot_response(
    response: Response,
    predicted_force: ArrayLike,
    trial_index: int = 0,
    axes: Any = None,
    kind: Kind = "hand",
) -> Any:
    """Draw one trial's displacement, velocity, acceleration and force, as in Tsuji (1997), Fig. 6.

    The measured force is solid, the predicted one dashed. Columns share their scale, so that the
    axes can be compared.

    `axes` (4, d) of Axes.
    `predicted_force` (T, S, d) or (S, d): of all trials, or of this one.
    `trial_index`: row of the response, from 0.
    Returns: `axes` (4, d) array of Axes.
    Raises InputError: when there is no such trial, it is not usable, or the prediction has another
    shape.
    """
    predicted = _of_trial(response, predicted_force, trial_index)
    with print_style():
        grid = _new_grid(response.axes) if axes is None else np.asarray(axes)
        if grid.shape != (4, response.axes):
            raise InputError(f"axes of shape {grid.shape}", expected=f"(4, {response.axes})")
        for row, (field, label, factor) in zip(grid, _ROWS[kind], strict=True):
            signal = factor * getattr(response, field)[trial_index]
            for i, ax in enumerate(row):
                _draw(ax, response, signal[:, i], predicted[:, i] if field == "force" else None)
            row[0].set_ylabel(label)
        for i, ax in enumerate(grid[0]):
            ax.set_title(AXES[i] if kind == "hand" else f"joint {i + 1}")
        for ax in grid[-1]:
            ax.set_xlabel("time from onset (ms)")
        grid[-1, 0].legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        grid[0, 0].figure.align_ylabels(list(grid[:, 0]))
    return grid


def _of_trial(response: Response, predicted_force: ArrayLike, trial_index: int) -> Any:
    trials, shape = len(response.trial), response.force.shape
    if not 0 <= trial_index < trials:
        raise InputError(f"no trial of index {trial_index}", expected=f"0 to {trials - 1}")
    if not response.usable[trial_index]:
        number = response.trial[trial_index]
        raise InputError(f"trial {number} does not fill the window", expected="a usable trial")
    predicted = np.asarray(predicted_force, dtype=float)
    if predicted.shape not in (shape, shape[1:]):
        problem = f"a predicted force of shape {predicted.shape}"
        raise InputError(problem, expected=f"{shape} or {shape[1:]}")
    return predicted[trial_index] if predicted.ndim == 3 else predicted


def _new_grid(columns: int) -> Any:
    figure = new_figure(TWO_COLUMNS_IN if columns > 1 else ONE_COLUMN_IN, 4.8)
    return figure.subplots(4, columns, sharex=True, sharey="row", squeeze=False)


def _draw(ax: Axes, response: Response, measured: Any, predicted: Any) -> None:
    time_ms = 1e3 * response.lag_s
    ax.axhline(0.0, color="0.8", linewidth=0.6, zorder=0)
    ax.plot(time_ms, measured, color=OKABE_ITO["black"], label="measured")
    if predicted is not None:
        color = OKABE_ITO["vermillion"]
        ax.plot(time_ms, predicted, color=color, linestyle=(0, (4, 2)), label="predicted")


_PANELS: Final[tuple[Which, ...]] = ("inertia", "stiffness", "viscosity")
#: More conditions of one place than this are drawn row by row, not on top of each other.
_MOST_AT_ONE_PLACE: Final = 6
#: More ellipsoids than this hide one another.
_MOST_IN_SPACE: Final = 4


def plot_motion_and_force(recording: Recording, estimate: ImpedanceEstimate) -> Figure:
    """Draw one trial as in Tsuji (1997), Fig. 6: motion, force, and the force that M, B, K predict.

    The first usable trial that moves along all axes, or else the one that moves furthest.

    Parameters
    ----------
    recording : Recording
        The recording that was estimated, with disturbances that return.
    estimate : ImpedanceEstimate
        Estimate of one of its groups, given by its `keys`.

    Returns
    -------
    Figure
        Displacement, velocity, acceleration and force, a column for each axis.

    Raises
    ------
    InputError
        No trial of the recording is of the estimate's group.
    """
    window = cut_windows(recording, rows_of(recording, estimate.keys))
    # More rows than a fit needs: smooth curves.
    span = choose_span(window, rows_per_kernel=ROWS_PER_KERNEL)
    moved = respond(window, span, keep_drift=True)
    moved = replace(moved, displacement=moved.displacement - moved.displacement[:, :1])
    predicted = predicted_force(moved, estimate)
    shown = replace(moved, force=predicted + _without_ramp(moved.force - predicted, moved.lag_s))
    peak = np.abs(shown.displacement).max(axis=1).min(axis=1)
    trial = int(np.where(shown.usable, peak, -1.0).argmax())
    axes = plot_response(shown, predicted, trial_index=trial, kind=recording.kind)
    figure: Figure = axes[0, 0].figure
    return figure


def _without_ramp(signal: FloatArray, lag_s: FloatArray) -> FloatArray:
    """A signal (T, S, d) minus its least-squares offset and ramp: the limb's own slow force."""
    basis = ramp_basis(lag_s)
    return np.asarray(signal - basis @ (basis.T @ signal))


def plot_estimates(
    estimates: Sequence[ImpedanceEstimate],
    model_inertia: Sequence[ArrayLike] | None = None,
) -> Figure:
    """Draw M, K and B of all rows as in Tsuji (1997), Fig. 7.

    Ellipses are drawn at the places of the hand. Those of one place and those of joints are drawn
    about one centre, or row by row if they are many. In space the stiffness of a few rows is drawn
    as ellipsoids, in three views and one drawing. Otherwise (one axis, many rows in space) the
    diagonals of the matrices are drawn.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Of one level.
    model_inertia : sequence of (2, 2), optional
        Drawn beside the inertia, dotted.

    Returns
    -------
    Figure
        Panels of inertia, stiffness and viscosity, or of their elements.

    Raises
    ------
    InputError
        Nothing to draw, or rows of several numbers of axes.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from armimpedance.hand.still.show import plot_estimates
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> [ax.get_title() for ax in plot_estimates(ai.estimate(recording)).axes]
    ['inertia', 'stiffness', 'viscosity']
    """
    if not estimates or len({e.k for e in estimates}) > 1:
        raise InputError("no rows of one number of axes", expected="one or more of one level")
    places = [e.position for e in estimates if e.level == "hand" and e.position is not None]
    spread = len(places) == len(estimates) and np.ptp(places, axis=0).max() > ONE_PLACE_M
    if estimates[0].k == 2 and spread:
        return _over_workspace(estimates, model_inertia)
    if estimates[0].k == 2 and len(estimates) <= _MOST_AT_ONE_PLACE:
        return _about_one_centre(estimates)
    if estimates[0].k == 3 and estimates[0].level == "hand" and len(estimates) <= _MOST_IN_SPACE:
        return plot_ellipsoids(estimates)
    return _ellipses_and_stiffness(estimates) if estimates[0].k == 2 else _elements(estimates)


def _over_workspace(
    estimates: Sequence[ImpedanceEstimate], model_inertia: Sequence[ArrayLike] | None
) -> Figure:
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 3.7)
        axes = list(figure.subplots(1, 3))
        for ax, which in zip(axes, _PANELS, strict=True):
            plot_ellipses(
                estimates,
                which=which,
                ax=ax,
                reference=model_inertia if which == "inertia" else None,
                reference_label="two-link model",
            )
            ax.set_title(which)
        _share_limits(figure, axes)
        panel_letters(axes)
        _one_word_for_bands(axes)
        one_legend(figure, axes)
    return figure


def _one_word_for_bands(axes: Sequence[Axes]) -> None:
    """Give the bands of all panels one legend entry, as some can hardly be seen."""
    bands = [p for ax in axes for p in ax.patches if str(p.get_label()).startswith("95 % band")]
    shortest = min((str(band.get_label()) for band in bands), key=len, default="")
    for band in bands:
        band.set_label(shortest)


def _share_limits(figure: Figure, axes: Sequence[Axes]) -> None:
    """Show the same part of the workspace in every panel, and adapt the figure's height."""
    low, high = np.array([ax.axis() for ax in axes]).reshape(-1, 2, 2).transpose(2, 0, 1)
    (left, bottom), (right, top) = low.min(axis=0), high.max(axis=0)
    for number, ax in enumerate(axes):
        ax.update_datalim([(left, bottom), (right, top)])
        ax.autoscale_view()
        ax.tick_params(labelleft=number == 0)
        ax.set_ylabel("y (m)" if number == 0 else "")
    across = (figure.get_figwidth() - 0.75) / 3
    height = across * (top - bottom) / (right - left) + 1.1
    figure.set_figheight(float(np.clip(height, 2.4, 4.2)))


def _about_one_centre(estimates: Sequence[ImpedanceEstimate]) -> Figure:
    names = [group_name(e.keys) for e in estimates]
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 2.9)
        axes = figure.subplots(1, 3)
        for ax, which in zip(axes, _PANELS, strict=True):
            plot_ellipses_over_levels(estimates, which, names, ax, show_confidence=True)
            ax.set_title(which)
        panel_letters(list(axes))
        one_legend(figure, list(axes), columns=3)
    return figure


def _ellipses_and_stiffness(estimates: Sequence[ImpedanceEstimate]) -> Figure:
    """Draw the ellipses of M, B and K row by row, and K's elements with intervals."""
    level = estimates[0].level
    with print_style():
        figure, (axes,) = row_axes(len(estimates), 6, narrow=3)
        series = [_series(estimates, which) for which in MATRICES]
        for ax, matrix_series, (symbol, _) in zip(axes, series, MATRICES.values(), strict=False):
            draw_ellipses(ax, [matrix_series], symbol)
        draw_elements(axes[3:], series[-1:], "K", UNITS[level]["K"], part="upper")
        name_rows(axes[0], [group_name(e.keys) for e in estimates])
        panel_letters(axes)
    return figure


def _elements(estimates: Sequence[ImpedanceEstimate]) -> Figure:
    """Draw the diagonals of M, B and K of each row with intervals."""
    k, level = estimates[0].k, estimates[0].level
    bands = 1 if k == 1 else 3
    with print_style():
        figure, grid = row_axes(len(estimates), max(k, 3 // bands), bands)
        panels = [[ax] for ax in grid[0]] if k == 1 else grid
        for (which, (symbol, _)), axes in zip(MATRICES.items(), panels, strict=True):
            series = _series(estimates, which)
            draw_elements(axes, [series], symbol, UNITS[level][symbol], part="diagonal")
        for band in grid:
            name_rows(band[0], [group_name(e.keys) for e in estimates], bands)
        panel_letters([ax for band in grid for ax in band])
    return figure


def _series(estimates: Sequence[ImpedanceEstimate], which: str) -> Series:
    low, high = np.array([e.interval() for e in estimates])[
        :, :, list(MATRICES).index(which)
    ].swapaxes(0, 1)
    values = np.array([getattr(e, which) for e in estimates])
    return Series(which, values, (high - low) / 2, OKABE_ITO["blue"])
