"""The force of each trial as measured and as an estimate makes it of the motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import ImpedanceEstimate, Recording, Response
from armimpedance.hand.still.show.session.aligned import rows_of
from armimpedance.hand.still.stochastic import stochastic_response
from armimpedance.numerics.signals import choose_span, cut_windows, respond

#: Rows per smoothing kernel: a fit needs a sixth of it, the eye more.
ROWS_PER_KERNEL = 80


@dataclass(frozen=True)
class Fitted(FrozenRecord):
    """Usable trials of a group (blocks of a stochastic perturbation).

    Attributes
    ----------
    lag_s : (S,)
    measured, fitted : (T, S, d)
        Force by the limb, offset and ramp removed from both, N or N m.
    trial : (T,) int
    rate_hz : float
    kind : {"hand", "joint"}
    direction : (T,) int or None
        Trials of the same number saw the same disturbance.
    unit_name : str
        "trial", or "block" of a stochastic perturbation.
    """

    lag_s: Annotated[FloatArray, "S"]
    measured: Annotated[FloatArray, "T S d"]
    fitted: Annotated[FloatArray, "T S d"]
    trial: Annotated[IntArray, "T"]
    rate_hz: float
    kind: Kind
    direction: Annotated[IntArray, "T"] | None = None
    unit_name: str = "trial"

    @property
    def residual(self) -> FloatArray:
        """Measured less fitted, (T, S, d)."""
        return np.asarray(self.measured - self.fitted)

    @property
    def explained(self) -> FloatArray:
        """Part of each trial's force that the fit explains, (T,): 1 - residual² / measured²."""
        whole = (self.measured**2).sum(axis=(1, 2))
        left = (self.residual**2).sum(axis=(1, 2))
        return np.asarray(1 - left / np.where(whole > 0, whole, np.inf))


def fitted_force(recording: Recording, estimate: ImpedanceEstimate) -> Fitted:
    """Each trial's force and what M, B and K of the estimate make of its motion.

    Raises
    ------
    InputError
        No trial of the recording is of the estimate's group.
    """
    rows = rows_of(recording, estimate.keys)
    stochastic = recording.perturbation == "stochastic"
    direction = None
    if stochastic:
        response = stochastic_response(recording.select(rows))
    else:
        window = cut_windows(recording, rows)
        response = respond(window, choose_span(window, rows_per_kernel=ROWS_PER_KERNEL))
        direction = window.disturbance
    used = response.usable
    return Fitted(
        lag_s=response.lag_s,
        measured=response.force[used],
        fitted=predicted_force(response, estimate)[used],
        trial=response.trial[used] + (1 if stochastic else 0),
        rate_hz=response.sample_rate_hz,
        kind=recording.kind,
        direction=None if direction is None else direction[used],
        unit_name="block" if stochastic else "trial",
    )


def predicted_force(response: Response, estimate: ImpedanceEstimate) -> FloatArray:
    """Force by the limb that M (the handle's too), B and K make of the motion, (T, S, d)."""
    # f = -(M x'' + B x' + K x): (T, S, d) = (T, S, d) (d, d) three times
    return np.asarray(
        -(
            response.acceleration @ np.asarray(estimate.inertia_with_handle).T
            + response.velocity @ estimate.viscosity.T
            + response.displacement @ estimate.stiffness.T
        )
    )
