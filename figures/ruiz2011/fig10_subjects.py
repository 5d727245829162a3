"""Ruiz (2011), Fig. 10: B and K of four subjects, mean and standard deviation of repetitions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.show import one_legend
from armimpedance.joint.elbow import METHODS
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.ruiz2011.session import SUBJECTS, Session, design, study
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What section 6.2 prints for all subjects, in N m s/rad and N m/rad.
PRINTED: Final = {"B": (2.5, 4.7), "K": (5.3, 13.1)}
LABELS: Final = {"B": "B (N m s/rad)", "K": "K (N m/rad)"}


def values(one: Session, name: str) -> FloatArray:
    """I, B or K of each repetition."""
    return np.array([fit[name].value for fit in one.fits])


def covered(sessions: tuple[Session, ...], name: str) -> int:
    """How many repetitions' 95 % intervals hold the truth."""
    ends = [(fit[name].ci95, one.true(name)) for one in sessions for fit in one.fits]
    return sum(bool(low <= true <= high) for (low, high), true in ends)


def draw(sessions: tuple[Session, ...]) -> Figure:
    """B and K side by side, the subjects from left to right."""
    figure = new_figure(TWO_COLUMNS_IN, 2.9)
    with print_style():
        axes = list(figure.subplots(1, len(PRINTED)))
        for name, ax in zip(PRINTED, axes, strict=True):
            _panel(sessions, name, ax)
        one_legend(figure, axes, columns=4)
    return figure


def _panel(sessions: tuple[Session, ...], name: str, ax: Axes) -> None:
    found = [values(one, name) for one in sessions]
    places = np.arange(len(sessions))
    ax.axhspan(*PRINTED[name], color="0.92", lw=0, label="range that the source prints")
    for i, (place, each) in enumerate(zip(places, found, strict=True)):
        ax.plot(
            np.full(len(each), place - 0.16), each, ls="", marker=".", ms=4, color="0.55",
            label="repetitions" if i == 0 else None,
        )  # fmt: skip
    ax.errorbar(
        places, [v.mean() for v in found], [v.std(ddof=1) for v in found], fmt="o", ms=4,
        color=OKABE_ITO["blue"], elinewidth=1.2, capsize=3, label="mean and sd",
    )  # fmt: skip
    ax.plot(
        places + 0.16, [one.true(name) for one in sessions], ls="", marker="_", ms=11, mew=1.6,
        color="black", label="true",
    )  # fmt: skip
    ax.set_xlim(-0.5, len(sessions) - 0.5)
    ax.set_ylim(0, None)
    ax.set_xticks(places, [one.subject for one in sessions])
    ax.set_xlabel("subject (number)")
    ax.set_ylabel(LABELS[name])


def table(sessions: tuple[Session, ...]) -> list[list[str]]:
    """One row per subject and parameter."""
    header = ["subject", "parameter", "true", "mean", "sd", "repetitions", "each"]
    rows = [[*header, "mean_standard_error_of_one_fit", "printed_lowest", "printed_highest"]]
    for one in sessions:
        for name, printed in PRINTED.items():
            each = values(one, name)
            error = np.mean([fit[name].sd_robust for fit in one.fits])
            own = [one.true(name), each.mean(), each.std(ddof=1)]
            rows.append(
                [
                    *(one.subject, name, *map(number, own), str(len(each))),
                    " ".join(map(number, each)),
                    *map(number, [error, *printed]),
                ]
            )
    return rows


def caption(sessions: tuple[Session, ...]) -> str:
    """What is shown, what the scatter is, what differs."""
    off = {
        name: np.mean([values(one, name).mean() / one.true(name) - 1 for one in sessions])
        for name in PRINTED
    }
    count = sum(len(one.fits) for one in sessions)
    return (
        "After Ruiz et al. (2011), Fig. 10: mean and standard deviation of viscosity B and "
        "stiffness K of each subject in the posture test, beside the single repetitions and the "
        f"truth. Each repetition is fitted by itself, method '{METHODS.default}'; the means are "
        f"off by {100 * off['B']:+.1f} % (B) and {100 * off['K']:+.1f} % (K) on average, "
        f"{covered(sessions, 'B')} (B) and {covered(sessions, 'K')} (K) of {count} intervals of 95 "
        "% hold the truth. B is told by all of the perturbation's band, K by its low end, where "
        "the subject's own torque is: hence K's scatter. "
        f"{design(*sessions)}. Differs from the source: simulated, with true B and K (gravity's "
        "part in K included) chosen within the printed range (grey), of which the source says "
        "neither to whom nor to which repetition its ends belong; its bars are means of "
        "overlapping windows."
    )


FIGURE = SourceFigure(
    "ruiz2011_fig10_subjects",
    ("elbow_posture",),
    SUBJECTS,
    draw,
    caption,
    table=table,
    study=study,
)

if __name__ == "__main__":
    script(FIGURE)
