"""Venture (poster): contact wrench of motions that were not fitted, and its prediction."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.hand.show import one_legend
from armimpedance.joint.body import each_trial
from armimpedance.joint.body.show import plot_row, row_labels
from armimpedance.show.plots import TWO_COLUMNS_IN, new_figure, print_style
from armimpedance_figures.source_figure import SourceFigure, script
from armimpedance_figures.table_cells import number
from armimpedance_figures.venture_poster.study import StudiedBody, design, study

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: The poster's three; the first is what it calls a left-fronted squat.
MOTIONS: Final = {
    "front_squat": "left-fronted squat",
    "bending": "bending",
    "side_walk": "side walk",
}
HEADER: Final = ("motion", "parameters", "component", "unit", "rms", "r2_about_mean", "r2_about_0")
_ROW_IN: Final = 1.05


def shown(studied: StudiedBody) -> tuple[str, ...]:
    """Those of the poster's motions that were not fitted."""
    held_out = [studied.equations.motions[t] for t in studied.weighted.choice.rest]
    return tuple(motion for motion in MOTIONS if motion in held_out)


def draw(studied: StudiedBody) -> Figure:
    """A column per motion; forces above, moments below."""
    from matplotlib.ticker import MultipleLocator

    motions, labels = shown(studied), row_labels(studied.rows, studied.recording.skeleton)
    trials = {t.condition: t for t in each_trial(studied.recording, studied.rows)}
    phi, rate = studied.weighted.predicting_phi, studied.recording.sample_rate_hz
    r2 = studied.agreement(phi, motions).r2
    figure = new_figure(TWO_COLUMNS_IN, _ROW_IN * len(labels))
    with print_style():
        axes = figure.subplots(len(labels), len(motions), sharex="col", squeeze=False)
        for m, motion in enumerate(motions):
            for row, label in enumerate(labels):
                ax = axes[row, m]
                ax.xaxis.set_major_locator(MultipleLocator(5))
                predicted = trials[motion].W[:, row] @ phi
                plot_row(trials[motion].w[:, row], predicted, label, rate, ax)
                _judge(ax, r2[m, row])
                if row + 1 < len(labels):
                    ax.set_xlabel("")
                if m:
                    ax.set_ylabel("")
            axes[0, m].set_title(MOTIONS[motion], loc="left")
        figure.align_ylabels(axes[:, 0])
        one_legend(figure, list(axes.ravel()), columns=2)
    return figure


def _judge(ax: Axes, r2: float) -> None:
    """R^2 above the curves, where there is room made for it."""
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + 0.28 * (high - low))
    ax.text(0.99, 0.98, f"R² {r2:.2f}", transform=ax.transAxes, ha="right", va="top", fontsize=7.5)


def table(studied: StudiedBody) -> list[list[str]]:
    """One row per motion, parameters and component of the wrench."""
    rows = [list(HEADER)]
    motions = shown(studied)
    for name, phi in parameters(studied).items():
        judged = studied.agreement(phi, motions)
        about_zero = _about_zero(studied, phi, motions)
        for m, motion in enumerate(motions):
            for r, component in enumerate(judged.rows):
                values = [judged.rms[m, r], judged.r2[m, r], about_zero[m, r]]
                unit = judged.row_units[r]
                rows.append([motion, name, component, unit, *map(number, values)])
    return rows


def parameters(studied: StudiedBody) -> dict[str, np.ndarray]:
    """What predicts: two estimates, and the truth, whose residual is the noise of the angles."""
    return {
        "weighted least squares": studied.weighted.predicting_phi,
        "with a prior": studied.prior.predicting_phi,
        "simulated truth": studied.true_phi,
    }


def _about_zero(studied: StudiedBody, phi: np.ndarray, motions: tuple[str, ...]) -> np.ndarray:
    """``1 - sum (w - W phi)^2 / sum w^2`` (T, R)."""
    equations = studied.equations.subset([studied.equations.motions.index(m) for m in motions])
    left, varying = equations.squares(phi)
    return np.asarray(1 - left / (varying + equations.samples[:, None] * equations.mean**2))


def _weight_alone(studied: StudiedBody, motions: tuple[str, ...]) -> float:
    """R^2 about zero of the vertical force if its mean were all that is predicted; the lowest."""
    equations = studied.equations.subset([studied.equations.motions.index(m) for m in motions])
    _, varying = equations.squares(studied.true_phi)
    steady = equations.samples * equations.mean[:, 2] ** 2
    return float((steady / (steady + varying[:, 2])).min())


def caption(studied: StudiedBody) -> str:
    """What is shown, how it was smoothed, what is worth what."""
    motions, chosen = shown(studied), studied.weighted.choice
    moments = {
        name: studied.agreement(phi, motions).pooled_rms(studied.weighted.fitted.moments)
        for name, phi in parameters(studied).items()
    }
    ours, prior, true = moments.values()
    errors = [studied.median_error_percent(fit) for fit in (studied.weighted, studied.prior)]
    return (
        "After Venture (poster), cross-validation with a left-fronted squat, a bending and a side "
        "walk motion: contact wrench on the pelvis, in its axes (x forward, z up), measured and "
        "predicted from the motion by the base parameters. Identified by weighted least squares "
        f"from the greedily chosen motions {' and '.join(_words(m) for m in chosen.motions)} "
        f"(condition {chosen.conditions[-1]:.0f}), the bias from noise of the angles taken off; "
        "none of the motions shown was fitted. R² is "
        "about each component's mean in that motion. Judge by the moments: about zero, the "
        f"vertical force's R² is {_weight_alone(studied, motions):.3f} or more for free, by its "
        "mean, the weight, alone. "
        f"Both sides of the equation are low-passed alike at {studied.rows.cutoff_hz:g} Hz, zero "
        "phase: what is left over is noise of the twice differentiated angles, which at the usual "
        "6 Hz would leave four times as much. Moments' rms over these motions: "
        f"{ours:.2f} N m; {prior:.2f} N m with a prior of 30 % on every segment; {true:.2f} N m "
        "with the true parameters, whose rest is the noise. A good prediction does not say that "
        f"the parameters are right: their median error is {errors[0]:.0f} %, with the prior "
        f"{errors[1]:.0f} %. {design(studied)}. Differs from the source: simulated; the poster "
        "films markers, and gives neither filter nor scale."
    )


def _words(motion: str) -> str:
    return f"'{motion.replace('_', ' ')}'"


FIGURE = SourceFigure(
    "venture_poster_cross_validation", ("body",), "A", draw, caption, table=table, study=study
)

if __name__ == "__main__":
    script(FIGURE)
