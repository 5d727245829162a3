"""Venture (poster): which motions excite the body's dynamics, and in which order to take them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.joint.body import MotionChoice
from armimpedance.show.plots import DrawnRow, TableBlock, plot_table
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.venture_poster.study import UNNATURAL, StudiedBody, design, study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = ("time (s)", "alone", "no noise", "chosen", "then", "chosen*", "then*")
HEADER = (
    *("motion", "seconds", "condition_alone", "condition_alone_without_noise"),
    *("chosen_of_all", "condition_after_it", "chosen_of_natural", "condition_after_it_natural"),
)


def draw(studied: StudiedBody) -> Figure:
    """One row a motion, the most exciting first."""
    order = np.argsort(studied.weighted.choice.alone)
    motions = [studied.equations.motions[t] for t in order]
    rows = tuple(
        DrawnRow(
            motion.replace("_", " "), _cells(studied, motion), strong=_step(studied, motion) > 0
        )
        for motion in motions
    )
    heading = f"Condition of the column-scaled base regressor (* without '{_name()}')"
    ax = plot_table(COLUMNS, [TableBlock(heading, rows)])
    return ax.figure  # type: ignore[return-value]


def _name() -> str:
    return UNNATURAL.replace("_", " ")


def _step(studied: StudiedBody, motion: str) -> int:
    return place(studied.weighted.choice, motion)[0]


def place(choice: MotionChoice, motion: str) -> tuple[int, float]:
    """As which (from 1) a motion was chosen and the condition after it; 0 and nan if it was not."""
    if motion not in choice.motions:
        return 0, float("nan")
    at = choice.motions.index(motion)
    return at + 1, choice.conditions[at]


def _cells(studied: StudiedBody, motion: str) -> tuple[str, ...]:
    t = studied.equations.motions.index(motion)
    greedy = [place(choice, motion) for choice in (studied.weighted.choice, studied.natural)]
    return (
        f"{_seconds(studied, t):.1f}",
        _condition(studied.weighted.choice.alone[t]),
        _condition(studied.exact_alone[t]),
        *(text for step, after in greedy for text in (str(step or ""), _condition(after))),
    )


def _condition(value: float) -> str:
    if np.isnan(value):
        return ""
    return f"{value:,.0f}" if value >= 100 else f"{value:.1f}"


def _seconds(studied: StudiedBody, t: int) -> float:
    samples = studied.recording.samples_of(t)
    return (samples.stop - samples.start) / studied.recording.sample_rate_hz


def table(studied: StudiedBody) -> list[list[str]]:
    """One row a motion, in the order of the recording."""
    rows = [list(HEADER)]
    for t, motion in enumerate(studied.equations.motions):
        values = [_seconds(studied, t), studied.weighted.choice.alone[t], studied.exact_alone[t]]
        greedy = [place(choice, motion) for choice in (studied.weighted.choice, studied.natural)]
        cells = [text for step, after in greedy for text in (str(step or ""), number(after))]
        rows.append([motion, *map(number, values), *cells])
    return rows


def caption(studied: StudiedBody) -> str:
    """What is shown and what differs."""
    natural = studied.natural
    return (
        "After Venture (poster), 'Most exciting chosen for identification (according to the "
        "condition number of the regressor)': the twelve motions of the simulated body, the "
        "condition of each one's base regressor by itself, columns scaled to unit length, and the "
        "greedy choice: the motion with the lowest condition, then the one that lowers it most, "
        "until none does. Bold: chosen, the others serve cross-validation. *: the choice without "
        f"'{_name()}', in which everything moves at once and which no patient is asked to do; "
        f"{len(natural.motions)} natural motions reach {natural.conditions[-1]:.1f}. "
        "'no noise': the condition of the same motion without noise on the angles, which "
        "only a simulation knows. Noise shakes every joint a little and so makes poor motions "
        "look far better than they are: a condition from noisy angles is no proof that a motion "
        f"excites. {design(studied)}; low-pass {studied.rows.cutoff_hz:g} Hz. Differs from the "
        "source: simulated, angles instead of filmed markers; the poster names neither its "
        "conditions nor the motions it chose."
    )


FIGURE = SourceFigure(
    "venture_poster_conditions", ("body",), "A", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
