"""Build every figure of the catalogue."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from armimpedance.errors import InputError
from armimpedance_figures import (
    tsuji1997_fig06_motion_and_force,
    tsuji1997_fig07_ellipses_over_workspace,
    tsuji1997_fig08_cocontraction,
    tsuji1997_fig09_hand_force,
)
from armimpedance_figures.experiment import StudiedExperiment, study
from armimpedance_figures.source_figure import SEED, SETS, SourceFigure, write

CATALOGUE = {
    module.FIGURE.name: module.FIGURE
    for module in (
        tsuji1997_fig06_motion_and_force,
        tsuji1997_fig07_ellipses_over_workspace,
        tsuji1997_fig08_cocontraction,
        tsuji1997_fig09_hand_force,
    )
}


def chosen(names: Sequence[str]) -> list[SourceFigure]:
    """The figures whose names contain one of these; all, if there are none.

    Raises
    ------
    InputError
        If a name matches no figure.
    """
    for name in names:
        if not any(name in known for known in CATALOGUE):
            raise InputError(f"no figure {name!r}", expected=f"one of {', '.join(CATALOGUE)}")
    return [f for f in CATALOGUE.values() if not names or any(n in f.name for n in names)]


def build(
    figures: Sequence[SourceFigure],
    out: Path,
    *,
    seed: int = SEED,
    sets: int = SETS,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[Path]:
    """Simulate and analyse what the figures need, each once, and write them; yields the files."""
    out.mkdir(parents=True, exist_ok=True)
    studied: dict[tuple[str, str], StudiedExperiment] = {}
    for done, figure in enumerate(figures):
        if progress is not None:
            progress(done, len(figures))
        key = (figure.experiment, figure.subject)
        if key not in studied:
            studied[key] = study(key[0], subject=key[1], seed=seed, sets=sets)
        yield from write(figure, studied[key], out)


def draw_from(studied: Mapping[str, StudiedExperiment], out: Path) -> list[Path]:
    """Every figure of the catalogue from experiments that were studied already, by name."""
    return [path for f in CATALOGUE.values() for path in write(f, studied[f.experiment], out)]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Build all figures from simulated subjects.")
    parser.add_argument("--out", type=Path, default=Path("out/figures"))
    for path in build(list(CATALOGUE.values()), parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
