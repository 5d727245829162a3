"""Build every figure of the catalogue."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armimpedance.errors import ArmImpedanceError, InputError
from armimpedance.impedance import in_order
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
from armimpedance_figures.source_figure import FORMATS, SEED, SETS, SourceFigure, write
from armimpedance_figures.tsuji1997 import (
    fig06_motion_and_force as tsuji1997_fig06_motion_and_force,
    fig07_ellipses_over_workspace as tsuji1997_fig07_ellipses_over_workspace,
    fig08_cocontraction as tsuji1997_fig08_cocontraction,
    fig09_hand_force as tsuji1997_fig09_hand_force,
    fig10_stiffness_over_posture as tsuji1997_fig10_stiffness_over_posture,
    fig11_viscosity_over_posture as tsuji1997_fig11_viscosity_over_posture,
    fig12_fig13_predicted_against_measured as tsuji1997_fig12_fig13_predicted_against_measured,
    fig14_single_joint_activation as tsuji1997_fig14_single_joint_activation,
    table1_posture_fits as tsuji1997_table1_posture_fits,
    table2_activation_fits as tsuji1997_table2_activation_fits,
    where_models_extrapolate,
)
from armimpedance_figures.tsuji1997.study import StudiedExperiment
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

CATALOGUE = {
    module.FIGURE.name: module.FIGURE
    for module in (
        tsuji1997_fig06_motion_and_force,
        tsuji1997_fig07_ellipses_over_workspace,
        tsuji1997_fig08_cocontraction,
        tsuji1997_fig09_hand_force,
        tsuji1997_table1_posture_fits,
        tsuji1997_fig10_stiffness_over_posture,
        tsuji1997_fig11_viscosity_over_posture,
        tsuji1997_table2_activation_fits,
        tsuji1997_fig12_fig13_predicted_against_measured,
        tsuji1997_fig14_single_joint_activation,
        where_models_extrapolate,
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


@dataclass(frozen=True)
class Drawn:
    """Files written, and one sentence for each figure that could not be drawn."""

    paths: tuple[Path, ...]
    left_out: tuple[str, ...]


def draw_from(
    studied: Mapping[str, StudiedExperiment],
    out: Path,
    formats: Sequence[str] = FORMATS,
    workers: int = 1,
) -> Drawn:
    """Every figure of the hand's experiments from those that were studied already, by name.

    A part of the conditions may not be enough for a figure's model: it is left out, and said so.
    The files are the same, to the byte, whatever the number of workers.
    """
    pieces = (
        (figure.name, [studied[name] for name in figure.experiments], out, tuple(formats))
        for figure in CATALOGUE.values()
        if set(figure.experiments) <= set(studied)
    )
    drawn = list(in_order(_drawn, pieces, workers))
    paths = tuple(path for one in drawn for path in one.paths)
    return Drawn(paths, tuple(sentence for one in drawn for sentence in one.left_out))


def _drawn(
    name: str, studied: Sequence[StudiedExperiment], out: Path, formats: Sequence[str]
) -> Drawn:
    """One figure, or why there is none."""
    try:
        return Drawn(tuple(write(CATALOGUE[name], studied, out, formats)), ())
    except ArmImpedanceError as error:
        return Drawn((), (f"{name} left out: {error}",))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Build all figures from simulated subjects.")
    parser.add_argument("--out", type=Path, default=Path("out/figures"))
    for path in build(list(CATALOGUE.values()), parser.parse_args().out):
        print(path)


if __name__ == "__main__":
    main()
