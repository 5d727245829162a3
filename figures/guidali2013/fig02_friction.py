"""Guidali (2013), Fig. 2: friction of axis 4, the elbow, and the law fitted to it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.hand.show import one_legend
from armimpedance.joint.therapy import AxisSweeps
from armimpedance.joint.therapy.show import plot_friction
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.guidali2013.printed import TABLE_3
from armimpedance_figures.guidali2013.study import SUBJECTS, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The elbow, from 0.
AXIS: Final = 3


def draw(studied: TherapyStudy) -> Figure:
    """Left over the signed velocity, as the source; right over the speed's logarithm."""
    sweeps = studied.robot.found.axes[AXIS]
    figure = new_figure(TWO_COLUMNS_IN, 2.9)
    with print_style():
        left, right = figure.subplots(1, 2)
        _signed(sweeps, left)
        plot_friction(sweeps, right)
        one_legend(figure, (left, right), columns=5)
    return figure


def _signed(sweeps: AxisSweeps, ax: Axes) -> None:
    speed = np.rad2deg([p.speed_rad_s for p in sweeps.points])
    v = np.linspace(-1.1 * speed.max(), 1.1 * speed.max(), 1001)
    coulomb, viscous = (TABLE_3[name][AXIS] for name in ("tau_c", "k_v"))
    ax.plot(
        v, coulomb * np.sign(v) + viscous * v, color=OKABE_ITO["orange"], lw=3.0, alpha=0.6,
        label="printed coefficients",
    )  # fmt: skip
    ax.plot(v, sweeps.friction(np.deg2rad(v)), color="black", lw=1.2)
    for sign, name, color, marker in (
        (1, "up_Nm", "blue", "^"),
        (-1, "down_Nm", "vermillion", "v"),
    ):
        torque = [getattr(p, name) for p in sweeps.points]
        ax.plot(sign * speed, torque, ls="", marker=marker, ms=5, color=OKABE_ITO[color])
    ax.set(xlabel="velocity (deg/s)", ylabel="friction (N m)")


def table(studied: TherapyStudy) -> list[list[str]]:
    """One row per speed and direction."""
    sweeps = studied.robot.found.axes[AXIS]
    rows = [["velocity_deg_s", "friction_Nm", "law_Nm", "used"]]
    for point in sweeps.points:
        for sign, torque in ((1, point.up_Nm), (-1, point.down_Nm)):
            v = sign * point.speed_rad_s
            law = float(sweeps.friction(np.array(v)))
            used = "yes" if point.used else "no"
            rows.append([*map(number, [np.rad2deg(v), torque, law]), used])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what the print is worth, what differs."""
    sweeps = studied.robot.found.axes[AXIS]
    static = np.rad2deg(sweeps.static_range_rad_s)
    slope, sd = sweeps.even_slope
    return (
        "After Guidali et al. (2013), Fig. 2: torque that keeps axis 4 (elbow) at a constant "
        "velocity, less what depends on the angle, and the law of Coulomb and viscous friction. "
        f"Speeds up to {static:.2g} deg/s (hollow, shaded) do not follow the law and are not "
        "fitted; below them the law is dotted, its v_s set, not measured: the source prints none. "
        f"Beside an odd law a torque even in the velocity comes out at {slope:.1g} ± {sd:.1g} "
        "N m s/rad. The source's (10) is not odd and read literally grows without bound for "
        f"negative velocities. {design(studied)}. Differs from the source: simulated; both "
        "directions shown on top of each other (right)."
    )


FIGURE = SourceFigure(
    "guidali2013_fig02_friction", ("therapy",), SUBJECTS, draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
