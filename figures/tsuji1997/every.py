"""Every figure of the hand's experiments, those of one fit together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from armimpedance.core.errors import ArmImpedanceError
from armimpedance_figures.source_figure import FORMATS, SourceFigure, write_given
from armimpedance_figures.tsuji1997 import (
    fig06_motion_and_force,
    fig07_ellipses_over_workspace,
    fig08_cocontraction,
    fig09_hand_force,
    fig10_stiffness_over_posture,
    fig11_viscosity_over_posture,
    fig12_fig13_predicted_against_measured,
    fig14_single_joint_activation,
    table1_posture_fits,
    table2_activation_fits,
    where_models_extrapolate,
)
from armimpedance_figures.tsuji1997.study import StudiedExperiment

FIGURES = tuple(
    module.FIGURE
    for module in (
        fig06_motion_and_force,
        fig07_ellipses_over_workspace,
        fig08_cocontraction,
        fig09_hand_force,
        table1_posture_fits,
        fig10_stiffness_over_posture,
        fig11_viscosity_over_posture,
        table2_activation_fits,
        fig12_fig13_predicted_against_measured,
        fig14_single_joint_activation,
        where_models_extrapolate,
    )
)
#: Experiments whose samples are drawn, not only the estimates from them.
DRAWN_FROM_SAMPLES = frozenset(name for f in FIGURES if f.samples for name in f.experiments)


@dataclass(frozen=True)
class Drawn:
    """Files written, and one sentence for each figure that could not be drawn."""

    paths: tuple[Path, ...]
    left_out: tuple[str, ...]


Studied = Mapping[str, StudiedExperiment]


def in_groups(studied: Studied) -> list[tuple[tuple[str, ...], Studied]]:
    """Names of the figures that these experiments suffice for, those of one fit together.

    Each group has what it is drawn from beside it, with samples only where samples are drawn: it
    may go to another process. The groups with the most work come first.
    """
    groups: dict[object, list[SourceFigure]] = {}
    for figure in FIGURES:
        if set(figure.experiments) <= set(studied):
            same = figure.name if figure.fit is None else (figure.fit, figure.experiments)
            groups.setdefault(same, []).append(figure)
    most_first = sorted(groups.values(), key=lambda group: (-len(group), group[0].fit is None))
    return [(tuple(f.name for f in group), _needed(group[0], studied)) for group in most_first]


def _needed(figure: SourceFigure, studied: Studied) -> Studied:
    needed = {name: studied[name] for name in figure.experiments}
    return {n: one if figure.samples else one.without_samples() for n, one in needed.items()}


def draw_group(
    names: Sequence[str],
    studied: Studied,
    out: Path,
    formats: Sequence[str] = FORMATS,
) -> Drawn:
    """Draw one of `in_groups`.

    A part of the conditions may not be enough for a figure's model: it is left out, and said so.
    """
    figures = [figure for figure in FIGURES if figure.name in names]
    paths: list[Path] = []
    left_out: list[str] = []
    given = None
    for figure in figures:
        try:
            if given is None:
                given = figure.given([studied[name] for name in figure.experiments])
            paths += write_given(figure, given, out, formats)
        except ArmImpedanceError as error:
            left_out.append(f"{figure.name} left out: {error}")
    return Drawn(tuple(paths), tuple(left_out))
