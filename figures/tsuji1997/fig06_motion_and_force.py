"""Tsuji (1997), Fig. 6: motion and force of one disturbance, and the force predicted from it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.plots import plot_response
from armimpedance.signals import choose_span, cut_windows, ramp_basis, respond
from armimpedance_figures.source_figure import SourceFigure, design, script
from armimpedance_figures.tsuji1997.study import StudiedExperiment

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONDITION = "cocontraction_10"


def draw(studied: StudiedExperiment) -> Figure:
    """The first trial of the condition that moves along both axes."""
    recording, found = studied.recording, studied.of(CONDITION)
    rows = np.flatnonzero(recording.trials["condition"] == CONDITION)
    window = cut_windows(recording, rows)
    # More rows than a fit needs: smooth curves.
    moved = respond(window, choose_span(window, rows_per_kernel=80), keep_drift=True)
    with_handle = np.asarray(found.inertia_with_handle)
    displacement = moved.displacement - moved.displacement[:, :1]
    # f = -(M x'' + B x' + K x), the handle's mass included as in the measurement: (T, S, 2)
    predicted = -(
        moved.acceleration @ with_handle.T
        + moved.velocity @ found.viscosity.T
        + displacement @ found.stiffness.T
    )
    shown = replace(
        moved,
        displacement=displacement,
        force=predicted + without_ramp(moved.force - predicted, moved.lag_s),
    )
    oblique = (recording.trials["direction_deg"].to_numpy()[rows] % 90 == 45).argmax()
    axes = plot_response(shown, predicted, trial_index=int(oblique))
    figure: Figure = axes[0, 0].figure
    return figure


def without_ramp(signal: FloatArray, lag_s: FloatArray) -> FloatArray:
    """A signal (T, S, 2) less its least-squares offset and ramp: what the limb did on its own."""
    basis = ramp_basis(lag_s)
    return signal - basis @ (basis.T @ signal)


def caption(studied: StudiedExperiment) -> str:
    """What is shown and what differs."""
    found = studied.of(CONDITION)
    return (
        "After Tsuji (1997), Fig. 6: displacement, velocity, acceleration and force by the hand "
        "(solid) with the force predicted from the estimated M, B and K (dashed), co-contraction "
        f"at 10 % MVC. Multiple correlation over all trials of the condition "
        f"{found.quality.multiple_correlation:.3f} (source's example: 0.979). {design(studied)}. "
        "Differs from the source: simulated; motion and force smoothed by one kernel; drift "
        "removed from both sides of the equation, where the source corrects the force alone."
    )


FIGURE = SourceFigure("tsuji1997_fig06_motion_and_force", ("cocontraction",), "B", draw, caption)

if __name__ == "__main__":
    script(FIGURE)
