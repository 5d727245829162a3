"""What all figure scripts share: a record, a caption beside the drawing, and a command line."""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from armimpedance.core.outputs import staged_file
from armimpedance.show.plots import save_with_caption
from armimpedance_figures.tsuji1997.study import study as study_hand

if TYPE_CHECKING:
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
        From the same to the text beside it: what is shown, what is simulated, what differs from
        the source.
    table : function or None
        From the same to the header and rows of a CSV beside the figure.
    fit : function or None
        From the analysed experiments to what `draw`, `caption` and `table` are then given in their
        place, so that a model is fitted once.
    study : function
        ``(experiment, subject=, seed=, sets=)`` simulates and analyses one; the hand's by default.
    samples : bool
        Whether it draws samples; the others draw from estimates, without them.
    """

    name: str
    experiments: tuple[str, ...]
    subject: str
    draw: Callable[..., Figure]
    caption: Callable[..., str]
    table: Callable[..., list[list[str]]] | None = None
    fit: Callable[..., Any] | None = None
    study: Callable[..., Any] = study_hand
    samples: bool = False

    def given(self, studied: Sequence[Any]) -> tuple[Any, ...]:
        """What `draw`, `caption` and `table` are called with."""
        return tuple(studied) if self.fit is None else (self.fit(*studied),)


def design(*studied: StudiedExperiment) -> str:
    """The sentence about the data that every caption holds."""
    trials = studied[0].trials
    per_condition = int(trials["condition"].value_counts().iloc[0])
    return (
        f"Simulated subject {studied[0].subject.id} (six-muscle arm behind a simulated "
        f"manipulandum, nominal noise), {per_condition} disturbances of 5 mm per condition, method "
        f"'{studied[0].hand[0].method}'"
    )


def write(
    figure_: SourceFigure,
    studied: Sequence[Any],
    out: Path,
    formats: Sequence[str] = FORMATS,
    *,
    baked: bool = False,
) -> list[Path]:
    """Draw, write each format, the caption beside it (or below the drawing), the CSV of a table."""
    return write_given(figure_, figure_.given(studied), out, formats, baked=baked)


def write_given(
    figure_: SourceFigure,
    given: Sequence[Any],
    out: Path,
    formats: Sequence[str] = FORMATS,
    *,
    baked: bool = False,
) -> list[Path]:
    """The same from what `SourceFigure.given` gave, which figures of one fit share."""
    figure, caption = figure_.draw(*given), figure_.caption(*given)
    written = save_with_caption(figure, out / figure_.name, formats, caption, baked=baked)
    if figure_.table is not None:
        written.append(out / f"{figure_.name}.csv")
        _write_table(figure_.table(*given), written[-1])
    return written


def _write_table(rows: list[list[str]], path: Path) -> None:
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows(rows)


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
    parser.add_argument("--caption", action="store_true", help="below the drawing, not beside it")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    studied = [
        figure_.study(name, subject=given.subject, seed=given.seed, sets=given.sets)
        for name in figure_.experiments
    ]
    for path in write(figure_, studied, given.out, baked=given.caption):
        print(path)
