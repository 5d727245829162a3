"""The calibrated therapy robot: friction over speed, counterbalance spring over angle."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.numerics.regression import t_factor
from armimpedance.show.plots import (
    OKABE_ITO,
    ONE_COLUMN_IN,
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

    from armimpedance.joint.therapy.arm.verdict import ArmCalibration, AxisCalibration
    from armimpedance.joint.therapy.robot.calibrate import RobotCalibration
    from armimpedance.joint.therapy.robot.holds import SpringHolds
    from armimpedance.joint.therapy.robot.sweeps import AxisSweeps
    from armimpedance.numerics.regression import NamedParameter

_ROW_IN = 2.3
_COLUMNS: Final = 3
_UP, _DOWN, _LAW = OKABE_ITO["blue"], OKABE_ITO["vermillion"], "black"
#: Points of a drawn model.
_FINE: Final = 300
#: Upper limit of the friction axis, as a multiple of the largest friction.
_ROOM: Final = 1.15


def plot_friction(sweeps: AxisSweeps, ax: Axes | None = None) -> Axes:
    """Draw the friction of one axis over the speed, both directions above each other.

    The sign of the torque in the negative direction is changed, so that a friction that is odd in
    the velocity gives one line. Speeds in the shaded static range were not fitted; their points are
    hollow.

    Parameters
    ----------
    sweeps : AxisSweeps
        Identified friction of the axis.
    ax : Axes, optional
        Where to draw; without it a new figure is made.

    Returns
    -------
    Axes
    """
    points = sweeps.points
    speed = np.rad2deg([p.speed_rad_s for p in points])
    used = np.array([p.used for p in points])
    low, high = speed.min() / 1.6, speed.max() * 1.3
    lowest = float(np.rad2deg(sweeps.lowest_used_rad_s))
    from matplotlib.ticker import LogLocator, NullFormatter

    with print_style():
        ax = new_axes(ONE_COLUMN_IN, _ROW_IN) if ax is None else ax
        ax.set_xscale("log")
        if not used.all():
            ax.axvspan(low, lowest / 1.1, color="0.92", lw=0, label="static range")
        for part, style in ((low, ":"), (lowest, "-")):
            drawn = np.geomspace(part, high if part == lowest else lowest, _FINE)
            law = sweeps.friction(np.deg2rad(drawn))
            ax.plot(drawn, law, style, color=_LAW, lw=1.2, label="law" if style == "-" else None)
        for torque, color, marker, label in (
            (np.array([p.up_Nm for p in points]), _UP, "^", "positive direction"),
            (-np.array([p.down_Nm for p in points]), _DOWN, "v", "negative, turned round"),
        ):
            for shown, fill in ((used, color), (~used, "none")):
                ax.plot(
                    speed[shown], torque[shown], ls="", marker=marker, ms=5, color=color,
                    mfc=fill, label=label if fill != "none" else None,
                )  # fmt: skip
        ax.set_xlim(low, high)
        # the automatic margin is zero if the friction is the same at all speeds
        largest = max(max(p.up_Nm, -p.down_Nm) for p in points)
        ax.set_ylim(0, max(ax.get_ylim()[1], _ROOM * largest))
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter(NullFormatter())
        label_axes(ax, "speed (deg/s)", "friction (N m)")
    return ax


def plot_spring(spring: SpringHolds, ax: Axes | None = None) -> Axes:
    """Draw the counterbalance spring's torque over the angle: holds, polynomial, band."""
    q = np.linspace(spring.angle_rad.min(), spring.angle_rad.max(), _FINE)
    law, sd = spring.polynomial(q)
    half = t_factor(spring.fit.dof) * sd
    angle = np.rad2deg(spring.angle_rad)
    with print_style():
        ax = new_axes(ONE_COLUMN_IN, _ROW_IN) if ax is None else ax
        ax.fill_between(np.rad2deg(q), law - half, law + half, color="0.8", lw=0, label="95 %")
        ax.plot(np.rad2deg(q), law, color=_LAW, lw=1.2, label="polynomial")
        for torque, color, marker, label in (
            (spring.from_below_Nm, _UP, "^", "held from below"),
            (spring.from_above_Nm, _DOWN, "v", "held from above"),
        ):
            ax.plot(angle, torque, ls="", marker=marker, ms=5, color=color, label=label)
        ax.plot(angle, spring.spring_Nm, ls="", marker=".", ms=5, color="0.4", label="their mean")
        label_axes(ax, "angle (deg)", "spring (N m)")
    return ax


def plot_robot_calibration(calibration: RobotCalibration) -> Figure:
    """Draw the friction of every axis, and the counterbalance spring.

    Parameters
    ----------
    calibration : RobotCalibration
        From sweeps and holds.

    Returns
    -------
    Figure
        Figure with a panel for each axis and one for the spring.

    Examples
    --------
    Friction at six speeds of every axis, and the spring's torque at seven angles:

    >>> import numpy as np
    >>> import armimpedance as ai
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from armimpedance.numerics.regression import FitSummary
    >>> from armimpedance.joint.therapy import RobotCalibration
    >>> from armimpedance.joint.therapy.robot.holds import fit_holds
    >>> from armimpedance.joint.therapy.robot.steady import SteadyPart
    >>> from armimpedance.joint.therapy.robot.sweeps import fit_axis
    >>> from manipulandum_sim.therapy import therapy_device
    >>> noise = np.random.default_rng(1)
    >>> def sweep(axis, speed):
    ...     load = 2 * np.sign(speed) + 0.8 * speed + 0.01 * noise.standard_normal(80)
    ...     angle, way = np.linspace(0.2, 0.8, 80), 1 if speed > 0 else -1
    ...     return SteadyPart("1", axis, angle, np.full(80, speed), load, way)
    >>> def hold(angle, way):
    ...     load = 4 * angle**2 - 12 * angle + 2 * way + 0.01 * noise.standard_normal(20)
    ...     return SteadyPart("1", 0, np.full(20, angle), np.zeros(20), load, way)
    >>> speeds = (-1.0, -0.5, -0.2, 0.2, 0.5, 1.0)
    >>> axes = [fit_axis([sweep(i, v) for v in speeds], spring=i == 0) for i in range(5)]
    >>> spring = fit_holds([hold(q, way) for q in np.linspace(0.6, 2.2, 7) for way in (1, -1)])
    >>> summary = FitSummary("by hand", 0, 1.0, 1.0, 0, 1.0, 1.0, ())
    >>> robot = drawings_of(therapy_device())
    >>> figure = ai.plot_robot_calibration(RobotCalibration(robot, summary, tuple(axes), spring))
    >>> figure.axes[-1].get_title(loc="left")
    'spring of axis 1'
    """
    names, panels = calibration.robot.axes, len(calibration.axes) + 1
    rows = -(-panels // _COLUMNS)
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * rows + 0.5)
    with print_style():
        axes = list(figure.subplots(rows, _COLUMNS, squeeze=False).flat)
    for ax, sweeps in zip(axes, calibration.axes, strict=False):
        plot_friction(sweeps, ax)
        _title(ax, f"axis {sweeps.axis + 1}, {names[sweeps.axis]}")
    plot_spring(calibration.spring, axes[panels - 1])
    _title(axes[panels - 1], f"spring of axis {calibration.robot.spring_axis + 1}")
    for ax in axes[panels:]:
        ax.axis("off")
    with print_style():
        friction = max(axes[: panels - 1], key=lambda ax: len(ax.get_legend_handles_labels()[1]))
        handles, labels = friction.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=len(labels))
        handles, labels = axes[panels - 1].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _title(ax: Axes, text: str) -> None:
    with print_style():
        ax.set_title(text, loc="left", fontsize=9)


# A person's passive arm: support of each repetition over the angle, model and verdict.

_ARM_ROW_IN = 2.6
#: Characters per line of the verdict.
_VERDICT = 110
#: Colors of the repetitions, from the first to the last.
_SHADES = (OKABE_ITO["sky"], OKABE_ITO["blue"], OKABE_ITO["green"], OKABE_ITO["orange"])


def plot_passive_axis(
    calibration: ArmCalibration, axis: AxisCalibration, ax: Axes | None = None
) -> Axes:
    """Draw the support (18) of every passive repetition about one axis, and the model (14).

    The model's line is for the first repetition of each movement; weight and inertia alone are a
    second line. A refused model is grey. Ends so slow that the gears may stick are left out, as in
    the fit.

    `axis`: one of the axes of the calibration.
    """
    movements = [m for m in calibration.movements if m.axis == axis.axis]
    refused = not axis.elastic.repeatable
    low, high = axis.elastic.range_rad
    seen: dict[str, int] = {}
    with print_style():
        ax = new_axes(TWO_COLUMNS_IN, _ARM_ROW_IN) if ax is None else ax
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
    """Draw one row per axis, with stiffness, rest angle and verdict above it.

    Parameters
    ----------
    calibration : ArmCalibration
        Calibration of a person's arm.

    Returns
    -------
    Figure
        Figure with a panel for each axis.

    Examples
    --------
    Three passive elevations of one radian in a robot without friction:

    >>> from dataclasses import replace
    >>> import numpy as np
    >>> import pandas as pd
    >>> import armimpedance as ai
    >>> from armimpedance.lab.simulated.therapy import drawings_of
    >>> from armimpedance.joint.therapy import robot_bodies
    >>> from armimpedance.joint.therapy.robot.therapy_robot import Loads
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
    figure = new_figure(TWO_COLUMNS_IN, _ARM_ROW_IN * len(calibration.axes) + 0.35)
    with print_style():
        axes = list(figure.subplots(len(calibration.axes), squeeze=False)[:, 0])
        for ax, axis in zip(axes, calibration.axes, strict=True):
            plot_passive_axis(calibration, axis, ax)
            ax.set_title(_arm_title(axis), loc="left", fontsize=8, linespacing=1.4)
        once: dict[str, Artist] = {}
        for ax in axes:
            handles, labels = ax.get_legend_handles_labels()
            once |= dict(zip(labels, handles, strict=True))
        labels = sorted(once, key=lambda label: (not label.startswith("repetition"), label))
        figure.legend(
            [once[label] for label in labels], labels, loc="outside upper center", ncols=len(once)
        )
    return figure


def _arm_title(axis: AxisCalibration) -> str:
    words = f"{axis.elastic.axis}: {_known(axis.stiffness)}, {_known(axis.rest)}"
    return f"{words}\n{fill(axis.elastic.verdict, _VERDICT)}"


def _known(parameter: NamedParameter) -> str:
    """``k_s 4.79 ± .21 N m/rad``: value and half of the 95 % interval."""
    low, high = parameter.ci95
    if not np.isfinite([parameter.value, low, high]).all():
        return f"{parameter.name} unknown"
    half = (high - low) / 2
    decimals = max(0, 1 - int(np.floor(np.log10(half)))) if half > 0 else 3
    unit = unit_text(parameter.unit)
    return f"{parameter.name} {parameter.value:.{decimals}f} ± {half:.{decimals}f} {unit}"
