"""Ruiz (2011), Fig. 9: B and K of one subject who holds a posture, in windows that overlap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from armimpedance.hand.show import one_legend
from armimpedance.joint.elbow import VaryingImpedance, identify_varying
from armimpedance.joint.elbow.show import plot_varying
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.ruiz2011.bench import CONSTANT_S
from armimpedance_figures.ruiz2011.session import Session, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Length of the windows, s, and their colour.
WINDOWS: Final = {CONSTANT_S: "vermillion", 2.0: "blue"}
ROWS: Final[tuple[Literal["B", "K"], ...]] = ("B", "K")
UNITS: Final = {"B": "N m s/rad", "K": "N m/rad"}
#: Which repetition is drawn, counted from 0.
REPETITION: Final = 0


@dataclass(frozen=True)
class StudiedWindows:
    """A session and B and K over one repetition's time, by length of the windows."""

    session: Session
    found: dict[float, VaryingImpedance]

    def scatter(self, length_s: float, name: str) -> float:
        """Standard deviation of B or K over the windows."""
        return float(getattr(self.found[length_s], name).std(ddof=1))

    def mean(self, length_s: float, name: str) -> float:
        """Of B or K over the windows."""
        return float(getattr(self.found[length_s], name).mean())


def fit(sessions: tuple[Session, ...]) -> StudiedWindows:
    """Windows of each length on one repetition."""
    (session,) = sessions
    samples = session.samples(REPETITION)
    found = {s: identify_varying(samples, method="windows", window_s=s) for s in WINDOWS}
    return StudiedWindows(session, found)


def draw(studied: StudiedWindows) -> Figure:
    """B above K, as the source has them."""
    figure = new_figure(TWO_COLUMNS_IN, 4.0)
    with print_style():
        axes = list(figure.subplots(2, sharex=True))
    for name, ax in zip(ROWS, axes, strict=True):
        for length_s, color in WINDOWS.items():
            label = f"windows of {length_s:g} s"
            plot_varying(studied.found[length_s], name, color=OKABE_ITO[color], label=label, ax=ax)
        said = [f"of {s:g} s: {studied.scatter(s, name):.2g}" for s in WINDOWS]
        with print_style():
            ax.axhline(studied.session.true(name), color="black", lw=1.2, label="true")
            ax.set_title(
                f"sd of {name} over windows {', '.join(said)} {UNITS[name]}", loc="left", fontsize=8
            )
    axes[0].set_xlabel("")
    with print_style():
        one_legend(figure, axes, columns=3)
    return figure


def table(studied: StudiedWindows) -> list[list[str]]:
    """One row per parameter, length and window."""
    header = ["parameter", "window_s", "centre_s", "true", "estimated", "ci95_low", "ci95_high"]
    rows = [header]
    for name in ROWS:
        true = studied.session.true(name)
        for length_s, found in studied.found.items():
            columns = [found.time_s, getattr(found, name), *found.band(name).T]
            for time, *values in zip(*columns, strict=True):
                rows.append([name, *map(number, [length_s, time, true, *values])])
    return rows


def caption(studied: StudiedWindows) -> str:
    """What is shown, where the scatter comes from, what differs."""
    session = studied.session
    low, high = session.fits[REPETITION].stiffness.ci95
    means = " and ".join(f"{studied.mean(s, 'K'):.1f} ({s:g} s)" for s in WINDOWS)
    return (
        "After Ruiz et al. (2011), Fig. 9: viscosity B and stiffness K of one subject who holds a "
        "posture, in windows that overlap by half, with 95 % bands. Both are truly constant (black "
        f"lines): K {session.true('K'):.1f} N m/rad, B {session.true('B'):.2f} N m s/rad. The "
        f"means of K over the windows are {means}; the whole repetition gives {low:.1f} to "
        f"{high:.1f} (95 %). All of the scatter is the estimates', none the joint's: the voluntary "
        "torque is large where K shows, below 1 Hz, and a short window holds not even one of its "
        "periods. The source reads such scatter as torque modulated by the subject. "
        f"{design(session)}; repetition {REPETITION + 1} is shown. Differs from the source: "
        "simulated, I shared by all windows and noise weighed, bands, and a second length of "
        "windows; the source does not say its own."
    )


FIGURE = SourceFigure(
    "ruiz2011_fig09_windows",
    ("elbow_posture",),
    "2",
    draw,
    caption,
    table=table,
    fit=fit,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
