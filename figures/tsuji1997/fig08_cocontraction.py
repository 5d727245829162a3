"""Tsuji (1997), Fig. 8: ellipses at three levels of co-contraction."""

from __future__ import annotations

from typing import TYPE_CHECKING

from armimpedance.hand.ellipses import Which
from armimpedance.hand.show import one_legend, plot_ellipses_over_levels
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.source_figure import POOLED, SourceFigure, design, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEVELS_PERCENT = (0, 10, 20)
PANELS: tuple[tuple[str, Which], ...] = (
    ("(a) stiffness", "stiffness"),
    ("(b) viscosity", "viscosity"),
    ("(c) inertia", "inertia"),
)


def draw(studied: StudiedExperiment) -> Figure:
    """Three panels; levels by line style, the two-link model's inertia dotted."""
    found = [studied.of(f"cocontraction_{level:02d}") for level in LEVELS_PERCENT]
    labels = [f"{level} % MVC" for level in LEVELS_PERCENT]
    with print_style():
        figure = new_figure(TWO_COLUMNS_IN, 2.9)
        axes = figure.subplots(1, 3)
        for ax, (title, which) in zip(axes, PANELS, strict=True):
            model = studied.model_inertia(found[0]) if which == "inertia" else None
            plot_ellipses_over_levels(
                found,
                which,
                labels,
                ax,
                model,
                "two-link model",
                True,  # type: ignore[arg-type]
            )
            ax.set_title(title)
        one_legend(figure, axes)
    return figure


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    return (
        "After Tsuji (1997), Fig. 8: hand stiffness (a), viscosity (b) and inertia (c) in the "
        "nominal posture at mean activations of the two-joint muscles of 0, 10 and 20 % MVC "
        "(solid, dashed, alternate dashes), shaded 95 % band; dotted in (c): inertia of a two-link "
        "arm from Winter's table, eq. (17), as the simulated limb has it. "
        f"{design(studied)}. {POOLED}"
    )


FIGURE = SourceFigure("tsuji1997_fig08_cocontraction", ("cocontraction",), "C", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
