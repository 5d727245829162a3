"""Guidali (2013), Fig. 3: torque of axis 2 at constant velocity, with and without its cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.therapy import SmoothTrial, smooth_trials
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.guidali2013.study import (
    SUBJECTS,
    UNFITTED_DEG_S,
    TherapyStudy,
    design,
    study,
)
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Horizontal shoulder rotation, from 0.
AXIS: Final = 1


@dataclass(frozen=True)
class Swept:
    """One sweep: motion after the kernel, and what the models say of it; (S,), N m.

    Attributes
    ----------
    velocity_deg_s : float
    motion : SmoothTrial
    friction, cable : (S,)
    """

    velocity_deg_s: float
    motion: SmoothTrial
    friction: FloatArray
    cable: FloatArray

    @property
    def angle_deg(self) -> FloatArray:
        """(S,)."""
        return np.rad2deg(self.motion.q[:, AXIS])

    @property
    def measured(self) -> FloatArray:
        """Of the motor, (S,)."""
        return self.motion.motor[:, AXIS]

    def rms(self, *, cables: bool) -> float:
        """What the model leaves, N m."""
        model = self.friction + (self.cable if cables else 0.0)
        return float(np.sqrt(np.mean((self.measured - model) ** 2)))


def sweeps_of(studied: TherapyStudy) -> list[Swept]:
    """Both directions."""
    session = studied.unfitted_sweeps
    recording = session.select(np.flatnonzero(session.trials["axis"] == AXIS + 1))
    loads, axis = studied.identified.identified, studied.robot.found.axes[AXIS]
    stiffness, offset = (loads.term(n)[AXIS] for n in ("cable_stiffness", "cable_offset"))
    found = []
    for trial, row in zip(smooth_trials(recording), recording.trials.itertuples(), strict=True):
        motion = trial.between(row.onset_s, row.end_s)
        friction = axis.friction(motion.qd[:, AXIS])
        cable = stiffness * motion.q[:, AXIS] + offset
        found.append(Swept(float(row.velocity_deg_s), motion, friction, cable))
    return found


def draw(studied: TherapyStudy) -> Figure:
    """One panel a direction."""
    figure = new_figure(TWO_COLUMNS_IN, 2.7)
    with print_style():
        axes = figure.subplots(1, 2)
        for ax, one in zip(axes, sweeps_of(studied), strict=True):
            ax.plot(one.angle_deg, one.measured, color="0.55", lw=0.8, label="measured")
            for model, color, style, label in (
                (one.friction, "vermillion", (0, (5, 2)), "friction alone"),
                (one.friction + one.cable, "blue", "-", "friction and cables"),
            ):
                ax.plot(one.angle_deg, model, color=OKABE_ITO[color], ls=style, label=label)
            ax.set_title(f"{one.velocity_deg_s:+.0f} deg/s", loc="left")
            ax.set_xlabel("angle of axis 2 (deg)")
            ax.set_ylabel("torque (N m)")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def table(studied: TherapyStudy) -> list[list[str]]:
    """What both models leave in each direction."""
    rows = [["velocity_deg_s", "rms_friction_alone_Nm", "rms_friction_and_cables_Nm"]]
    for one in sweeps_of(studied):
        left = [one.rms(cables=False), one.rms(cables=True)]
        rows.append([f"{one.velocity_deg_s:g}", *map(number, left)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown and what differs."""
    swept = sweeps_of(studied)
    without, with_ = (np.mean([s.rms(cables=c) for s in swept]) for c in (False, True))
    return (
        "After Guidali et al. (2013), Fig. 3: motor torque that moves axis 2 (horizontal shoulder "
        f"rotation) at {UNFITTED_DEG_S:g} deg/s, and what the identified models say of it. "
        f"Friction alone leaves {without:.2f} N m rms, with the cables as a spring {with_:.3f} N "
        "m. These sweeps are a session of their own, at a speed that is not among the fitted ones. "
        f"{design(studied)}. Differs from the source: simulated; measured torque after the "
        "analysis' kernel of 0.1 s; both directions."
    )


FIGURE = SourceFigure(
    "guidali2013_fig03_cable", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
