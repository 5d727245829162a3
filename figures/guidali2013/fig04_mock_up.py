"""Guidali (2013), Fig. 4: two pipes in the robot, their weight and their inertia."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.shown import with_half_width
from armimpedance.joint.therapy import MovementTorques
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.guidali2013.printed import MOCKUP_GRAVITY_NM, MOCKUP_INERTIA_KGM2
from armimpedance_figures.guidali2013.study import SUBJECTS, MockUp, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from armimpedance.numerics.regression import NamedParameter

#: Movement -> panel's title.
PANELS: Final = {
    "elevation": "(a) elevation, constant speed",
    "horizontal": "(b) horizontal, minimum jerk",
}


def repetitions(mock_up: MockUp, movement: str) -> list[MovementTorques]:
    """All of one movement."""
    return [m for m in mock_up.torques if m.movement == movement]


def elapsed(torques: MovementTorques) -> FloatArray:
    """Seconds since the onset, (S,)."""
    return torques.time_s - torques.time_s[0]


def draw(studied: TherapyStudy) -> Figure:
    """Support torque of each repetition and the weighed pipes' model over time."""
    figure = new_figure(TWO_COLUMNS_IN, 2.9)
    with print_style():
        axes = figure.subplots(1, 2)
        for ax, (movement, title) in zip(axes, PANELS.items(), strict=True):
            for i, torques in enumerate(repetitions(studied.mockup, movement)):
                label = "measured support" if i == 0 else None
                ax.plot(elapsed(torques), torques.support, color="0.6", lw=0.8, label=label)
            first = repetitions(studied.mockup, movement)[0]
            look = {"color": OKABE_ITO["blue"], "lw": 1.4}
            ax.plot(elapsed(first), first.rigid_arm, label="model of the pipes", **look)
            ax.set_title(title, loc="left")
            ax.set_xlabel("time (s)")
            ax.set_ylabel("torque (N m)")
        inner = np.concatenate([_middle(m) for m in repetitions(studied.mockup, "horizontal")])
        axes[1].set_ylim(*(1.25 * np.array([inner.min(), inner.max()])))
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


def _middle(torques: MovementTorques) -> FloatArray:
    """Without the ends, where the gears stick."""
    tenth = len(torques.support) // 10
    return torques.support[tenth:-tenth]


def table(studied: TherapyStudy) -> list[list[str]]:
    """Gravity and inertia."""
    check = studied.mockup.check
    rows = [["quantity", "unit", "measured", "ci95_low", "ci95_high", "model", "printed_pipes"]]
    for found, model, printed in (
        (check.gravity, check.gravity_model_Nm, MOCKUP_GRAVITY_NM),
        (check.inertia, check.inertia_model_kgm2, MOCKUP_INERTIA_KGM2),
    ):
        values = [found.value, *found.ci95, model, printed]
        rows.append([found.name, found.unit, *map(number, values)])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what the pipes weigh, what differs."""
    check = studied.mockup.check
    return (
        "After Guidali et al. (2013), Fig. 4: support torque (motor less robot) that moves two "
        "pipes (1.8 kg, 0.32 m; 1.7 kg, 0.30 m), and the model of the weighed pipes: at constant "
        "speed only their weight counts, about the vertical axis only their inertia. Measured "
        f"torque with the pipes level {_shown(check.gravity)}, from their masses "
        f"{check.gravity_model_Nm:.2f}; inertia about the vertical axis {_shown(check.inertia)}, "
        f"from their masses {check.inertia_model_kgm2:.3f}, as thin rods "
        f"{MOCKUP_INERTIA_KGM2:.3f}. At the ends of (b) the gears stick, which the robot's model "
        f"leaves out. {design(studied)}. Differs from the source: "
        "simulated; (a) from 35 to 130 degrees, (b) with the arm level and at 40 deg/s on "
        "average, where there is more inertia to see."
    )


def _shown(found: NamedParameter) -> str:
    low, high = found.ci95
    return f"{with_half_width(found.value, (high - low) / 2)} {found.unit.replace('^2', '²')}"


FIGURE = SourceFigure(
    "guidali2013_fig04_mock_up", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
