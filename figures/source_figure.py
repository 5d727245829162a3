"""What all figure scripts share: a record, a caption below the drawing, and a command line."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.plots.style import print_style, save
from armimpedance_figures.experiment import StudiedExperiment, study

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: What all figures of estimates do otherwise than the source.
POOLED = (
    "Differs from the source: simulated; one estimate over all disturbances, where the source "
    "averages the estimates of ten sets."
)
#: Sets of eight disturbances per condition, as many as the source averages.
SETS = 10
SEED = 1997
CAPTION_POINTS = 7.5


@dataclass(frozen=True)
class SourceFigure:
    """A figure of a source, drawn anew.

    Attributes
    ----------
    name : str
        File name without ending.
    experiment, subject : str
        Which of the simulated experiments and subjects it needs; the source's subject.
    draw : function
        From the analysed experiment to a figure.
    caption : function
        From the analysed experiment to the text below it: what is shown, what is simulated, what
        differs from the source.
    """

    name: str
    experiment: str
    subject: str
    draw: Callable[[StudiedExperiment], Figure]
    caption: Callable[[StudiedExperiment], str]


def design(studied: StudiedExperiment) -> str:
    """The sentence about the data that every caption holds."""
    trials = studied.recording.trials
    per_condition = int(trials["condition"].value_counts().iloc[0])
    return (
        f"Simulated subject {studied.recording.subject.id} (six-muscle arm behind a simulated "
        f"manipulandum, nominal noise), {per_condition} disturbances of 5 mm per condition, method "
        f"'{studied.hand[0].method}'"
    )


def one_legend(figure: Figure, axes: Sequence[Axes], columns: int = 4) -> None:
    """Replace the panels' legends by one above them all, each label once."""
    once: dict[str, Artist] = {}
    for ax in axes:
        legend = ax.get_legend()
        if legend is not None:
            legend.remove()
        handles, labels = ax.get_legend_handles_labels()
        once |= dict(zip(labels, handles, strict=True))
    figure.legend(list(once.values()), list(once), loc="outside upper center", ncols=columns)


def write(figure_: SourceFigure, studied: StudiedExperiment, out: Path) -> list[Path]:
    """Draw, put the caption below, write PNG, SVG and PDF."""
    figure = figure_.draw(studied)
    add_caption(figure, figure_.caption(studied))
    return save(figure, out / figure_.name, ("png", "svg", "pdf"))


def add_caption(figure: Figure, caption: str) -> None:
    """Grow the figure at its foot and write the caption there."""
    width, height = figure.get_size_inches()
    # A DejaVu Sans letter is about 0.56 of its size wide on average.
    letters = int(width * 72 / (0.53 * CAPTION_POINTS))
    lines = textwrap.wrap(caption, letters)
    foot = (len(lines) + 1.6) * 1.3 * CAPTION_POINTS / 72
    with print_style():
        figure.set_size_inches(width, height + foot)
        figure.get_layout_engine().set(
            rect=(0, foot / (height + foot), 1, height / (height + foot))
        )
        figure.text(
            0.01,
            foot / (height + foot) * 0.93,
            "\n".join(lines),
            fontsize=CAPTION_POINTS,
            va="top",
            linespacing=1.3,
        )


def script(figure_: SourceFigure) -> None:
    """Command line of a figure script."""
    parser = argparse.ArgumentParser(description=f"Draw {figure_.name} from a simulated subject.")
    parser.add_argument("--out", type=Path, default=Path("out/figures"))
    parser.add_argument("--subject", default=figure_.subject, help="simulated subject, A to D")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--sets", type=int, default=SETS, help="sets of eight disturbances")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    studied = study(figure_.experiment, subject=given.subject, seed=given.seed, sets=given.sets)
    for path in write(figure_, studied, given.out):
        print(path)
