"""Parameters of one axis of the passive arm with intervals, verdict and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, ClassVar, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.described import Meaning
from armimpedance.core.findings import Finding
from armimpedance.joint.therapy.arm.axis_stiffness import AxisFit
from armimpedance.joint.therapy.arm.doubts import viscosity_sd
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.arm.repeatability import LARGEST_SCATTER_NM, LARGEST_SHARE
from armimpedance.joint.therapy.robot.therapy_robot import Loads
from armimpedance.numerics.regression import FitSummary, NamedParameter, t_factor
from armimpedance.show.files import FittedResult

#: Largest half-width of a 95 % interval of an identified k_s: N m/rad, or a fraction of k_s if that
#: is larger (12 N m/rad need not be known to 0.3); and of q_0, rad.
WIDEST_STIFFNESS: Final = 0.3
WIDEST_STIFFNESS_SHARE: Final = 0.1
WIDEST_REST_RAD: Final = 0.1
#: Largest residual about the line of each repetition, and as a fraction of the arm's torque (rms);
#: with more than both, the arm was not passive.
LARGEST_RESIDUAL_NM: Final = 0.5
RESIDUAL_SHARE: Final = 0.1


def axis_parameters(
    fitted: AxisFit, loads: Loads, mass_sd: float, joint: int
) -> tuple[NamedParameter, NamedParameter]:
    """k_s and q_0 with all sources of uncertainty: scatter, masses, robot, viscosity of the arm.

    q_0 is NaN if k_s is not significantly above 0.
    """
    k, offset = fitted.fit.parameters[:2]
    # C (2, 2) = scatter + g sd^2 g^T + G C_theta G^T + v sd^2 v^T with the gradients g (2,) by the
    # mass factor, G (2, p) by the loads, v (2,) by the viscosity
    g, G = mass_sd * fitted.mass_gradient, fitted.robot_gradient
    v = viscosity_sd(fitted) * fitted.speed_gradient
    parts = fitted.covariance, np.outer(g, g), G @ loads.covariance @ G.T, np.outer(v, v)
    dofs = fitted.scatter.dof, np.inf, loads.dof, np.inf
    stiffness = _derived("k_s", "N m/rad", k, np.array([1.0, 0.0]), parts, dofs, joint)
    low, high = stiffness.ci95
    if low <= 0 <= high or k <= 0:
        return stiffness, NamedParameter("q_0", np.nan, np.nan, np.nan, "rad", joint=joint)
    # q_0 = -b / k: dq_0 = -(q_0 dk + db) / k
    slope = -np.array([-offset / k, 1.0]) / k
    return stiffness, _derived("q_0", "rad", -offset / k, slope, parts, dofs, joint)


def _derived(
    name: str,
    unit: str,
    value: float,
    slope: FloatArray,
    parts: Sequence[FloatArray],
    dofs: Sequence[float],
    joint: int,
) -> NamedParameter:
    """Function of (k_s, offset) by the delta method; degrees of freedom after Satterthwaite."""
    variances = np.array([slope @ C @ slope for C in parts])
    total = float(variances.sum())
    spread = float((variances**2 / np.array(dofs)).sum())
    return NamedParameter(
        name=name,
        value=float(value),
        sd=float(np.sqrt(variances[0])),
        sd_robust=float(np.sqrt(total)),
        unit=unit,
        dof=total**2 / spread if spread > 0 else float("inf"),
        joint=joint,
    )


def half_width(parameter: NamedParameter) -> float:
    """Half-width of the 95 % interval; infinite without a value."""
    width = t_factor(parameter.dof) * parameter.sd_robust
    return float(width) if np.isfinite(width) else float("inf")


def direction_parameter(fitted: AxisFit, joint: int) -> NamedParameter | None:
    """Half the difference between up and down, N m; None with one direction only."""
    if len(fitted.fit.parameters) < 3:
        return None
    sd = float(fitted.fit.sd[2])
    return NamedParameter(
        "direction", float(fitted.fit.parameters[2]), sd, sd, "N m", fitted.fit.dof, joint
    )


def verdict_of(
    fitted: AxisFit, stiffness: NamedParameter, rest: NamedParameter, repeatable: bool
) -> str:
    """One line: the identified parameters, and the reasons for the others."""
    if not repeatable:
        return (
            "refused: the passive repetitions are too different, they scatter by "
            f"{fitted.scatter.rms_Nm:.2g} N m where the arm needs {fitted.arm_rms_Nm:.2g} N m (rms)"
        )
    parts = []
    for parameter in (stiffness, rest):
        width = half_width(parameter)
        if not np.isfinite(width):
            parts.append(f"{parameter.name} not identified: k_s is not above 0 beyond its error")
        elif not is_identified(parameter):
            parts.append(
                f"{parameter.name} not identified: known to {width:.3g} {parameter.unit} only, "
                f"{widest(parameter):.2g} is asked"
            )
        else:
            parts.append(f"{parameter.name} identified")
    return "; ".join(parts)


def widest(parameter: NamedParameter) -> float:
    """Half-width up to which k_s or q_0 counts as identified."""
    if parameter.name == "q_0":
        return WIDEST_REST_RAD
    return max(WIDEST_STIFFNESS, WIDEST_STIFFNESS_SHARE * parameter.value)


def is_identified(parameter: NamedParameter) -> bool:
    """True if the interval of k_s or q_0 is narrow enough."""
    return half_width(parameter) <= widest(parameter)


def axis_warnings(
    elastic: Elastic, fitted: AxisFit, movements: Sequence[Sequence[MovementTorques]]
) -> tuple[str, ...]:
    """Warnings about one axis; `movements` by their names."""
    sentences = []
    if not elastic.repeatable:
        sentences.append(f"axis {elastic.axis} {elastic.verdict}")
    limit = max(LARGEST_RESIDUAL_NM, RESIDUAL_SHARE * fitted.arm_rms_Nm)
    if fitted.residual_rms_Nm > limit:
        sentences.append(
            f"axis {elastic.axis}: single repetitions lie {fitted.residual_rms_Nm:.2g} N m (rms) "
            "off a line; the person may not have been passive"
        )
    if elastic.stiffness < 0 and elastic.stiffness < -2 * np.sqrt(elastic.covariance[0, 0]):
        sentences.append(
            f"axis {elastic.axis}: k_s is negative; the masses may be wrong or the person active"
        )
    sentences += [_drift(group, fitted) for group in movements]
    return tuple(sentence for sentence in sentences if sentence)


def _drift(group: Sequence[MovementTorques], fitted: AxisFit) -> str:
    """Warning if the support rises or falls steadily over the repetitions, more than expected."""
    support = np.array([m.support.mean() for m in group])
    steps, whole = np.diff(support), abs(float(support[-1] - support[0]))
    middle = np.array([np.mean([m.q.mean() for m in group]), 1.0])
    usual = 3 * float(np.sqrt(2 * middle @ fitted.scatter.expected @ middle))
    one_way = (steps > 0).all() or (steps < 0).all()
    if not one_way or whole < max(usual, LARGEST_SCATTER_NM, LARGEST_SHARE * fitted.arm_rms_Nm):
        return ""
    return (
        f"{group[0].movement}: the support goes from {support[0]:.3g} to {support[-1]:.3g} N m "
        "over the repetitions; the person may not yet have been passive"
    )


# A person's calibrated arm: parameters and verdicts of the axes, tables and texts.


@dataclass(frozen=True, repr=False)
class AxisCalibration:
    """One axis of the passive arm, with its uncertainty.

    Attributes
    ----------
    WIDEST : tuple of 3 float
        Largest half-widths of a 95 % interval of an identified k_s, N m/rad, or as a fraction of
        k_s if that is larger, and of an identified q_0, rad.
    axis : int
        Column of the recording, from 0.
    elastic : Elastic
        Passive stiffness of the axis, as stored with the arm.
    fitted : AxisFit
        Fit to the passive movements about the axis.
    stiffness, rest : NamedParameter
        k_s and q_0; `sd` from the repetitions alone, `sd_robust` and the interval also from masses
        and robot. q_0 is NaN if k_s is not different from 0.
    direction_Nm : NamedParameter or None
        Half the difference of the support between up and down, beyond the robot's model: friction
        that it lacks, or resistance of the arm. None if the axis was moved in one direction only.
    viscosity : Finding
        Check that a viscous resistance of the arm is separate from q_0.
    warnings : tuple of str
        Warnings about this axis.
    """

    WIDEST: ClassVar = (WIDEST_STIFFNESS, WIDEST_STIFFNESS_SHARE, WIDEST_REST_RAD)

    axis: int
    elastic: Elastic
    fitted: AxisFit
    stiffness: NamedParameter
    rest: NamedParameter
    direction_Nm: NamedParameter | None
    viscosity: Finding
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"axis {self.axis + 1} {self.elastic.axis}: {self.stiffness!r}, {self.rest!r}"


@dataclass(frozen=True, repr=False)
class ArmCalibration(FittedResult):
    """The passive arm and its uncertainty.

    Attributes
    ----------
    arm : PassiveArm
        Model of the person's arm for `contribution_of`.
    summary : FitSummary
        k_s and q_0 of every axis, `joint` counted from 1.
    axes : tuple of AxisCalibration
        Axes that were moved passively.
    movements : tuple of MovementTorques
        Passive movements with the fitted stiffness: `user` is the residual.
    """

    MEANINGS = {
        "k_s": Meaning("stiffness of the relaxed joint"),
        "q_0": Meaning("rest angle of the relaxed joint"),
    }

    arm: PassiveArm
    summary: FitSummary
    axes: tuple[AxisCalibration, ...]
    movements: tuple[MovementTorques, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about all axes."""
        return self.summary.warnings

    def to_dict(self) -> dict[str, Any]:
        """Content of ARM.json about the calibration, without the arm itself."""
        axes = [
            {
                "joint": a.axis + 1,
                "name": a.elastic.axis,
                "verdict": a.elastic.verdict,
                "stiffness_identified": a.elastic.stiffness_identified,
                "rest_identified": a.elastic.rest_identified,
            }
            for a in self.axes
        ]
        return {**self.summary.to_dict(), "axes": axes}

    def __repr__(self) -> str:
        head = f"passive arm of subject {self.arm.subject} in robot {self.arm.robot}"
        return "\n".join([head, *(f"{a!r}\n  {a.elastic.verdict}" for a in self.axes)])

    def _repr_html_(self) -> str:
        verdicts = "".join(
            f"<li>{escape(a.elastic.axis)}: {escape(a.elastic.verdict)}</li>" for a in self.axes
        )
        head = f"<p>passive arm of subject {escape(self.arm.subject)}</p>"
        return f"{head}{self.summary._repr_html_()}<ul>{verdicts}</ul>"
