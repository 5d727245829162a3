"""Tsuji (1997), Fig. 6: motion and force of one disturbance, and the force predicted from it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from armimpedance.plots.responses import plot_response
from armimpedance.signals.response import respond
from armimpedance.signals.windows import cut_windows
from armimpedance_figures.experiment import StudiedExperiment
from armimpedance_figures.source_figure import SourceFigure, design, script

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONDITION = "cocontraction_10"


def draw(studied: StudiedExperiment) -> Figure:
    """The first trial of the condition that moves along both axes."""
    recording, found = studied.recording, studied.of(CONDITION)
    rows = np.flatnonzero(recording.trials["condition"] == CONDITION)
    response = respond(cut_windows(recording, rows))
    with_handle = np.asarray(found.inertia_with_handle)
    # f = -(M x'' + B x' + K x), the handle's mass included as in the measurement: (S, 2)
    predicted = -(
        response.acceleration @ with_handle.T
        + response.velocity @ found.viscosity.T
        + response.displacement @ found.stiffness.T
    )
    oblique = (recording.trials["direction_deg"].to_numpy()[rows] % 90 == 45).argmax()
    axes = plot_response(response, predicted, trial_index=int(oblique))
    figure: Figure = axes[0, 0].figure
    return figure


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    found = studied.of(CONDITION)
    return (
        "After Tsuji (1997), Fig. 6: displacement, velocity, acceleration and force by the hand "
        "(solid) with the force predicted from the estimated M, B and K (dashed), co-contraction "
        f"at 10 % MVC. Multiple correlation over all trials of the condition "
        f"{found.quality.multiple_correlation:.3f} (source's example: 0.979). {design(studied)}. "
        "Differs from the source: simulated; both sides smoothed by one kernel and freed of an "
        "offset and a ramp, where the source corrects the force alone, so that curves swing about "
        "zero."
    )


FIGURE = SourceFigure("tsuji1997_fig06_motion_and_force", "cocontraction", "B", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
