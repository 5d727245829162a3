"""A plan in pictures: the disturbances, their acceleration, and the interval against trials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.hand.planning.candidate import Candidate
from armimpedance.hand.planning.plan import Plan
from armimpedance.show.plots import (
    LINE_STYLES,
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    print_style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLORS: Final = tuple(
    OKABE_ITO[name] for name in ("black", "blue", "vermillion", "green", "purple", "orange")
)
#: More lines cannot be distinguished.
_MOST: Final = 6


def best_of_each(plan: Plan, most: int = _MOST) -> list[Candidate]:
    """For each shape the duration with the smallest interval of K, at most six, in table order."""
    best: dict[str, Candidate] = {}
    for candidate in plan.candidates:
        if not candidate.recommendable:
            continue
        best_so_far = best.get(candidate.name)
        half = np.inf if best_so_far is None else best_so_far.cost[1]
        if candidate.cost[1] < half:
            best[candidate.name] = candidate
    return list(best.values())[:most]


def plot_courses(
    candidates: Sequence[Candidate], ax: Axes | None = None, *, order: int = 0
) -> Axes:
    """Plot the commanded displacement (order 0, mm) or acceleration (order 2, m/s^2) over time."""
    with print_style():
        ax = new_axes() if ax is None else ax
        for i, candidate in enumerate(candidates):
            if candidate.profile is None:
                continue
            lag = np.linspace(-0.02, candidate.profile.duration_s + 0.02, 1001)
            course = candidate.profile.at(lag)[order] * (1e3 if order == 0 else 1)
            ax.plot(1e3 * lag, course, **_look(i), label=_name(candidate))
        what = {0: "displacement (mm)", 1: "velocity (m/s)", 2: "acceleration (m/s²)"}[order]
        label_axes(ax, "time since the onset (ms)", what)
    return ax


def plot_interval_over_trials(
    candidates: Sequence[Candidate], ax: Axes | None = None, *, wish: float | None = None
) -> Axes:
    """Plot the half-width of K's 95 % interval in % over the number of trials, both logarithmic.

    `wish`: the required half-width, relative to K, drawn as a line.
    """
    from matplotlib.ticker import NullFormatter, ScalarFormatter

    trials = np.array([8, 16, 24, 32, 40, 48, 64, 80, 120, 160, 240, 320, 400])
    with print_style():
        ax = new_axes() if ax is None else ax
        for i, candidate in enumerate(candidates):
            if candidate.precision is not None:
                half = [100 * candidate.precision.k_part(int(n)) for n in trials]
                ax.plot(trials, half, **_look(i), label=_name(candidate))
        if wish is not None:
            ax.axhline(100 * wish, color="0.6", linewidth=0.8, zorder=0)
        ax.set_xscale("log")
        ax.set_yscale("log")
        ax.set_xticks([8, 16, 40, 80, 160, 400])
        ax.set_yticks([t for t in (1, 2, 5, 10, 20, 50) if _inside(ax.get_ylim(), t)])
        for axis in (ax.xaxis, ax.yaxis):
            axis.set_major_formatter(ScalarFormatter())
            axis.set_minor_formatter(NullFormatter())
        label_axes(ax, "trials", "95 % interval of K (± %)")
    return ax


def plan_figure(plan: Plan) -> Figure:
    """Plot displacement, acceleration and interval, side by side with one legend.

    Parameters
    ----------
    plan : Plan
        Result of `armimpedance.plan`.

    Returns
    -------
    Figure
        Three panels.

    Examples
    --------
    >>> from armimpedance.hand.planning.show import plan
    >>> from armimpedance.hand.planning.show import plan_figure
    >>> len(plan_figure(plan(shape="minimum_jerk", duration_s=0.3)).axes)
    3
    """
    chosen = best_of_each(plan)
    figure = new_figure(TWO_COLUMNS_IN, 2.7)
    with print_style():
        left, middle, right = figure.subplots(1, 3)
        plot_courses(chosen, left)
        plot_courses(chosen, middle, order=2)
        plot_interval_over_trials(chosen, right, wish=plan.wish.k_part)
        handles, labels = right.get_legend_handles_labels()
        figure.legend(
            handles, labels, loc="outside upper center", ncols=2 if len(labels) in (2, 4) else 3
        )
    return figure


def _name(candidate: Candidate) -> str:
    name = candidate.name.replace("_", " ")
    profile = candidate.profile
    return name if profile is None else f"{name}, {profile.duration_s:g} s"


def _look(i: int) -> dict[str, Any]:
    return {"color": _COLORS[i % len(_COLORS)], "linestyle": LINE_STYLES[i % len(LINE_STYLES)]}


def _inside(limits: tuple[float, float], value: float) -> bool:
    return limits[0] <= value <= limits[1]
