"""Guidali (2013), Fig. 5: passive movements of four people, measured and as their models say."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.therapy import MovementTorques, robot_bodies, smooth_trials
from armimpedance.numerics.signals import spline_kernels
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.guidali2013.study import SUBJECTS, Person, TherapyStudy, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: (subject, movement) of each panel, in the source's order.
PANELS: Final = (
    ("S5", "elevation"),
    ("S11", "horizontal"),
    ("P2", "elevation"),
    ("P6", "horizontal"),
)
#: Which axis has a torque sensor, from 0.
SENSOR_AXIS: Final = 1
#: Support of the analysis' kernel, s, which the sensor goes through as well.
KERNEL_S: Final = 0.1


def shown(studied: TherapyStudy) -> list[tuple[str, Person, str]]:
    """Letter, person and movement of each panel whose person is in the study."""
    names = set(studied.subjects)
    letters = zip("abcd", PANELS, strict=True)
    return [(a, studied.person(who), what) for a, (who, what) in letters if who in names]


def passive_of(person: Person, movement: str) -> list[MovementTorques]:
    """The passive repetitions."""
    return [m for m in person.calibration.movements if m.movement == movement]


def sensor_support(studied: TherapyStudy, person: Person) -> list[FloatArray]:
    """Support torque of each horizontal repetition by the sensor of axis 2, (S,) each.

    The sensor sits beyond gear and rotor: it measures what links, cables and person need.
    """
    robot = studied.identified.adjusted_to(person.calibration.arm.upper_arm_m)
    links = robot_bodies(replace(robot, motor_inertia_kgm2=np.zeros(robot.n_axes)))
    loads = robot.identified
    stiffness, offset = (loads.term(n)[SENSOR_AXIS] for n in ("cable_stiffness", "cable_offset"))
    chosen = np.flatnonzero(person.passive.trials["movement"] == "horizontal")
    recording = person.passive.select(chosen)
    kernels = spline_kernels(KERNEL_S, recording.sample_rate_hz)
    found = []
    for trial, row in zip(smooth_trials(recording), recording.trials.itertuples(), strict=True):
        raw = recording.extra["sensor2_Nm"][recording.samples_of(trial.row)]
        sensed = np.convolve(raw, kernels.smooth[::-1], mode="valid")
        own = links.torque(trial.q, trial.qd, trial.qdd)[:, SENSOR_AXIS]
        cable = stiffness * trial.q[:, SENSOR_AXIS] + offset
        t = trial.time_s
        kept = (t >= row.onset_s - 1e-9) & (t <= row.end_s + 1e-9)
        found.append((sensed - own - cable)[kept])
    return found


def draw(studied: TherapyStudy) -> Figure:
    """Four panels over time."""
    panels = shown(studied)
    figure = new_figure(TWO_COLUMNS_IN, 2.2 * -(-len(panels) // 2) + 0.4)
    with print_style():
        axes = figure.subplots(-(-len(panels) // 2), 2, squeeze=False)
        once = {}
        for ax, (letter, person, movement) in zip(axes.flat, panels, strict=False):
            _panel(studied, person, movement, ax)
            ax.set_title(f"({letter}) {person.name}, {movement}", loc="left")
            handles, labels = ax.get_legend_handles_labels()
            once |= dict(zip(labels, handles, strict=True))
        for ax in axes.flat[len(panels) :]:
            ax.axis("off")
        figure.legend(list(once.values()), list(once), loc="outside upper center", ncols=4)
    return figure


def _panel(studied: TherapyStudy, person: Person, movement: str, ax: Axes) -> None:
    repetitions = passive_of(person, movement)
    if movement == "horizontal":
        for i, sensed in enumerate(sensor_support(studied, person)):
            time, label = _time(repetitions[i]), "torque sensor" if i == 0 else None
            ax.plot(time, sensed, color=OKABE_ITO["orange"], lw=0.8, label=label)
    for i, torques in enumerate(repetitions):
        label = "measured support" if i == 0 else None
        ax.plot(_time(torques), torques.support, color=OKABE_ITO["blue"], lw=0.8, label=label)
    first = repetitions[0]
    ax.plot(_time(first), first.arm, color="black", ls=(0, (4, 2)), label="identified model")
    inner = np.concatenate([m.support[_middle(m)] for m in repetitions])
    room = 0.15 * float(np.ptp(np.append(inner, 0.0)))
    ax.set_ylim(min(0.0, float(inner.min())) - room, max(0.0, float(inner.max())) + room)
    ax.set(xlabel="time (s)", ylabel="torque (N m)")


def _time(torques: MovementTorques) -> FloatArray:
    return torques.time_s - torques.time_s[0]


def _middle(torques: MovementTorques) -> slice:
    """Without the ends, where the gears stick."""
    tenth = len(torques.q) // 10
    return slice(tenth, -tenth)


def _left(torques: MovementTorques, measured: FloatArray) -> float:
    """Rms of the model's error without the ends, N m."""
    part = _middle(torques)
    return float(np.sqrt(np.mean((measured - torques.arm)[part] ** 2)))


def table(studied: TherapyStudy) -> list[list[str]]:
    """What the model leaves of support and sensor, one row per repetition."""
    rows = [["subject", "movement", "repetition", "rms_support_Nm", "rms_sensor_Nm"]]
    for _, person, movement in shown(studied):
        repetitions = passive_of(person, movement)
        sensed = sensor_support(studied, person) if movement == "horizontal" else []
        for i, torques in enumerate(repetitions):
            beside = number(_left(torques, sensed[i])) if sensed else ""
            left = number(_left(torques, torques.support))
            rows.append([person.name, movement, str(i + 1), left, beside])
    return rows


def caption(studied: TherapyStudy) -> str:
    """What is shown, what the sensor adds, what differs."""
    header, *rows = table(studied)
    at = {name: header.index(name) for name in header}
    support = [float(r[at["rms_support_Nm"]]) for r in rows]
    return (
        "After Guidali et al. (2013), Fig. 5: support torque (motor less robot) of the passive "
        "repetitions, the identified model of the arm, and for the horizontal movement what the "
        "torque sensor of axis 2 says, which needs no model of the gear's friction. Between the "
        f"movements' ends the models leave {min(support):.2f} to {max(support):.2f} N m rms; at "
        "the ends the gears stick, which the robot's model leaves out, and curves leave the "
        f"panels. {design(studied)}; people with Table 4's stiffness and rest angles. Differs "
        "from the source: simulated; all three repetitions shown."
    )


FIGURE = SourceFigure(
    "guidali2013_fig05_passive_torques",
    ("therapy",),
    SUBJECTS,
    draw,
    caption,
    table=table,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
