"""Plot of estimates beside one another, with their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.core.conventions import UNITS
from armimpedance.core.errors import InputError
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import (
    MOST_LOOKS,
    OKABE_ITO,
    ONE_COLUMN_IN,
    element_text,
    label_axes,
    look,
    new_axes,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_intervals(
    estimates: Sequence[ImpedanceEstimate],
    parameter: str = "K_11",
    ax: Axes | None = None,
    labels: Sequence[str] | None = None,
    truth: Sequence[float] | None = None,
) -> Axes:
    """Draw one element of M, B or K of each estimate as a dot with its 95 % interval.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Drawn from the top down.
    parameter : str
        ``M_11`` … ``K_kk``.
    ax : Axes, optional
        Default: those of a new figure.
    labels : sequence of str, optional
        Default: the conditions.
    truth : sequence of float, optional
        Known values, drawn as crosses.

    Returns
    -------
    Axes
        The axes that hold the intervals, in the unit of the element.

    Raises
    ------
    InputError
        When an estimate has no such element, or there is no estimate.

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> ax = ai.plot_intervals([*ai.estimate(recording)])
    >>> [label.get_text() for label in ax.get_yticklabels()]
    ['cocontraction_10']
    """
    if not estimates:
        raise InputError("nothing to draw", expected="at least one estimate")
    values, half = np.array([_value(e, parameter) for e in estimates]).T
    names = [str(e.keys.get("condition", "")) for e in estimates] if labels is None else labels
    rows = np.arange(len(values))
    with print_style():
        height = 0.9 + 0.22 * len(values)
        ax = new_axes(ONE_COLUMN_IN, height) if ax is None else ax
        for number, (value, width) in enumerate(zip(values, half, strict=True)):
            color = _color(number, len(values))
            label = None if number else "95 % interval"
            ax.errorbar(value, number, xerr=width, fmt="o", color=color, capsize=2, label=label)
        if truth is not None:
            ax.plot(truth, rows, "x", color="black", markersize=6, zorder=3, label="truth")
            ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        ax.set_yticks(rows, names, parse_math=False)
        ax.set_ylim(len(values) - 0.5, -0.5)
        unit = unit_text(UNITS[estimates[0].level][parameter[0]])
        label_axes(ax, f"{element_text(parameter)} ({unit})", "condition")
    return ax


def _color(number: int, of: int) -> str:
    """Colour of the group in every picture; the same colour for all of many groups."""
    return str(look(number)["color"]) if of <= MOST_LOOKS else OKABE_ITO["blue"]


def _value(estimate: ImpedanceEstimate, parameter: str) -> tuple[float, float]:
    names = estimate.parameter_names
    if parameter not in names:
        raise InputError(f"no element {parameter!r}", expected=f"one of {names[0]} to {names[-1]}")
    i = names.index(parameter)
    half = t_factor(estimate.dof) * estimate.sd.ravel()[i]
    return float(estimate.parameters[i]), float(half)
