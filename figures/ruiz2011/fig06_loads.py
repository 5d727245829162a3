"""Ruiz (2011), Fig. 6: the loads of (10a-c) against angle, velocity and acceleration."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.show import one_legend
from armimpedance.numerics.signals import lowpass
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from manipulandum_sim.elbow import (
    HIDING_GAIN,
    HIDING_HZ,
    KINEMATICS_HZ,
    LOADS,
    RATE_HZ,
    RHYTHM_HZ,
    simulate_elbow,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

TESTS: Final = tuple(LOADS)
DURATION_S = 10.0
#: The source's own filter of kinematics and torque, zero-phase, Hz.
CUTOFF_HZ: Final = 10.0
#: Left out at both ends, where filters settle, s.
ENDS_S: Final = 0.5
SYMBOLS: Final = ("K", "B", "I")
UNITS: Final = ("N m/rad", "N m s/rad", "kg m²")
X_LABELS: Final = ("angle from θ₀ (rad)", "velocity (rad/s)", "acceleration (rad/s²)")
LETTERS: Final = ("(10a) spring", "(10b) damper", "(10c) inertia")
#: The column in quadrature to each load's own, that a lag shows in: velocity, acceleration,
#: velocity.
FALSE: Final = (1, 2, 1)
MEASURED: Final = "as measured"
LAG_TAKEN_OFF: Final = "against kinematics behind the control's filter"


@dataclass(frozen=True)
class View:
    """Torque against kinematics, and the plane through them.

    Attributes
    ----------
    own : (N,)
        The load's own kinematic variable.
    torque : (N,)
        By the limb on the device, N m.
    load : float
        Of `own`.
    false : float
        Of the variable in quadrature.
    """

    own: FloatArray
    torque: FloatArray
    load: float
    false: float


@dataclass(frozen=True)
class Load:
    """One rendered load: its number in (10a-c), what was asked, and both views of it."""

    number: int
    asked: float
    views: dict[str, View]

    @property
    def false_symbol(self) -> str:
        """What the lag looks like: a viscosity or an inertia."""
        return SYMBOLS[FALSE[self.number]]


def study(experiment: str, *, subject: str, seed: int, sets: int) -> tuple[Load, ...]:
    """A rhythmic movement against each load; `sets`, of the hand's tests, plays no part.

    Raises
    ------
    InputError
        An unknown experiment or subject.
    """
    del sets
    if experiment != "elbow_loads":
        raise InputError(f"no experiment {experiment!r}", expected="elbow_loads")
    return tuple(_load(i, test, subject, seed) for i, test in enumerate(TESTS))


def _load(index: int, test: str, subject: str, seed: int) -> Load:
    recording, truth = simulate_elbow(
        test,  # type: ignore[arg-type]
        subject=subject,
        seed=seed,
        repetitions=1,
        duration_s=DURATION_S,
    )
    moved = np.stack(
        [recording.position[:, 0] - truth.operating_angle, recording.extra["gyro1_rad_s"]]
    )
    torque = recording.force[:, 0]
    asked = (truth.rendered[2], truth.rendered[1], truth.rendered[0])[index]
    views = {
        MEASURED: _view(index, moved, torque),
        LAG_TAKEN_OFF: _view(index, behind_control(moved), torque),
    }
    return Load(index, float(asked), views)


def behind_control(moved: FloatArray) -> FloatArray:
    """Angle and velocity (2, N) as the exoskeleton's control sees them."""
    from scipy.signal import butter, sosfilt

    return np.asarray(sosfilt(butter(2, KINEMATICS_HZ, fs=RATE_HZ, output="sos"), moved))


def _view(index: int, moved: FloatArray, torque: FloatArray) -> View:
    angle, rate, smooth = lowpass(np.stack([*moved, torque]), CUTOFF_HZ, RATE_HZ)
    ends = round(ENDS_S * RATE_HZ)
    inside = slice(ends, -ends)
    columns = np.stack([angle, rate, np.gradient(rate, 1 / RATE_HZ)])[:, inside]
    own, false = columns[index], columns[FALSE[index]]
    # torque (N,) = [own, false, 1] (N, 3) [load, false part, offset] (3,)
    design = np.column_stack([own, false, np.ones(own.size)])
    found = np.linalg.lstsq(design, smooth[inside], rcond=None)[0]
    return View(own, smooth[inside], float(found[0]), float(found[1]))


def draw(loads: tuple[Load, ...]) -> Figure:
    """Three panels, with the load that was asked for as a line."""
    figure = new_figure(TWO_COLUMNS_IN, 2.75)
    with print_style():
        axes = list(figure.subplots(1, len(loads)))
        for load, ax in zip(loads, axes, strict=True):
            _panel(load, ax)
        one_legend(figure, axes, columns=3)
    return figure


def _panel(load: Load, ax: Axes) -> None:
    looks = {MEASURED: ("orange", 1.2), LAG_TAKEN_OFF: ("blue", 0.9)}
    for name, view in load.views.items():
        color, width = looks[name]
        ax.plot(view.own, view.torque, color=OKABE_ITO[color], lw=width, label=name)
    own = load.views[MEASURED].own
    ends = np.array([own.min(), own.max()])
    ax.plot(ends, load.asked * ends, color="black", lw=1.2, ls=(0, (5, 2)), label="asked for")
    ax.set_title(f"{LETTERS[load.number]}\n{_false_text(load)}", loc="left", fontsize=7)
    ax.set_xlabel(X_LABELS[load.number])
    ax.set_ylabel("torque (N m)")


def _false_text(load: Load) -> str:
    before, after = (load.views[v].false for v in (MEASURED, LAG_TAKEN_OFF))
    unit = UNITS[FALSE[load.number]]
    text = f"false {load.false_symbol} {before:.3f} → {after:.3f} {unit}"
    return text.replace("-", "\N{MINUS SIGN}")


def table(loads: tuple[Load, ...]) -> list[list[str]]:
    """One row per load and view."""
    header = ["load", "torque_against", "parameter", "unit", "asked", "rendered"]
    rows = [[*header, "false_parameter", "false_unit", "false"]]
    for load in loads:
        i, false = load.number, FALSE[load.number]
        for name, view in load.views.items():
            rows.append(
                [
                    *(TESTS[i], name, SYMBOLS[i], UNITS[i], number(load.asked), number(view.load)),
                    *(SYMBOLS[false], UNITS[false], number(view.false)),
                ]
            )
    return rows


def caption(loads: tuple[Load, ...]) -> str:
    """What is shown, what the lag makes, what is left, what differs."""
    found = "; ".join(
        f"{SYMBOLS[o.number]} {o.views[MEASURED].load:.3g} and {o.views[LAG_TAKEN_OFF].load:.3g} "
        f"for {o.asked:g} {UNITS[o.number]}, false {o.false_symbol} {o.views[MEASURED].false:.3f} "
        f"and {o.views[LAG_TAKEN_OFF].false:.3f} {UNITS[FALSE[o.number]]}"
        for o in loads
    )
    return (
        "After Ruiz et al. (2011), Fig. 6: torque by the limb on the exoskeleton against (a) "
        "angle, (b) velocity and (c) acceleration, while it renders a spring, a damper and an "
        "inertia. The control's low-pass of the kinematics (second-order Butterworth, "
        f"{KINEMATICS_HZ:g} Hz) is about {1e3 * _lag_s():.0f} ms late: loads open into loops, a "
        "spring K shows a false viscosity of -K times the lag and feeds energy, an inertia one "
        "that brakes, a damper a false inertia. Against kinematics that went through the same "
        "filter the lag is gone, and what is left is the exoskeleton's own inertia and friction, "
        "less what the torque feedback hides of them (gain "
        f"{HIDING_GAIN:g} below {HIDING_HZ:g} Hz). Least squares on the variable and the one in "
        f"quadrature to it, as measured and behind the filter: {found}. One simulated subject's "
        f"rhythmic movement at {RHYTHM_HZ:g} Hz, {DURATION_S:g} s; potentiometer, gyroscope and "
        f"strain gauges, zero-phase low-pass {CUTOFF_HZ:g} Hz on all, acceleration differentiated. "
        "Differs from the source: simulated, with (2) about q0, which it drops; it explains the "
        "lag by filters and soft tissue, here all of it is the control's and the device's."
    )


def _lag_s() -> float:
    """Group delay at 0 Hz of a second-order Butterworth low-pass, s."""
    return float(np.sqrt(2) / (2 * np.pi * KINEMATICS_HZ))


FIGURE = SourceFigure(
    "ruiz2011_fig06_loads", ("elbow_loads",), "2", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
