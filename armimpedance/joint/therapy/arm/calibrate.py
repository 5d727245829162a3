"""Calibrate a person's passive arm from passive movements in the robot, (20)-(21)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.records import Recording, Subject
from armimpedance.joint.therapy.arm.axis_stiffness import direction_of, fit_axis
from armimpedance.joint.therapy.arm.doubts import (
    mass_finding,
    silence_finding,
    viscosity_finding,
    zero_finding,
)
from armimpedance.joint.therapy.arm.movements import (
    MovementTorques,
    elastic_torque,
    movement_torques,
)
from armimpedance.joint.therapy.arm.passive_arm import (
    MASS_SD,
    ArmSegment,
    Elastic,
    PassiveArm,
    Reference,
    upper_arm_length,
)
from armimpedance.joint.therapy.arm.verdict import (
    ArmCalibration,
    AxisCalibration,
    axis_parameters,
    axis_warnings,
    direction_parameter,
    is_identified,
    verdict_of,
)
from armimpedance.joint.therapy.robot.checks import check_recording
from armimpedance.joint.therapy.robot.steady import no_step, slides
from armimpedance.joint.therapy.robot.therapy_robot import Loads, TherapyRobot
from armimpedance.numerics.regression import FitSummary

#: Least number of repetitions of every movement, as in the source.
FEWEST: Final = 3
#: Length to which a robot is assumed to be adjusted if a recording does not state it, m.
USUAL_UPPER_ARM_M: Final = 0.30


def identify_arm(
    recording: Recording,
    robot: TherapyRobot,
    segments: Sequence[ArmSegment],
    *,
    upper_arm_m: float | None = None,
    mass_sd: float = MASS_SD,
    condition: str = "passive",
    emg_gate_percent: float | None = 3.0,
    step: Callable[[], object] = no_step,
) -> ArmCalibration:
    """Identify k_s and q_0 of every passively moved axis, and the reference torques of (19).

    Parameters
    ----------
    recording : Recording
        Three or more passive repetitions of every movement; other conditions are ignored.
    robot : TherapyRobot
        Identified.
    segments : sequence of ArmSegment
        From `passive_arm.segments_of`, or of a mock-up that was weighed.
    upper_arm_m : float, optional
        Length to which the robot was adjusted, m; by default that of the recording's subject, else
        `USUAL_UPPER_ARM_M`.
    mass_sd : float
        Relative sd of the masses, for the intervals.
    condition : str
        Condition of the passive trials.
    emg_gate_percent : float or None
        A muscle above this share of its maximum, %, is not passive; None: the EMG is ignored.
    step : function, optional
        Called after every trial.

    Returns
    -------
    ArmCalibration

    Raises
    ------
    InputError
        No passive trials, fewer than three repetitions of a movement, one movement about two axes,
        an active muscle, or a recording that `checks.check_recording` or
        `movements.movement_torques` refuse.
    """
    robot.identified  # noqa: B018 - before anything slow
    passive = _passive(recording, condition)
    check_recording(passive, robot)
    arm = PassiveArm(
        subject=recording.subject.id,
        robot=robot.name,
        upper_arm_m=_adjusted_to(recording.subject) if upper_arm_m is None else upper_arm_m,
        segments=tuple(segments),
        mass_sd=mass_sd,
    )
    movements = movement_torques(passive, robot, arm, step=step)
    named = _by_movement(movements)
    axes = tuple(
        _calibrate([m for m in movements if m.axis == axis], robot.identified, mass_sd)
        for axis in sorted({m.axis for m in movements})
    )
    fits = {a.elastic.axis: a.fitted for a in axes}
    silence = silence_finding(passive, emg_gate_percent, fits)
    calibrated = replace(
        arm,
        elastic=tuple(a.elastic for a in axes),
        references=tuple(_reference(group, robot.identified) for group in named.values()),
    )
    return ArmCalibration(
        arm=calibrated,
        summary=_summary(
            axes,
            (zero_finding(fits), silence, *mass_finding(recording.subject, segments, mass_sd)),
        ),
        axes=axes,
        movements=tuple(
            replace(m, elastic=elastic_torque(calibrated, m.axis_name, m.q)) for m in movements
        ),
    )


def _adjusted_to(subject: Subject) -> float:
    """Length of the upper arm to which a robot was adjusted, m."""
    is_measured = subject.upper_arm_m is not None or subject.height_m is not None
    return upper_arm_length(subject) if is_measured else USUAL_UPPER_ARM_M


def _passive(recording: Recording, condition: str) -> Recording:
    rows = (recording.trials["condition"].astype(str) == condition).to_numpy()
    if not rows.any():
        names = ", ".join(sorted(set(recording.trials["condition"].astype(str))))
        raise InputError(
            f"missing passive calibration: no trial of the condition {condition!r} among {names}",
            column="condition",
            expected=f"{FEWEST} or more passive repetitions of every movement",
        )
    return recording.select(rows)


def _by_movement(
    movements: Sequence[MovementTorques],
) -> Mapping[str, Sequence[MovementTorques]]:
    named: dict[str, list[MovementTorques]] = {}
    for movement in movements:
        named.setdefault(movement.movement, []).append(movement)
    for name, group in named.items():
        if len(group) < FEWEST:
            raise InputError(
                f"{len(group)} passive repetition{'s'[: len(group) != 1]} of the movement {name}",
                expected=f"{FEWEST} or more: their scatter is the arm's uncertainty",
            )
        if len({m.axis for m in group}) > 1:
            axes = sorted({m.axis_name for m in group})
            raise InputError(
                f"the movement {name} is about {' and '.join(axes)}", expected="one axis"
            )
    return named


def _reference(group: Sequence[MovementTorques], loads: Loads) -> Reference:
    """Denominator of (19), over the same samples as for a contribution."""
    counted = [slides(m.qd, float(loads.rise_rad_s[m.axis])) for m in group]
    for movement, rows in zip(group, counted, strict=True):
        if not rows.any():
            raise InputError(
                f"trial {movement.trial}: axis {movement.axis_name} hardly moves",
                expected="a movement faster than its friction's rise",
            )
    return Reference(
        movement=group[0].movement,
        axis=group[0].axis_name,
        support_Nm=np.array([m.support[c].mean() for m, c in zip(group, counted, strict=True)]),
        from_rad=float(np.mean([m.q[0] for m in group])),
        to_rad=float(np.mean([m.q[-1] for m in group])),
    )


def _calibrate(
    movements: Sequence[MovementTorques], loads: Loads, mass_sd: float
) -> AxisCalibration:
    axis, name = movements[0].axis, movements[0].axis_name
    fitted = fit_axis(movements, float(loads.rise_rad_s[axis]))
    stiffness, rest = axis_parameters(fitted, loads, mass_sd, axis + 1)
    repeatable = not fitted.scatter.disagrees(fitted.arm_rms_Nm)
    elastic = Elastic(
        axis=name,
        stiffness=float(fitted.fit.parameters[0]),
        offset=float(fitted.fit.parameters[1]),
        covariance=fitted.covariance,
        dof=fitted.scatter.dof,
        range_rad=fitted.range_rad,
        between=fitted.scatter.between,
        noise_density=fitted.noise_density,
        mass_gradient=fitted.mass_gradient,
        robot_gradient=fitted.robot_gradient,
        stiffness_identified=repeatable and is_identified(stiffness),
        rest_identified=repeatable and is_identified(rest),
        verdict=verdict_of(fitted, stiffness, rest, repeatable),
        repeatable=repeatable,
        one_way=direction_of(movements[0]) if fitted.one_way else 0.0,
    )
    direction = direction_parameter(fitted, axis + 1)
    return AxisCalibration(
        axis=axis,
        elastic=elastic,
        fitted=fitted,
        stiffness=stiffness,
        rest=rest,
        direction_Nm=direction,
        viscosity=viscosity_finding(name, fitted, rest, direction),
        warnings=axis_warnings(elastic, fitted, tuple(_by_movement(movements).values())),
    )


def _summary(axes: Sequence[AxisCalibration], of_person: Sequence[Finding]) -> FitSummary:
    checks = (*(a.viscosity for a in axes), *of_person)
    fits = [a.fitted.fit for a in axes]
    residual = sum(float(f.residual_covariance[0, 0]) * f.n_rows for f in fits)
    whole = sum(float(f.residual_covariance[0, 0]) * f.n_rows / max(1 - f.r2, 1e-12) for f in fits)
    return FitSummary(
        method="passive repetitions",
        n=sum(f.n_rows for f in fits),
        cond_raw=max(f.cond_raw for f in fits),
        cond_scaled=max(f.cond_scaled for f in fits),
        rank=sum(f.rank for f in fits),
        r2=1 - residual / whole,
        vaf=1 - residual / whole,
        parameters=tuple(p for a in axes for p in (a.stiffness, a.rest)),
        warnings=(
            *(s for a in axes for s in (*a.fitted.fit.warnings, *a.warnings)),
            *warnings_of(checks),
        ),
        checks=checks,
    )
