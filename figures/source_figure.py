"""What all figure scripts share: a record, a caption below the drawing, and a command line."""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.outputs import staged_file
from armimpedance.plots import print_style, save
from armimpedance_figures.tsuji1997.study import study as study_hand

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from armimpedance_figures.tsuji1997.study import StudiedExperiment

#: What all figures of estimates do otherwise than the source.
POOLED = (
    "Differs from the source: simulated; one estimate over all disturbances, where the source "
    "averages the estimates of ten sets."
)
#: Sets of eight disturbances per condition, as many as the source averages.
SETS = 10
SEED = 1997
CAPTION_POINTS = 7.5
FORMATS = ("png", "svg", "pdf")


@dataclass(frozen=True)
class SourceFigure:
    """A figure of a source, drawn anew.

    Attributes
    ----------
    name : str
        File name without ending.
    experiments : tuple of str
        Which simulated experiments it needs, names that `study` knows.
    subject : str
        The source's subject.
    draw : function
        From the analysed experiments, one argument each, to a figure.
    caption : function
        From the same to the text below it: what is shown, what is simulated, what differs from
        the source.
    table : function or None
        From the same to the header and rows of a CSV beside the figure.
    fit : function or None
        From the analysed experiments to what `draw`, `caption` and `table` are then given in their
        place, so that a model is fitted once.
    study : function
        ``(experiment, subject=, seed=, sets=)`` simulates and analyses one; the hand's by default.
    """

    name: str
    experiments: tuple[str, ...]
    subject: str
    draw: Callable[..., Figure]
    caption: Callable[..., str]
    table: Callable[..., list[list[str]]] | None = None
    fit: Callable[..., Any] | None = None
    study: Callable[..., Any] = study_hand

    def given(self, studied: Sequence[Any]) -> tuple[Any, ...]:
        """What `draw`, `caption` and `table` are called with."""
        return tuple(studied) if self.fit is None else (self.fit(*studied),)


def design(*studied: StudiedExperiment) -> str:
    """The sentence about the data that every caption holds."""
    trials = studied[0].recording.trials
    per_condition = int(trials["condition"].value_counts().iloc[0])
    return (
        f"Simulated subject {studied[0].recording.subject.id} (six-muscle arm behind a simulated "
        f"manipulandum, nominal noise), {per_condition} disturbances of 5 mm per condition, method "
        f"'{studied[0].hand[0].method}'"
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


def write(
    figure_: SourceFigure,
    studied: Sequence[Any],
    out: Path,
    formats: Sequence[str] = FORMATS,
) -> list[Path]:
    """Draw, put the caption below, write each format, and the CSV of a table."""
    given = figure_.given(studied)
    figure = figure_.draw(*given)
    add_caption(figure, figure_.caption(*given))
    written = save(figure, out / figure_.name, formats)
    if figure_.table is not None:
        written.append(out / f"{figure_.name}.csv")
        _write_table(figure_.table(*given), written[-1])
    return written


def _write_table(rows: list[list[str]], path: Path) -> None:
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows)


def add_caption(figure: Figure, caption: str) -> None:
    """Grow the figure at its foot and write the caption there."""
    width, height = figure.get_size_inches()
    lines = _lines(caption, 0.98 * 72 * width)
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


def _lines(text: str, width_pt: float) -> list[str]:
    """The text broken where a line would be wider, measured letter by letter."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    measure, font = TextToPath(), FontProperties(family="DejaVu Sans", size=CAPTION_POINTS)
    lines = [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        wide, _, _ = measure.get_text_width_height_descent(longer, font, ismath=False)
        if lines[-1] and wide > width_pt:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines


def script(figure_: SourceFigure) -> None:
    """Command line of a figure script."""
    parser = argparse.ArgumentParser(description=f"Draw {figure_.name} from a simulated subject.")
    parser.add_argument("--out", type=Path, default=Path("out/figures"))
    parser.add_argument(
        "--subject", default=figure_.subject, help="simulated subject (the hand's: A to D)"
    )
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument(
        "--sets", type=int, default=SETS, help="of eight disturbances, for the hand"
    )
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    studied = [
        figure_.study(name, subject=given.subject, seed=given.seed, sets=given.sets)
        for name in figure_.experiments
    ]
    for path in write(figure_, studied, given.out):
        print(path)
