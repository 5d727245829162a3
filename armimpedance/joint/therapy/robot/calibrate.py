"""Identify friction, cables and spring of a therapy robot from sweeps and holds of the empty
robot."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.checks import AxisValidation, check_recording, refuse_person
from armimpedance.joint.therapy.robot.doubts import robot_doubts
from armimpedance.joint.therapy.robot.holds import SpringHolds, fit_holds, polynomial_of
from armimpedance.joint.therapy.robot.steady import SteadyPart, no_step, steady_parts
from armimpedance.joint.therapy.robot.sweeps import CABLE, FRICTION, AxisSweeps, fit_axis
from armimpedance.joint.therapy.robot.therapy_robot import (
    AXIS_TERMS,
    SPRING_TERMS,
    Loads,
    TherapyRobot,
    parameter_count,
)
from armimpedance.numerics.regression import Fit, FitSummary, NamedParameter, t_factor
from armimpedance.show.files import FittedResult

# Notes for a reader of a robot's calibration.

#: Two estimates of a quantity differ if they do so at this confidence level ...
_LEVEL: Final = 0.99
#: ... and by more than this share of the Coulomb friction.
_SHARE: Final = 0.02


def axis_notes(sweeps: AxisSweeps, robot: TherapyRobot) -> tuple[str, ...]:
    """Notes on the friction and the cables of one axis."""
    fitted, name = sweeps.fit, f"axis {sweeps.axis + 1}"
    notes = list(sweeps.notes)
    coulomb, viscous = fitted.parameters[:2]
    low, high = fitted.interval()[:2].T
    for label, at in (("Coulomb", 0), ("viscous", 1)):
        if high[at] < 0:
            notes.append(f"{name}: negative {label} friction {fitted.parameters[at]:.3g}: drives")
    fastest = max(p.speed_rad_s for p in sweeps.points)
    slope, sd = sweeps.even_slope
    if abs(slope) > t_factor(fitted.dof, _LEVEL) * sd and abs(slope) * fastest > _SHARE * coulomb:
        plus, minus = viscous + slope, viscous - slope
        notes.append(
            f"{name}: friction is not odd in the velocity: {plus:.4g} N m s/rad in positive and "
            f"{minus:.4g} in negative direction, their half difference {slope:.2g} +- {sd:.2g}; "
            "the law is their mean"
        )
    if sweeps.axis != robot.spring_axis:
        k = fitted.names.index(CABLE[1])
        if fitted.interval()[k, 0] <= 0 <= fitted.interval()[k, 1]:
            notes.append(f"{name}: no cable stiffness different from zero: q_c is not identified")
    return tuple(notes)


def rise_notes(axes: Sequence[AxisSweeps]) -> tuple[str, ...]:
    """Notes on the lowest fitted speed and v_s of each axis; equal axes share a note."""
    alike: dict[str, list[int]] = {}
    for sweeps in axes:
        alike.setdefault(_rise_note(sweeps), []).append(sweeps.axis + 1)
    return tuple(
        f"ax{'is' if len(numbers) == 1 else 'es'} {', '.join(map(str, numbers))}: {text}"
        for text, numbers in alike.items()
    )


def _rise_note(sweeps: AxisSweeps) -> str:
    highest, lowest = np.rad2deg([sweeps.static_range_rad_s, sweeps.lowest_used_rad_s])
    where = f"static range up to {highest:.2g} deg/s" if highest else "no static range seen"
    return (
        f"{where}, fitted from {lowest:.3g} deg/s; v_s is set to "
        f"{np.rad2deg(sweeps.rise_rad_s):.2g} deg/s, by rule and not measured: the "
        "Coulomb friction is complete at the lowest speed used"
    )


def spring_notes(spring: SpringHolds, sweeps: AxisSweeps) -> tuple[str, ...]:
    """Notes on the holds, and on the spring estimated from sweeps of the same axis."""
    notes = list(spring.notes)
    gap, sd = spring_gap(spring, sweeps)
    beyond = np.abs(gap) - t_factor(min(spring.fit.dof, sweeps.fit.dof), _LEVEL) * sd
    worst = int(np.argmax(beyond))
    if beyond[worst] > 0 and abs(gap[worst]) > _SHARE * float(sweeps.fit.parameters[0]):
        notes.append(
            f"axis {sweeps.axis + 1}: the spring differs between holds and sweeps, by "
            f"{gap[worst]:.3g} +- {sd[worst]:.2g} N m at "
            f"{np.rad2deg(spring.angle_rad[worst]):.3g} deg: friction that is not odd, or holds "
            "that stick unevenly"
        )
    return tuple(notes)


def spring_gap(spring: SpringHolds, sweeps: AxisSweeps) -> tuple[FloatArray, FloatArray]:
    """Polynomial of the holds less that of the sweeps, at the holds' angles (A,), and its sd
    (A,)."""
    of_holds, var_holds = polynomial_of(spring.fit, spring.angle_rad)
    of_sweeps, var_sweeps = polynomial_of(sweeps.spring_fit or sweeps.fit, spring.angle_rad)
    return of_holds - of_sweeps, np.sqrt(var_holds + var_sweeps)


#: Names in FIT.json of terms that have other names in `Loads`.
_SHORT = {"coulomb": "tau_c", "viscous": "k_v", "cable_stiffness": "k_c"}


@dataclass(frozen=True, repr=False)
class RobotCalibration(FittedResult):
    """A robot with identified loads, and the results for a report.

    Attributes
    ----------
    robot : TherapyRobot
        The drawings with their `Loads`.
    summary : FitSummary
        tau_c, k_v, k_c, q_c of every axis, c_0, c_1, c_2 of the spring.
    axes : tuple of AxisSweeps
        Friction and cables, in the order of the robot's axes.
    spring : SpringHolds
        The counterbalance spring.
    notes : tuple of str
        Notes on the calibration for a reader.
    validation : tuple of AxisValidation
        Predictions of other movements, one per axis; empty without such movements.
    """

    MEANINGS = {
        "tau_c": Meaning("Coulomb friction"),
        "k_v": Meaning("viscous friction"),
        "k_c": Meaning("stiffness of the cables"),
        "q_c": Meaning("angle at which the cables are slack"),
        "c_{}": Meaning("coefficient of the counterbalance spring over the angle"),
    }

    robot: TherapyRobot
    summary: FitSummary
    axes: tuple[AxisSweeps, ...]
    spring: SpringHolds
    notes: tuple[str, ...] = ()
    validation: tuple[AxisValidation, ...] = ()

    def parameters_of(self, axis: int) -> tuple[NamedParameter, ...]:
        """The parameters of one axis, counted from 0."""
        return tuple(p for p in self.summary.parameters if p.joint == axis + 1)

    def to_dict(self) -> dict[str, Any]:
        """Fields of the identification in ROBOT.json, besides the robot itself."""
        return {
            **self.summary.to_dict(),
            "axes": [sweeps.to_dict() for sweeps in self.axes],
            "validation": [
                {"joint": v.axis + 1, "r2": v.r2, "rms_Nm": v.rms_Nm, "moving_r2": v.moving_r2}
                for v in self.validation
            ],
        }

    def __repr__(self) -> str:
        lines = [f"robot {self.robot.name}, R^2 {self.summary.r2:.3f} of sweeps and holds"]
        for axis, name in enumerate(self.robot.axes):
            values = ", ".join(f"{p.name} = {p.value:.3g}" for p in self.parameters_of(axis))
            lines.append(f"axis {axis + 1} {name}: {values}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return f"<p>robot {escape(self.robot.name)}</p>{self.summary._repr_html_()}"


def identify_robot(
    recording: Recording, drawings: TherapyRobot, *, step: Callable[[], object] = no_step
) -> RobotCalibration:
    """Identify friction and cables of every axis from sweeps, the spring from holds.

    Parameters
    ----------
    recording : Recording
        Of the empty robot, with trials of the conditions "sweep" and "hold".
    drawings : TherapyRobot
        Its rigid bodies; its loads, if any, are not used.
    step : function, optional
        Called after every trial.

    Returns
    -------
    RobotCalibration

    Raises
    ------
    InputError
        Not a recording of this robot, a person in it, an axis without sweeps, sweeps or holds in
        one direction only, or too few speeds above the static range.
    NotIdentifiableError
        The sweeps of an axis do not separate its terms.
    """
    refuse_person(recording)
    check_recording(recording, replace(drawings, loads=None))
    length = recording.subject.upper_arm_m
    adjusted = drawings if length is None else drawings.adjusted_to(length)
    sweeps = steady_parts(recording, adjusted, "sweep", step)
    all_holds = steady_parts(recording, adjusted, "hold", step)
    holds = [part for part in all_holds if part.axis == drawings.spring_axis]
    axes = tuple(_axis(sweeps, i, drawings) for i in range(drawings.n_axes))
    spring = fit_holds(holds)
    loads = _loads(axes, spring, drawings)
    notes = (
        *rise_notes(axes),
        *(note for a in axes for note in axis_notes(a, drawings)),
        *spring_notes(spring, axes[drawings.spring_axis]),
    )
    checks = robot_doubts(recording, adjusted, axes)
    notes = (*warnings_of(checks), *notes)
    return RobotCalibration(
        robot=replace(drawings, loads=loads),
        summary=_summary(axes, spring, drawings, notes, checks),
        axes=axes,
        spring=spring,
        notes=notes,
    )


def _axis(sweeps: tuple[SteadyPart, ...], axis: int, robot: TherapyRobot) -> AxisSweeps:
    own = [p for p in sweeps if p.axis == axis]
    if not own:
        raise InputError(
            f"no sweeps of axis {axis + 1} ({robot.axes[axis]})",
            column="condition",
            expected="trials of the condition 'sweep' for every axis",
        )
    return fit_axis(own, spring=axis == robot.spring_axis)


def _loads(axes: tuple[AxisSweeps, ...], spring: SpringHolds, robot: TherapyRobot) -> Loads:
    p, n_terms = parameter_count(len(axes)), len(AXIS_TERMS)
    theta, covariance = np.zeros(p), np.zeros((p, p))

    def put(fitted: Fit, names: tuple[str, ...], places: IntArray) -> None:
        columns = [fitted.names.index(name) for name in names]
        theta[places] = fitted.parameters[columns]
        covariance[np.ix_(places, places)] = fitted.covariance[np.ix_(columns, columns)]

    for i, sweeps in enumerate(axes):
        names = FRICTION if i == robot.spring_axis else (*FRICTION, *CABLE)
        put(sweeps.fit, names, np.array([n_terms * i + AXIS_TERMS.index(n) for n in names]))
    put(spring.fit, SPRING_TERMS, np.arange(p - len(SPRING_TERMS), p))
    return Loads(
        theta,
        covariance,
        rise_rad_s=np.array([a.rise_rad_s for a in axes]),
        dof=min(*(a.fit.dof for a in axes), spring.fit.dof),
    )


def _summary(
    axes: tuple[AxisSweeps, ...],
    spring: SpringHolds,
    robot: TherapyRobot,
    notes: tuple[str, ...],
    checks: tuple[Finding, ...],
) -> FitSummary:
    fits = [*(a.fit for a in axes), spring.fit]
    parameters: list[NamedParameter] = []
    for i, sweeps in enumerate(axes):
        names = FRICTION if i == robot.spring_axis else (*FRICTION, "cable_stiffness")
        parameters += [_named(sweeps.fit, n, _SHORT[n], i + 1) for n in names]
        if i != robot.spring_axis:
            parameters.append(cable_rest(sweeps.fit, i + 1))
    for k, name in enumerate(SPRING_TERMS):
        parameters.append(_named(spring.fit, name, f"c_{k}", robot.spring_axis + 1))
    rows = np.array([f.n_rows for f in fits], dtype=float)
    residual = np.array([f.residual_sd**2 * (f.n_rows - f.rank) for f in fits])
    # sums of squares about each fit's own mean, from its R^2
    whole = np.array(
        [x / (1 - f.r2) if f.r2 < 1 else x for x, f in zip(residual, fits, strict=True)]
    )
    explained = float(1 - residual.sum() / whole.sum()) if whole.sum() > 0 else 1.0
    return FitSummary(
        method="sweeps and holds",
        n=int(rows.sum()),
        cond_raw=max(f.cond_raw for f in fits),
        cond_scaled=max(f.cond_scaled for f in fits),
        rank=sum(f.rank for f in fits),
        r2=explained,
        vaf=explained,
        parameters=tuple(parameters),
        warnings=notes,
        checks=checks,
    )


def _named(fitted: Fit, term: str, name: str, joint: int) -> NamedParameter:
    j = fitted.names.index(term)
    return NamedParameter(
        name=name,
        value=float(fitted.parameters[j]),
        sd=float(_classical_sd(fitted)[j]),
        sd_robust=float(fitted.sd[j]),
        unit=fitted.units[j],
        dof=fitted.dof,
        joint=joint,
    )


def _classical_sd(fitted: Fit) -> FloatArray:
    inverse = np.linalg.inv(fitted.triangle)
    return np.asarray(fitted.residual_sd * np.sqrt((inverse**2).sum(axis=1)))


def cable_rest(fitted: Fit, joint: int) -> NamedParameter:
    """Parameter q_c (11), the angle without cable torque; NaN if k_c is not significant."""
    b, k = (fitted.names.index(name) for name in CABLE)
    low, high = fitted.interval()[k]
    if low <= 0 <= high:
        nan = float("nan")
        return NamedParameter("q_c", nan, nan, nan, "rad", fitted.dof, joint)
    rest = fitted.transform(lambda x: np.array([-x[b] / x[k]]), ("q_c",), ("rad",))
    scale = _classical_sd(fitted)[k] / fitted.sd[k] if fitted.sd[k] > 0 else 1.0
    sd = float(rest.sd[0])
    return NamedParameter("q_c", float(rest.values[0]), sd * scale, sd, "rad", fitted.dof, joint)
