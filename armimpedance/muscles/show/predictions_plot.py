"""What a model predicts, row by row, with what is extrapolated set apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np

from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError
from armimpedance.hand.show import one_legend
from armimpedance.muscles.models import HandPrediction, JointPrediction, JointRows, matrix
from armimpedance.muscles.show.predicted_plot import plot_predicted_against_measured
from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    Series,
    draw_elements,
    draw_ellipses,
    name_rows,
    new_figure,
    panel_letters,
    print_style,
    row_axes,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
                    label=f"{symbol}_{names[i, j]} ({unit_text(UNITS['joint'][symbol])})",
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
