"""A therapy robot, a passive arm and contributions as text for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from math import degrees, isfinite
from typing import Any, Final

import numpy as np

from armimpedance.core.findings import warnings_of
from armimpedance.core.shown import fixed, with_half_width
from armimpedance.joint.therapy.arm.mockup import MockupCheck
from armimpedance.joint.therapy.arm.verdict import ArmCalibration, AxisCalibration
from armimpedance.joint.therapy.robot.calibrate import RobotCalibration
from armimpedance.joint.therapy.robot.checks import AxisValidation
from armimpedance.joint.therapy.share.result import Contribution
from armimpedance.numerics.regression import FitSummary, NamedParameter, t_factor
from armimpedance.show.text import (
    TABLE_WIDTH,
    aligned_table,
    checks_lines,
    counted,
    note_numbers,
    numbered_notes,
)

_LOADS_HEADER = (
    *("axis", "tau_c (N m)", "k_v (N m s/rad)"),
    *("k_c (N m/rad)", "q_c (deg)", "from (deg/s)"),
)
_FROM = "from: the lowest speed that was fitted, above the static range."
_INTERVALS = "± is the half-width of the 95 % interval."
_VALIDATION_HEADER = ("axis", "R^2", "rms (N m)", "moving: R^2", "rms (N m)", "share of samples")
_MASSES = (
    "± is the half-width of the 95 % interval: repetitions, the person's masses about the table, "
    "what is not known of the robot, and of an axis that was moved one way only its viscosity."
)


def robot_text(calibration: RobotCalibration) -> str:
    """Friction and cables per axis, the spring, predictions of other movements, and notes.

    `calibration`: calibration of the robot, with or without a validation.
    """
    robot, summary = calibration.robot, calibration.summary
    rows = [
        [
            f"{sweeps.axis + 1} {robot.axes[sweeps.axis]}",
            *(_cell(summary, name, sweeps.axis + 1) for name in ("tau_c", "k_v", "k_c")),
            _cell(summary, "q_c", sweeps.axis + 1, angle=True),
            f"{degrees(sweeps.lowest_used_rad_s):.3g}",
        ]
        for sweeps in calibration.axes
    ]
    spring = calibration.spring
    joint = robot.spring_axis + 1
    terms = ", ".join(f"{n} {_cell(summary, n, joint)}" for n in ("c_0", "c_1", "c_2"))
    lines = [
        f"robot {robot.name}, {counted(robot.n_axes, 'axis').replace('axiss', 'axes')}",
        "",
        aligned_table(_LOADS_HEADER, rows),
        "",
        f"spring on axis {joint}, c_0 + c_1 q + c_2 q^2 (N m, rad), from holds at "
        f"{counted(len(spring.angle_rad), 'angle')}:",
        f"  {terms}",
    ]
    if calibration.validation:
        table = _validation_table(calibration.validation)
        lines += ["", "movements that were not fitted", table]
    return "\n".join([*lines, "", *numbered_notes([*calibration.notes, _FROM, _INTERVALS])])


def _validation_table(validation: Sequence[AxisValidation]) -> str:
    rows = [
        [
            f"{v.axis + 1} {v.name}",
            f"{v.r2:.3f}",
            f"{v.rms_Nm:.3g}",
            f"{v.moving_r2:.3f}",
            f"{v.moving_rms_Nm:.3g}",
            f"{100 * v.moving_share:.0f} %",
        ]
        for v in validation
    ]
    return aligned_table(_VALIDATION_HEADER, rows)


def arm_text(calibration: ArmCalibration) -> str:
    """Masses, stiffness and verdict per axis, references for (19), and warnings.

    `calibration`: calibration of one person's arm.
    """
    arm = calibration.arm
    masses = ", ".join(f"{s.name} {s.mass_kg:.3g} kg at {s.com_m:.3g} m" for s in arm.segments)
    lines = [
        f"passive arm of subject {arm.subject} in robot {arm.robot}",
        _indented(f"{masses} of its link; upper arm {arm.upper_arm_m:.3g} m"),
        "",
    ]
    for axis in calibration.axes:
        lines += _axis_lines(axis)
    rows = [
        [r.movement, r.axis, str(len(r.support_Nm)), _spread(r.support_Nm)] for r in arm.references
    ]
    header = ("movement", "axis", "repetitions", "mean support ± sd (N m)")
    lines += ["", aligned_table(header, rows), ""]
    checks = calibration.summary.checks
    from_checks = warnings_of(checks)
    notes = [*(note for note in calibration.warnings if note not in from_checks), _MASSES]
    return "\n".join([*lines, *numbered_notes(notes), *checks_lines(checks)])


def _axis_lines(axis: AxisCalibration) -> list[str]:
    k, q = axis.stiffness, axis.rest
    shown = f"k_s {_value(k)} N m/rad"
    if isfinite(q.value):
        shown += f", q_0 {_value(q)} rad"
    lines = [f"axis {axis.axis + 1} {axis.elastic.axis}: {shown}", _indented(axis.elastic.verdict)]
    if axis.direction_Nm is not None:
        lines.append(
            f"  both ways: {_value(axis.direction_Nm)} N m more against the movement than modelled"
        )
    return lines


def _indented(sentence: str) -> str:
    return textwrap.fill(sentence, TABLE_WIDTH, initial_indent="  ", subsequent_indent="  ")


def _spread(values: Any) -> str:
    sd = float(np.std(values, ddof=1)) if len(values) > 1 else float("nan")
    return f"{float(np.mean(values)):.3g} ± {sd:.2g}"


def mockup_text(check: MockupCheck) -> str:
    """Measurements of a mock-up by the robot, and their values from its weight.

    `check`: gravity and inertia.
    """
    header = ("", "measured", "from masses and lengths", "difference", "rms left (N m)")
    rows = [
        [
            "torque with the arm level (N m)",
            _value(check.gravity),
            f"{check.gravity_model_Nm:.4g}",
            _per_cent_off(check.gravity.value, check.gravity_model_Nm),
            f"{check.gravity_rms_Nm:.2g}",
        ],
        [
            "inertia about the vertical (kg m^2)",
            _value(check.inertia),
            f"{check.inertia_model_kgm2:.4g}",
            _per_cent_off(check.inertia.value, check.inertia_model_kgm2),
            f"{check.inertia_rms_Nm:.2g}",
        ],
    ]
    return "\n".join([aligned_table(header, rows), "", _INTERVALS])


def _per_cent_off(measured: float, model: float) -> str:
    return f"{100 * (measured / model - 1):+.2f} %"


def _cell(summary: FitSummary, name: str, joint: int, angle: bool = False) -> str:
    named = [p for p in summary.parameters if (p.name, p.joint) == (name, joint)]
    if not named:
        return "-"
    return _value(named[0], degrees(1.0) if angle else 1.0)


def _value(parameter: NamedParameter, scale: float = 1.0) -> str:
    if not (isfinite(parameter.value) and isfinite(parameter.sd_robust)):
        return "not identified"
    half = t_factor(parameter.dof) * parameter.sd_robust
    return with_half_width(scale * parameter.value, scale * float(half))


# The patient's contribution as text for a terminal: one row per movement, then means.

_HEADER = (
    *("trial", "condition", "movement", "share (95 %)", "projection", "ratio (4)"),
    *("reference (19)", "notes"),
)
_MEANS_HEADER = (
    *("condition", "movement", "n", "share (%)", "projection", "ratio (4)", "reference (19)"),
)
_METRICS: Final = ("share", "projection", "ratio", "reference")
_LEGEND = (
    "Per cent: 0 is a passive arm, 100 one that needs no support, below 0 one that resists. share: "
    "of the passive arm's torque in the person's, whatever of the robot's own inertia the person "
    "moved beside; projection: the same without that allowance. ± is a standard error; in [ ]: not "
    "valid, see the notes. The interval is for what the same formula gives with the true torques "
    "of this movement."
)
_MEANS_LEGEND = "Means are over movements, valid values only, ± sd between them."


def contribution_text(results: Sequence[Contribution]) -> str:
    """All movements, then means per condition and movement.

    `results`: contributions of all movements.
    """
    notes = list(dict.fromkeys(note for r in results for note in r.notes))
    table = aligned_table(_HEADER, [_row(r, notes) for r in results])
    means = aligned_table(_MEANS_HEADER, _means(results))
    legend = textwrap.fill(f"{_LEGEND} {_MEANS_LEGEND}", TABLE_WIDTH)
    return "\n".join([table, "", means, "", *numbered_notes(notes), legend])


def _row(r: Contribution, notes: Sequence[str]) -> list[str]:
    share = f"{_number(r.share.percent)} ({' to '.join(map(_number, r.share.ci95))})"
    return [
        r.trial,
        r.condition,
        r.movement,
        share if r.share.valid else f"[{share}]",
        *(_marked(metric) for metric in (r.projection, r.ratio, r.reference)),
        note_numbers(r.notes, notes),
    ]


def _marked(metric: Any) -> str:
    """Metric or reference with its standard error, in brackets if not valid."""
    if metric is None or not np.isfinite(metric.percent):
        return "-"
    shown = f"{_number(metric.percent)} ± {_number(metric.sd)}"
    return shown if metric.valid else f"[{shown}]"


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "?"
    return fixed(value, 1 if abs(value) < 200 else 0)


def _means(results: Sequence[Contribution]) -> list[list[str]]:
    rows = []
    for key in dict.fromkeys((r.condition, r.movement) for r in results):
        group = [r for r in results if (r.condition, r.movement) == key]
        columns = ((getattr(r, name) for r in group) for name in _METRICS)
        values = ([metric.percent for metric in c if metric and metric.valid] for c in columns)
        rows.append([*key, str(len(group)), *map(_mean, values)])
    return rows


def _mean(percent: Sequence[float]) -> str:
    array = np.array(percent)
    if len(array) == 0:
        return "-"
    sd = f" ± {_number(float(array.std(ddof=1)))}" if len(array) > 1 else ""
    return f"{_number(float(array.mean()))}{sd}"
