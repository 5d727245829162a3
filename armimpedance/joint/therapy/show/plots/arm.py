"""A person's passive arm: what each repetition needed over the angle, the model, its verdict."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.show.plots import (
    OKABE_ITO,
    TWO_COLUMNS_IN,
    label_axes,
    new_axes,
    new_figure,
    print_style,
    unit_text,
)

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from armimpedance.joint.therapy.arm.calibration import ArmCalibration, AxisCalibration
    from armimpedance.numerics.regression import NamedParameter

_ROW_IN = 2.6
#: Letters of a line of the verdict.
_VERDICT = 110
#: Repetitions, from the first to the last.
_SHADES = (OKABE_ITO["sky"], OKABE_ITO["blue"], OKABE_ITO["green"], OKABE_ITO["orange"])


def plot_passive_axis(
    calibration: ArmCalibration, axis: AxisCalibration, ax: Axes | None = None
) -> Axes:
    """Draw the support (18) of every passive repetition about one axis, and the model (14).

    The model's line is that of the first repetition of each movement; weight and inertia alone
    are drawn beside. A refused model is drawn in grey. Ends so slow that the gears may stick are
    left out, as they are from the fit.

    Parameters
    ----------
    calibration : ArmCalibration
    axis : AxisCalibration
        One of its axes.
    """
    movements = [m for m in calibration.movements if m.axis == axis.axis]
    refused = not axis.elastic.repeatable
    low, high = axis.elastic.range_rad
    seen: dict[str, int] = {}
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ROW_IN) if ax is None else ax
        for m in movements:
            number = seen[m.movement] = seen.get(m.movement, 0) + 1
            q, first = np.rad2deg(m.q), number == 1
            new = len(seen) == 1
            slid = (m.q >= low) & (m.q <= high)
            color = _SHADES[(number - 1) % len(_SHADES)]
            label = f"repetition {number}" if new else None
            ax.plot(q[slid], m.support[slid], color=color, lw=0.9, label=label)
            if first:
                color = "0.5" if refused else OKABE_ITO["vermillion"]
                own = "refused model" if refused else "model"
                weight = "weight and inertia"
                ax.plot(q, m.arm, color=color, lw=1.6, label=own if new else None)
                ax.plot(q, m.rigid_arm, ":", color="black", label=weight if new else None)
        ax.axhline(0, color="0.8", lw=0.6, zorder=0)
        ax.margins(x=0.02)
        label_axes(ax, f"{movements[0].axis_name} (deg)", "support (N m)")
    return ax


def plot_passive_arm(calibration: ArmCalibration) -> Figure:
    """One row an axis, its stiffness, rest angle and verdict above it.

    Parameters
    ----------
    calibration : ArmCalibration
        Of a person.

    Returns
    -------
    Figure
        The figure, with a panel for each axis.

    Examples
    --------
    Three passive elevations of one radian in a robot without friction:

    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import pandas as pd
    >>> import armimpedance as ai
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from armimpedance.joint.therapy import robot_bodies
    >>> from armimpedance.joint.therapy import Loads
    >>> from manipulandum_sim.therapy import therapy_device
    >>> loads = Loads(np.zeros(23), np.zeros((23, 23)), np.full(5, 0.005))
    >>> robot = replace(drawings_of(therapy_device()), loads=loads)
    >>> n, time_s = 1601, np.arange(1601) / 1000
    >>> q, qd, qdd = np.tile([1.2, 0.5, 0.0, 1.0, 0.0], (n, 1)), np.zeros((n, 5)), np.zeros((n, 5))
    >>> q[:, 0], qd[:, 0] = 0.8 + time_s / 1.6, 1 / 1.6
    >>> motor = robot_bodies(robot).torque(q, qd, qdd)
    >>> motor[:, 0] += 9.0 * np.sin(q[:, 0]) + 4.0 * (q[:, 0] - 1.0)
    >>> trial = {"condition": "passive", "movement": "elevation", "axis": 1}
    >>> trial |= {"onset_s": 0.0, "end_s": 1.6}
    >>> noise = 0.02 * np.random.default_rng(1).standard_normal((3 * n, 5))
    >>> recording = ai.Recording(
    ...     kind="joint",
    ...     sample_rate_hz=1000.0,
    ...     trials=pd.DataFrame([{"trial": i, **trial} for i in (1, 2, 3)]),
    ...     offsets=[0, n, 2 * n, 3 * n],
    ...     time_s=np.tile(time_s, 3),
    ...     position=np.tile(q, (3, 1)),
    ...     force=noise - np.tile(motor, (3, 1)),
    ...     torque="commanded",
    ...     subject=ai.Subject("P1", mass_kg=70.0, upper_arm_m=0.3, forearm_hand_m=0.35),
    ... )
    >>> figure = ai.plot_passive_arm(ai.calibrate_arm(recording, robot))
    >>> figure.axes[0].get_xlabel()
    'elevation (deg)'
    """
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * len(calibration.axes) + 0.35)
    with print_style():
        axes = list(figure.subplots(len(calibration.axes), squeeze=False)[:, 0])
        for ax, axis in zip(axes, calibration.axes, strict=True):
            plot_passive_axis(calibration, axis, ax)
            ax.set_title(_title(axis), loc="left", fontsize=8, linespacing=1.4)
        once: dict[str, Artist] = {}
        for ax in axes:
            handles, labels = ax.get_legend_handles_labels()
            once |= dict(zip(labels, handles, strict=True))
        labels = sorted(once, key=lambda label: (not label.startswith("repetition"), label))
        figure.legend(
            [once[label] for label in labels], labels, loc="outside upper center", ncols=len(once)
        )
    return figure


def _title(axis: AxisCalibration) -> str:
    words = f"{axis.elastic.axis}: {_known(axis.stiffness)}, {_known(axis.rest)}"
    return f"{words}\n{fill(axis.elastic.verdict, _VERDICT)}"


def _known(parameter: NamedParameter) -> str:
    """``k_s 4.79 ± .21 N m/rad``: half of the 95 % interval."""
    low, high = parameter.ci95
    if not np.isfinite([parameter.value, low, high]).all():
        return f"{parameter.name} unknown"
    half = (high - low) / 2
    decimals = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0 else 3
    unit = unit_text(parameter.unit)
    return f"{parameter.name} {parameter.value:.{decimals}f} ± {half:.{decimals}f} {unit}"
