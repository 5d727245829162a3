"""Build every figure of the catalogue."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance_figures.guidali2013 import (
    contribution_means as guidali2013_contribution_means,
    feedback as contribution_feedback,
    fig02_friction as guidali2013_fig02_friction,
    fig03_cable as guidali2013_fig03_cable,
    fig04_mock_up as guidali2013_fig04_mock_up,
    fig05_passive_torques as guidali2013_fig05_passive_torques,
    fig06_contribution as guidali2013_fig06_contribution,
    table2 as guidali2013_table2,
    table3 as guidali2013_table3,
    table4 as guidali2013_table4,
)
from armimpedance_figures.ruiz2011 import (
    fig05_time_varying as ruiz2011_fig05_time_varying,
    fig06_loads as ruiz2011_fig06_loads,
    fig09_windows as ruiz2011_fig09_windows,
    fig10_subjects as ruiz2011_fig10_subjects,
    study_frequency as elbow_study_frequency,
    study_snr as elbow_study_snr,
)
from armimpedance_figures.source_figure import SEED, SETS, SourceFigure, write
from armimpedance_figures.tsuji1997.every import FIGURES as TSUJI1997
from armimpedance_figures.venture_elbow import (
    fig04 as venture_elbow_fig04,
    fig06_fig07 as venture_elbow_fig06_fig07,
    fig08_fig09 as venture_elbow_fig08_fig09,
    table2_table3 as venture_elbow_table2_table3,
)
from armimpedance_figures.venture_poster import (
    conditions as venture_poster_conditions,
    cross_validation as venture_poster_cross_validation,
    discrimination as venture_poster_discrimination,
)

_OTHERS = tuple(
    module.FIGURE
    for module in (
        venture_elbow_table2_table3,
        venture_elbow_fig04,
        venture_elbow_fig06_fig07,
        venture_elbow_fig08_fig09,
        venture_poster_cross_validation,
        venture_poster_conditions,
        venture_poster_discrimination,
        ruiz2011_fig05_time_varying,
        ruiz2011_fig06_loads,
        ruiz2011_fig09_windows,
        ruiz2011_fig10_subjects,
        elbow_study_snr,
        elbow_study_frequency,
        guidali2013_fig02_friction,
        guidali2013_table3,
        guidali2013_fig03_cable,
        guidali2013_table2,
        guidali2013_fig04_mock_up,
        guidali2013_fig05_passive_torques,
        guidali2013_table4,
        guidali2013_fig06_contribution,
        guidali2013_contribution_means,
        contribution_feedback,
    )
)
#: What the names of the figures begin with.
_SOURCE = re.compile(r"^(tsuji1997|ruiz2011|guidali2013|venture_elbow|venture_poster)_")
CATALOGUE = {figure.name: figure for figure in (*TSUJI1997, *_OTHERS)}


def chosen(names: Sequence[str]) -> list[SourceFigure]:
    """The figures whose names contain one of these; all, if there are none.

    Raises
    ------
    InputError
        If a name matches no figure.
    """
    wanted = {found for name in names for found in _matches(name)}
    return [f for f in CATALOGUE.values() if not names or f.name in wanted]


def _matches(name: str) -> list[str]:
    """Figures that this names: those that begin so, behind their source, before those that hold it.

    ``fig07`` is Fig. 7 of one source and not the second half of another's ``fig06_fig07``.
    """
    held = [known for known in CATALOGUE if name in known]
    if not held:
        raise InputError(f"no figure {name!r}", expected=f"one of {', '.join(CATALOGUE)}")
    return [known for known in held if _SOURCE.sub("", known).startswith(name)] or held


def build(
    figures: Sequence[SourceFigure],
    out: Path,
    *,
    seed: int = SEED,
    sets: int = SETS,
    baked: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Path]:
    """Simulate and analyse what the figures need, each once, and write them; yields the files."""
    out.mkdir(parents=True, exist_ok=True)
    studied: dict[tuple[Any, str, str], Any] = {}
    for done, figure in enumerate(figures):
        if progress is not None:
            progress(done, len(figures))
        keys = [(figure.study, name, figure.subject) for name in figure.experiments]
        for key in keys:
            if key not in studied:
                studied[key] = figure.study(key[1], subject=key[2], seed=seed, sets=sets)
        yield from write(figure, [studied[key] for key in keys], out, baked=baked)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Build all figures from simulated subjects.")
    parser.add_argument("--out", type=Path, default=Path("out/figures"))
    for path in build(list(CATALOGUE.values()), parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
