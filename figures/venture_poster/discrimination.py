"""Venture (poster): patients told from controls by the stiffness of their shoulders."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.hand.comparison.show import plot_discrimination
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.venture_poster import shoulders as venture_shoulders
from armimpedance_figures.venture_poster.shoulders import Population, StudiedShoulders, study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEADER = (
    *("group", "person", "mass_kg", "height_m", "k_Nm_per_rad", "sd_robust", "ci95_low"),
    *("ci95_high", "simulated_truth", "rows"),
)


def draw(studied: StudiedShoulders) -> Figure:
    """Everybody with an interval, the groups' means, the threshold."""
    figure = new_figure(TWO_COLUMNS_IN, 2.8)
    with print_style():
        ax = figure.add_subplot()
    plot_discrimination(studied.result, ax, label="stiffness of shoulder flexion\nk (N m/rad)")
    return figure


def table(studied: StudiedShoulders) -> list[list[str]]:
    """One row a person."""
    rows = [list(HEADER)]
    for person in studied.people:
        k = person.k
        values = [person.mass_kg, person.height_m, k.value, k.sd_robust, *k.ci95, person.true_k]
        rows.append([person.group, person.person, *map(number, values), str(person.n)])
    return rows


def caption(studied: StudiedShoulders) -> str:
    """Who was simulated, how well they are told apart, what differs."""
    result = studied.result
    errors = np.array([p.k.value / p.true_k - 1 for p in studied.people])
    inside = sum(p.inside for p in studied.people)
    low, high = result.effect_ci95
    return (
        "After Venture (poster), 'Patients discrimination according to estimated shoulders "
        "stiffness': passive stiffness in flexion of the right shoulder, ± 1.96 robust standard "
        "errors; people of a group in the order of their stiffness; groups' means (bars), the "
        f"threshold midway (dashed). Effect size (Hedges' g) {result.effect:.1f} ({low:.1f} to "
        f"{high:.1f}), Mann-Whitney p = {result.p:.2g}; the right group by a threshold that is "
        f"made without the person. Simulated: {_words(venture_shoulders.CONTROLS)} and "
        f"{_words(venture_shoulders.PATIENTS)}, at equal steps of probability of a normal "
        "distribution: numbers chosen for this figure, no finding about people; groups of this "
        "size drawn at random would scatter as widely as the intervals say. Everyone has a body of "
        "another size; the arm hangs relaxed from a trunk that is shaken (P5, "
        f"{venture_shoulders.SECONDS:g} s at 30 frames/s); 8 markers with 0.5 mm of noise that "
        f"slide by {1e3 * venture_shoulders.SOFT_TISSUE_M:g} mm on the skin; method "
        f"'{venture_shoulders.METHOD}'; inertia and rest angle of each person taken as known. k "
        f"errs by {100 * np.sqrt((errors**2).mean()):.1f} % (rms), far less than people differ; "
        f"{inside} of {len(errors)} of the fits' 95 % intervals hold the truth. "
        "Unknown inertia or rest angle would add to the spread. Differs "
        "from the source: simulated; units, axes and the number of people cannot be read in the "
        "poster."
    )


def _words(group: Population) -> str:
    return f"{group.people} {group.name} with k of {group.mean:g} ± {group.sd:g} N m/rad (sd)"


FIGURE = SourceFigure(
    "venture_poster_discrimination", ("shoulders",), "", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
