"""Ruiz (2011), Fig. 5: K and B that vary as sines, true and estimated, with bands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.hand.show import one_legend
from armimpedance.joint.elbow import VaryingImpedance
from armimpedance.joint.elbow.show import plot_varying
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.ruiz2011.bench import CONSTANT_S, DEPTH, SOURCES, Varying, varying_draws
from armimpedance_figures.ruiz2011.frequency import NAMES, error_of, identified
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FREQUENCY_HZ: Final = 0.7
SNR_DB: Final = 40.0
METHODS: Final = {"windows": "vermillion", "smoother": "blue"}
LABELS: Final = {"windows": "windows, as the source", "smoother": "smoother"}
ROWS: Final[tuple[Literal["K", "B"], ...]] = ("K", "B")


@dataclass(frozen=True)
class StudiedCourse:
    """One record and what each method makes of it."""

    record: Varying
    found: dict[str, VaryingImpedance]

    def percent(self, method: str, name: str) -> float:
        """rms over time of the relative error of B or K, %."""
        return float(100 * error_of(self.record, self.found[method])[NAMES.index(name)])

    def worst_percent(self, method: str, name: str) -> float:
        """Largest relative error over time, %."""
        return float(100 * np.abs(self._relative(method, name)).max())

    def covered_percent(self, method: str, name: str) -> float:
        """Share of points whose 95 % band holds the truth, %."""
        found = self.found[method]
        low, high = found.band(name).T
        true = self.true(method, name)
        return float(100 * ((low <= true) & (true <= high)).mean())

    def true(self, method: str, name: str) -> np.ndarray:
        """True B or K at the points of a method."""
        return np.interp(self.found[method].time_s, *self.record.truth(name))

    def _relative(self, method: str, name: str) -> np.ndarray:
        return np.asarray(getattr(self.found[method], name) / self.true(method, name) - 1)


def study(experiment: str, *, subject: str, seed: int, sets: int) -> StudiedCourse:
    """One record on the bench; subject and sets, of other experiments, play no part.

    Raises
    ------
    InputError
        An unknown experiment.
    """
    del subject, sets
    if experiment != "elbow_course":
        raise InputError(f"no experiment {experiment!r}", expected="elbow_course")
    (record,) = varying_draws(SOURCES, FREQUENCY_HZ, draws=1, snr_db=SNR_DB, seed=seed)
    return StudiedCourse(record, {method: identified(record, method) for method in METHODS})


def draw(studied: StudiedCourse) -> Figure:
    """K above B."""
    figure = new_figure(TWO_COLUMNS_IN, 4.2)
    with print_style():
        axes = list(figure.subplots(2, sharex=True))
    for name, ax in zip(ROWS, axes, strict=True):
        for method, color in METHODS.items():
            truth = studied.record.truth(name) if method == "windows" else None
            found, label = studied.found[method], LABELS[method]
            plot_varying(found, name, truth=truth, color=OKABE_ITO[color], label=label, ax=ax)
        said = [f"{m} {studied.percent(m, name):.1f} %" for m in METHODS]
        with print_style():
            ax.set_title(f"rms error of {name}: {', '.join(said)}", loc="left", fontsize=8)
    axes[0].set_xlabel("")
    with print_style():
        one_legend(figure, axes, columns=3)
    return figure


def table(studied: StudiedCourse) -> list[list[str]]:
    """One row per parameter, method and point in time."""
    rows = [["parameter", "method", "time_s", "true", "estimated", "ci95_low", "ci95_high"]]
    for name in ROWS:
        for method in METHODS:
            found, true = studied.found[method], studied.true(method, name)
            columns = [found.time_s, true, getattr(found, name), *found.band(name).T]
            for values in zip(*columns, strict=True):
                rows.append([name, method, *map(number, values)])
    return rows


def caption(studied: StudiedCourse) -> str:
    """What is shown, how far it is off, what differs."""
    joint = studied.record.joint
    off = "; ".join(
        f"{m}: K {studied.percent(m, 'K'):.1f} % rms, {studied.worst_percent(m, 'K'):.0f} % at "
        f"worst, B {studied.percent(m, 'B'):.1f} and {studied.worst_percent(m, 'B'):.0f} %"
        for m in METHODS
    )
    held = ", ".join(
        f"{studied.covered_percent(m, 'K'):.0f} % of K's points and "
        f"{studied.covered_percent(m, 'B'):.0f} % of B's by {m}"
        for m in METHODS
    )
    return (
        "After Ruiz et al. (2011), Fig. 5: stiffness K (upper) and viscosity B (lower) that vary "
        f"as sines of {FREQUENCY_HZ:g} Hz and {100 * DEPTH:.0f} %, true and estimated, with "
        f"pointwise 95 % bands. Simulated joint (I {joint.inertia:g} kg m², B {joint.viscosity:g} "
        f"N m s/rad, K {joint.stiffness:g} N m/rad on average) on a bench, random torque behind a "
        f"low-pass at 10 Hz, white noise at {SNR_DB:g} dB on torque and angle. 'windows' is the "
        f"source's way, constant in windows of {CONSTANT_S:g} s that overlap by half, here with "
        "one I for all of them. A window holds little more than one time constant B/K of this "
        f"joint, {joint.viscosity / joint.stiffness:.2f} s; it flattens the sine and says so in "
        "its band, which takes in what two more powers of time would move. 'smoother' takes B and "
        f"K for integrated random walks. Relative errors: {off}. Bands hold the truth at {held}. "
        "Differs from the source: simulated anew, since it prints neither the joint nor "
        "the noise of its figure; it calls 0.7 Hz the highest frequency with errors below 10 %, "
        "which windows do not reach for K of this joint, and shows no bands."
    )


FIGURE = SourceFigure(
    "ruiz2011_fig05_time_varying", ("elbow_course",), "", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
