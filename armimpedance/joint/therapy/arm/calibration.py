"""A person's calibrated arm: its numbers axis by axis, the verdict on them, tables and texts."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Any, ClassVar

from armimpedance.core.findings import Finding
from armimpedance.joint.therapy.arm.axis_stiffness import AxisFit
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.arm.torques import MovementTorques
from armimpedance.joint.therapy.arm.verdict import (
    WIDEST_REST_RAD,
    WIDEST_STIFFNESS,
    WIDEST_STIFFNESS_SHARE,
)
from armimpedance.numerics.regression import FitSummary, NamedParameter

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False)
class AxisCalibration:
    """What is known of one axis of the passive arm.

    Attributes
    ----------
    WIDEST : tuple of 3 float
        Largest half-widths of a 95 % interval of an identified k_s, N m/rad, or as a share of k_s
        where that is more, and of an identified q_0, rad.
    axis : int
        Column of the recording, from 0.
    elastic : Elastic
        The axis' passive stiffness, as the arm holds it.
    fitted : AxisFit
        What the passive movements about the axis say.
    stiffness, rest : NamedParameter
        k_s and q_0; `sd` of the repetitions alone, `sd_robust` and the interval with masses and
        robot. q_0 is NaN where k_s is not different from 0.
    direction_Nm : NamedParameter or None
        Half of what moving up needs more than moving down, beyond the robot's model: friction that
        it misses, or resistance of the arm. None where the axis was moved one way only.
    viscosity : Finding
        Whether a resistance of the arm to its speed is apart from q_0.
    warnings : tuple of str
        What a reader must know of this axis.
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
class ArmCalibration:
    """The passive arm and how far to trust it.

    Attributes
    ----------
    arm : PassiveArm
        What `contribution_of` needs of the person.
    summary : FitSummary
        k_s and q_0 of every axis, `joint` counted from 1.
    axes : tuple of AxisCalibration
        The axes that were moved passively.
    movements : tuple of MovementTorques
        The passive movements with the stiffness that was found: what is left is `user`.
    """

    arm: PassiveArm
    summary: FitSummary
    axes: tuple[AxisCalibration, ...]
    movements: tuple[MovementTorques, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know of any axis."""
        return self.summary.warnings

    def to_frame(self) -> pd.DataFrame:
        """One row a parameter: joint, value, standard error, 95 % limits, unit."""
        return self.summary.to_frame()

    def to_dict(self) -> dict[str, Any]:
        """What ARM.json says of the calibration, beside the arm itself."""
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
