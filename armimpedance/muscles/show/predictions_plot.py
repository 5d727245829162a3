"""Predictions of a model, row by row; extrapolated ones are set apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError
from armimpedance.hand.show import one_legend
from armimpedance.muscles.models import HandPrediction, JointPrediction, JointRows, matrix
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    Series,
    draw_elements,
    draw_ellipses,
    element_text,
    label_axes,
    name_rows,
    new_axes,
    new_figure,
    panel_letters,
    print_style,
    row_axes,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Predicted values beside measured ones.

_GROUP_LOOKS: Final = (("o", "blue"), ("s", "vermillion"), ("^", "green"), ("D", "purple"))


def plot_predicted_against_measured(
    predicted: ArrayLike,
    measured: ArrayLike,
    predicted_half: ArrayLike,
    measured_half: ArrayLike,
    groups: Sequence[str],
    ax: Axes | None = None,
    *,
    label: str = "",
) -> Axes:
    """Draw measured values over predicted ones, with 95 % intervals of both and the identity line.

    Parameters
    ----------
    predicted, measured : (P,)
        Values in one unit.
    predicted_half, measured_half : (P,)
        Half-widths of the intervals.
    groups : (P,) sequence of str
        Experiments, told apart by shape and colour; at most four.
    ax : Axes, optional
        Drawn into a new figure without it.
    label : str
        What it is, with its unit.

    Returns
    -------
    Axes
        The axes drawn into.

    Raises
    ------
    InputError
        Vectors of different lengths, or more than four groups.

    Examples
    --------
    >>> from armimpedance.muscles.show import plot_predicted_against_measured
    >>> half, groups = [0.5, 0.5], ["force", "force"]
    >>> ax = plot_predicted_against_measured([10, 20], [11, 19], half, half, groups, label="K")
    >>> ax.get_xlabel()
    'predicted K'
    """
    x, y, x_half, y_half = (
        np.asarray(v, dtype=float) for v in (predicted, measured, predicted_half, measured_half)
    )
    names = list(dict.fromkeys(groups))
    if not x.shape == y.shape == x_half.shape == y_half.shape == (len(groups),):
        raise InputError("predicted and measured values of different numbers", expected="as many")
    if len(names) > len(_GROUP_LOOKS):
        raise InputError(f"{len(names)} groups", expected=f"at most {len(_GROUP_LOOKS)}")
    with print_style():
        ax = new_axes() if ax is None else ax
        ends = [
            min((x - x_half).min(), (y - y_half).min()),
            max((x + x_half).max(), (y + y_half).max()),
        ]
        margin = 0.04 * (ends[1] - ends[0]) or 0.04 * max(1.0, abs(float(ends[0])))
        limits = (ends[0] - margin, ends[1] + margin)
        ax.plot(limits, limits, color="0.6", linewidth=0.8, zorder=0, label="identity")
        for name, look in zip(names, _GROUP_LOOKS, strict=False):
            own = np.array([group == name for group in groups])
            _draw_group(ax, x[own], y[own], x_half[own], y_half[own], look, name)
        ax.set(xlim=limits, ylim=limits)
        ax.set_aspect("equal")
        label_axes(ax, f"predicted {label}", f"measured {label}")
    return ax


def _draw_group(
    ax: Axes,
    x: FloatArray,
    y: FloatArray,
    x_half: FloatArray,
    y_half: FloatArray,
    look: tuple[str, str],
    name: str,
) -> None:
    """Points of one experiment with bars along both axes; its look is a marker and a colour."""
    ax.errorbar(
        x,
        y,
        xerr=x_half,
        yerr=y_half,
        fmt=look[0],
        color=OKABE_ITO[look[1]],
        mfc="white",
        markersize=3.5,
        mew=0.8,
        elinewidth=0.7,
        label=name,
    )


def plot_predictions(predicted: JointPrediction | HandPrediction) -> Figure:
    """Draw predicted K and B of every row with 95 % intervals; squares are extrapolated.

    Parameters
    ----------
    predicted : JointPrediction or HandPrediction
        What `predict` or `at_hand` returned.

    Returns
    -------
    Figure
        K above B: the ellipses, then a panel for each element; of three axes or joints and more
        a panel for each element of the diagonal.
    """
    joint = predicted.joint if isinstance(predicted, HandPrediction) else predicted
    level = "hand" if isinstance(predicted, HandPrediction) else "joint"
    k = predicted.stiffness_matrices.shape[-1]
    planar, color = k == 2, OKABE_ITO["blue"]
    with print_style():
        columns, narrow = (4, 1) if planar else (k, 0)
        figure, grid = row_axes(len(joint.joint_angles), columns, bands=2, narrow=narrow)
        for symbol, which, axes in zip("KB", ("stiffness", "viscosity"), grid, strict=True):
            values = getattr(predicted, f"{which}_matrices")
            half = matrix(predicted.half_width(which))
            one = Series("measured region", values, half, color, faded=joint.extrapolated)
            if planar:
                draw_ellipses(axes[0], [one], symbol)
            part: Literal["upper", "diagonal"] = "upper" if planar else "diagonal"
            draw_elements(axes[narrow:], [one], symbol, UNITS[level][symbol], part=part)
            name_rows(axes[0], _names(joint), bands=2)
        panel_letters([ax for row in grid for ax in row])
        if joint.extrapolated.any():
            handles, labels = grid[0][1].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


#: Elements of a joint matrix: shoulder, both, elbow.
_PLANAR = {(0, 0): "ss", (0, 1): "se", (1, 1): "ee"}


def plot_model_fit(predicted: JointPrediction, rows: JointRows) -> Figure:
    """Draw measured elements of K and B over those that the model makes of the same rows.

    Parameters
    ----------
    predicted : JointPrediction
        Of the rows' postures and activations.
    rows : JointRows
        Those that were fitted.

    Returns
    -------
    Figure
        K above B, a panel for each element, with 95 % intervals of both where they are known; of
        three joints and more the diagonal.

    Raises
    ------
    InputError
        As many predictions as rows are asked for.
    """
    if len(predicted.joint_angles) != len(rows.joint_angles):
        raise InputError("predictions of other rows", expected="one for each row")
    numbered = {(i, i): f"{j + 1}{j + 1}" for i, j in enumerate(rows.moving)}
    names = _PLANAR if rows.joints == 2 else numbered
    places = list(names)
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 4.9)
        grid = figure.subplots(2, len(places))
        for symbol, which, axes in zip("KB", ("stiffness", "viscosity"), grid, strict=True):
            matrices, sd = getattr(rows, which), getattr(rows, f"{which}_sd")
            said, half = (
                getattr(predicted, f"{which}_matrices"),
                matrix(predicted.half_width(which)),
            )
            unit = unit_text(UNITS["joint"][symbol])
            for column, (i, j) in enumerate(places):
                a, b = rows.moving[i], rows.moving[j]
                # the symmetric part, as the model has it; the larger error of its two elements
                measured = (matrices[:, i, j] + matrices[:, j, i]) / 2
                error = 0 * measured if sd is None else np.maximum(sd[:, i, j], sd[:, j, i])
                plot_predicted_against_measured(
                    *(said[:, a, b], measured),
                    *(half[:, a, b], 1.96 * error),
                    ["rows that were fitted"] * len(measured),
                    axes[column],
                    label=f"{element_text(f'{symbol}_{names[i, j]}')} ({unit})",
                )
        panel_letters(list(grid.flat))
        one_legend(figure, list(grid.flat))
    return figure


def _names(joint: JointPrediction) -> list[str]:
    """Shoulder and elbow in degrees; muscles where they alone tell the rows apart."""
    degrees = np.degrees(joint.joint_angles)
    if joint.activation is not None and np.ptp(degrees, axis=0).max() < 0.1:
        return [
            f"{number}: α {', '.join(f'{a:.2g}' for a in alpha[:3])}…"
            for number, alpha in enumerate(joint.activation, start=1)
        ]
    return [f"{n}: {', '.join(f'{x:.0f}°' for x in q)}" for n, q in enumerate(degrees, start=1)]
