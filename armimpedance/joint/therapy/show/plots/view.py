"""Drawings of the contribution for a therapist: over each movement, with its uncertainty.

A line is the share of the movement so far (`contribution_so_far`) with its 95 % band. It starts
when the share is valid and ends at the share of the whole movement, which is at the right of a
panel with its 95 % interval. If the share of the whole movement is not valid, the projection is
shown instead, hollow and dashed and named in the title; if neither is valid, the dot is grey.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.share.of_movement import contribution_of, contribution_so_far
from armimpedance.joint.therapy.share.result import Contribution
from armimpedance.show.plots import (
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

    from armimpedance.core.arrays import FloatArray
    from armimpedance.joint.therapy.arm.movements import MovementTorques
    from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
    from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot

# Result of a whole movement: its share, or its projection if the share is not valid.


@dataclass(frozen=True)
class WholeMovement:
    """Result of a whole movement: its share, or its projection if the share is not valid.

    `percent`, `sd`, `half`: value, standard error, and half-width of the 95 % interval.
    `valid`: True if the share or the projection is valid.
    """

    metric: Literal["share", "projection"]
    percent: float
    sd: float
    half: float
    valid: bool

    @classmethod
    def of(cls, whole: Contribution) -> WholeMovement:
        """Result of the movement with the contribution `whole`."""
        is_share = whole.share.valid or not whole.projection.valid
        metric = whole.share if is_share else whole.projection
        half = float(np.ptp(metric.ci95)) / 2
        name: Literal["share", "projection"] = "share" if is_share else "projection"
        return cls(name, metric.percent, metric.sd, half, metric.valid)


def contribution_text(whole: Contribution) -> str:
    """``52 ± 3 %``: share and half of its 95 % interval; else the projection, marked as such."""
    result = WholeMovement.of(whole)
    if not result.valid:
        return "cannot be told"
    mark = " (projection)" if result.metric == "projection" else ""
    return f"{round(result.percent)} {_half([result])}{mark}"


def contribution_texts(whole: Sequence[WholeMovement]) -> str:
    """``60, 59p, 61 ± 3 %``: repetitions with the widest interval; a p marks projections."""
    if not any(w.valid for w in whole):
        return "cannot be told"
    numbers = [
        (f"{round(w.percent)}{'p' if w.metric == 'projection' else ''}" if w.valid else "?")
        for w in whole
    ]
    return f"{', '.join(numbers)} {_half(whole)}"


def _half(whole: Sequence[WholeMovement]) -> str:
    """``± 3 %``: the widest interval."""
    widest = max(w.half for w in whole if w.valid)
    return f"± {max(round(widest), 1)} %"


_ROW_IN: Final = 1.75
#: Colors of the repetitions; with more repetitions they are used again.
_COLORS: Final = tuple(OKABE_ITO[name] for name in ("blue", "vermillion", "green", "purple"))
_INVALID: Final = "0.72"
#: Order of the conditions; others follow in the order of the session.
_ORDER: Final = ("passive", "half_active", "active", "resistive")
#: Smallest range of a panel, per cent.
_LEAST_RANGE: Final = (-30.0, 130.0)
#: Fraction of a panel's width, at its right, for whole movements.
_STRIP: Final = 0.2
_PROJECTION: Final = "projection"
_UNTOLD: Final = "cannot be told"


def plot_contribution(
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    ax: Axes | None = None,
    *,
    unrepeatable: bool = False,
) -> Axes:
    """Draw one movement's contribution over time, and at the right that of the whole movement.

    `unrepeatable`: True to continue if the passive repetitions of this axis did not agree.
    Raises InputError: as `of_movement.contribution_of`.
    """
    whole = contribution_of(torques, robot, arm, unrepeatable=unrepeatable)
    result = WholeMovement.of(whole)
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, 3.0) if ax is None else ax
        shown = [_course(ax, torques, robot, arm, result, _COLORS[0])]
        _finish(ax, [torques], [result], _COLORS, shown)
        name = f"{torques.movement}, {_spoken(torques.condition)}, trial {torques.trial}"
        ax.set_title(f"{name}: {contribution_text(whole)}", loc="left", fontsize=9)
        label_axes(ax, "time (s)", "contribution (%)")
    return ax


def plot_feedback(
    movements: Sequence[MovementTorques],
    robot: TherapyRobot,
    arm: PassiveArm,
    *,
    unrepeatable: bool = False,
) -> Figure:
    """Draw a session: one row per condition, one column per movement, repetitions in one panel.

    A panel without a contribution shows the reason.

    Parameters
    ----------
    movements : sequence of MovementTorques
        Movements of the whole session.
    robot : TherapyRobot
        Identified robot.
    arm : PassiveArm
        The person's arm, calibrated in this robot.
    unrepeatable : bool
        True to continue if the passive repetitions of an axis did not agree.

    Returns
    -------
    Figure
        Figure with a panel for each condition and movement.

    Raises
    ------
    InputError
        No movements.

    Examples
    --------
    A movement of two seconds; the motors give 40 % of the passive arm's torque:

    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import armimpedance as ai
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from armimpedance.joint.therapy import MovementTorques
    >>> from armimpedance.joint.therapy.arm.passive_arm import Elastic
    >>> from armimpedance.joint.therapy.robot.therapy_robot import Loads
    >>> from manipulandum_sim.therapy import therapy_device
    >>> loads = Loads(np.zeros(23), np.zeros((23, 23)), np.full(5, 0.005))
    >>> robot = replace(drawings_of(therapy_device()), loads=loads)
    >>> elastic = Elastic(
    ...     axis="elevation",
    ...     stiffness=4.0,
    ...     offset=-4.0,
    ...     covariance=0.004 * np.eye(2),
    ...     dof=4.0,
    ...     range_rad=[0.8, 1.9],
    ...     between=0.001 * np.eye(2),
    ...     noise_density=1e-4,
    ...     mass_gradient=np.zeros(2),
    ...     robot_gradient=np.zeros((2, 23)),
    ... )
    >>> arm = ai.PassiveArm("P1", robot.name, 0.3, segments=(), elastic=(elastic,))
    >>> q, zero = np.linspace(0.8, 1.9, 2001), np.zeros(2001)
    >>> movement = MovementTorques(
    ...     trial="1",
    ...     condition="active",
    ...     movement="elevation",
    ...     axis=0,
    ...     axis_name="elevation",
    ...     sample_rate_hz=1000.0,
    ...     time_s=np.arange(2001) / 1000,
    ...     q=q,
    ...     qd=zero + 0.55,
    ...     motor=0.4 * (8.0 + 4.0 * q - 4.0),
    ...     robot=zero,
    ...     rigid_arm=zero + 8.0,
    ...     elastic=4.0 * q - 4.0,
    ...     robot_inertia=zero,
    ...     robot_gradient=np.zeros((2001, 23)),
    ... )
    >>> figure = ai.plot_feedback([movement], robot, arm)
    >>> figure.axes[0].get_title(loc="left")
    'elevation, active: 60 ± 2 %'
    """
    if not movements:
        raise InputError("no movements to draw", expected="one or more")
    conditions = _in_order(m.condition for m in movements)
    names = tuple(dict.fromkeys(m.movement for m in movements))
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * len(conditions) + 0.5)
    with print_style():
        grid = figure.subplots(len(conditions), len(names), squeeze=False)
        for row, condition in zip(grid, conditions, strict=True):
            for ax, name in zip(row, names, strict=True):
                group = [m for m in movements if (m.condition, m.movement) == (condition, name)]
                _panel(ax, group, robot, arm, unrepeatable)
        for ax in grid[:-1].flat:
            ax.set_xlabel("")
        for ax in grid[:, 1:].flat:
            ax.set_ylabel("")
        _legend(figure, movements, grid.flat)
    return figure


def _repetitions(movements: Sequence[MovementTorques]) -> int:
    counts = Counter((m.condition, m.movement) for m in movements)
    return min(max(counts.values()), len(_COLORS))


def _legend(figure: Figure, movements: Sequence[MovementTorques], axes: Iterable[Axes]) -> None:
    """Add the legend: repetitions, and marks of exceptions that occur."""
    from matplotlib.lines import Line2D

    repetitions = _repetitions(movements)
    entries = {
        f"repetition {i + 1}": Line2D([], [], color=_COLORS[i], lw=1.3) for i in range(repetitions)
    }
    occurring = {c.get_label() for ax in axes for c in ax.containers}
    look = {"ls": "", "marker": "o", "ms": 4}
    for label, name, color, fill in (
        (_PROJECTION, "p: projection", "black", "white"),
        (_UNTOLD, _UNTOLD, _INVALID, _INVALID),
    ):
        if label in occurring:
            entries[name] = Line2D([], [], color=color, mfc=fill, **look)  # type: ignore[arg-type]
    figure.legend(
        list(entries.values()), list(entries), loc="outside upper center", ncols=len(entries)
    )


def _panel(
    ax: Axes,
    group: Sequence[MovementTorques],
    robot: TherapyRobot,
    arm: PassiveArm,
    unrepeatable: bool,
) -> None:
    if not group:
        ax.axis("off")
        return
    title = f"{group[0].movement}, {_spoken(group[0].condition)}"
    try:
        results = [contribution_of(m, robot, arm, unrepeatable=unrepeatable) for m in group]
    except InputError as refused:
        _say_why(ax, str(refused))
        ax.set_title(title, loc="left", fontsize=8)
        return
    whole = [WholeMovement.of(result) for result in results]
    shown = [
        _course(ax, m, robot, arm, w, _COLORS[i % len(_COLORS)])
        for i, (m, w) in enumerate(zip(group, whole, strict=True))
    ]
    _finish(ax, group, whole, _COLORS, shown)
    ax.set_title(f"{title}: {contribution_texts(whole)}", loc="left", fontsize=8)
    label_axes(ax, "time (s)", "contribution (%)")


def _say_why(ax: Axes, reason: str) -> None:
    from textwrap import fill

    ax.set(xticks=[], yticks=[])
    text = fill(f"no contribution: {reason}", 46)
    ax.text(0.03, 0.9, text, transform=ax.transAxes, va="top", fontsize=7.5, color="0.3")


def _course(
    ax: Axes,
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    whole: WholeMovement,
    color: str,
) -> FloatArray:
    """Draw line and band of one movement; return the range (2,) of the valid values."""
    so_far = contribution_so_far(torques, robot, arm, whole.metric)
    time = so_far.time_s - so_far.time_s[0]
    percent = np.where(so_far.valid, so_far.percent, np.nan)
    # t factor of this movement: stiffness and its spread are from few repetitions
    half = whole.half * so_far.sd / whole.sd
    ax.fill_between(time, percent - half, percent + half, color=color, alpha=0.18, lw=0)
    ax.plot(time, percent, color=color, lw=1.3, ls="-" if whole.metric == "share" else (0, (4, 2)))
    # without a spread there is no band, and no range for the axis
    if not np.isfinite(percent - half).any():
        return np.array([np.nan, np.nan])
    return np.array([np.nanmin(percent - half), np.nanmax(percent + half)])


def _finish(
    ax: Axes,
    group: Sequence[MovementTorques],
    whole: Sequence[WholeMovement],
    colors: Sequence[str],
    shown: Sequence[FloatArray],
) -> None:
    """Draw whole movements at the right and lines at 0 and 100 %; set the limits."""
    end = max(float(m.time_s[-1] - m.time_s[0]) for m in group)
    width = _STRIP / (1 - _STRIP) * end
    places = end + width * (np.arange(len(whole)) + 1) / (len(whole) + 1)
    for i, (place, w) in enumerate(zip(places, whole, strict=True)):
        own = colors[i % len(colors)]
        color, label = (own, w.metric) if w.valid else (_INVALID, _UNTOLD)
        ax.errorbar(
            place, w.percent, w.half, fmt="o", ms=3, color=color, elinewidth=1.4, capsize=3,
            mfc="white" if label == _PROJECTION else color, label=label,
        )  # fmt: skip
    ax.axvline(end, color="0.6", lw=0.6)
    for level, style in ((0.0, "-"), (100.0, (0, (5, 2)))):
        ax.axhline(level, color="0.35", lw=0.8, ls=style, zorder=1)
    ax.set_xlim(0, end + width)
    ax.set_ylim(_limits(whole, shown))
    ticks = [float(t) for t in ax.get_xticks() if 0 <= t <= end]
    ax.set_xticks([*ticks, end + width / 2], [*(f"{t:g}" for t in ticks), "whole"])


def _limits(whole: Sequence[WholeMovement], shown: Sequence[FloatArray]) -> tuple[float, float]:
    """Limits of the axis: slightly wider than whole movements and all valid values."""
    ends = [e for w in whole if w.valid for e in (w.percent - w.half, w.percent + w.half)]
    values = np.array([*_LEAST_RANGE, *ends, *(x for pair in shown for x in pair)])
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return low - 0.04 * (high - low), high + 0.04 * (high - low)


def _in_order(conditions: Iterable[str]) -> tuple[str, ...]:
    present = tuple(dict.fromkeys(conditions))
    ordered = [c for c in _ORDER if c in present]
    return (*ordered, *(c for c in present if c not in _ORDER))


def _spoken(condition: str) -> str:
    return condition.replace("_", " ")
