"""The checks before a fit of force on motion: can it be a limb, and is it the model's?"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.conventions import perturbation_columns
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.told import check_departures
from armimpedance.hand.still.estimation import Options
from armimpedance.hand.still.plausible import check_limb
from armimpedance.numerics.signals import multiple_coherence

#: Motion that explains less of the force than this gives no M, B and K; trials that are asked.
LEAST_COHERENCE: Final = 0.3
MOST_COHERENT: Final = 5


def check_response(recording: Recording) -> tuple[Finding, ...]:
    """Units, reach, sign and axes; then delay, reflex, amplitude and lack of fit.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of Finding
        Empty where the perturbation is stochastic; without the second half where the first one
        says that no number would mean anything.

    Examples
    --------
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> from armimpedance.hand.still import check_response
    >>> [check.name for check in check_response(recording)][:4]
    ['units', 'reach', 'axes', 'delay']
    """
    limb = check_limb(recording)
    if not limb or any(finding.verdict == "unusable" for finding in limb):
        return limb
    return (*limb, *check_departures(recording))


def check_driven(recording: Recording) -> list[Finding]:
    """Whether force follows motion well enough for a fit of force on motion, over all frequencies.

    Only `estimate` fits so: `elbow` weighs by noise, and finds what was imposed.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    list of Finding
        Empty where the perturbation is not stochastic.
    """
    if recording.perturbation != "stochastic":
        return []
    found = []
    told = recording.imposed in ("force", "torque")
    if told or any(name in recording.extra for name in perturbation_columns(recording.axes)):
        text = (
            "the device imposes the force: noise of the motion makes M, B and K too small here; "
            "`random` takes a hand and `elbow` a joint that is moved so"
        )
        found.append(Finding("imposed", "warning", text))
    low, high = Options().band_hz
    shared = []
    for row in range(min(recording.n_trials, MOST_COHERENT)):
        at = recording.samples_of(row)
        try:
            coherence = multiple_coherence(
                recording.position[at], recording.force[at], recording.sample_rate_hz
            )
            shared.append(coherence.mean(low, high))
        except ArmImpedanceError:
            continue
    if not shared:
        return found
    text = f"motion explains {100 * np.mean(shared):.0f} % of the force from {low:g} to {high:g} Hz"
    if np.mean(shared) >= LEAST_COHERENCE:
        return [*found, Finding("coherence", "ok", text, smallest=f"{100 * LEAST_COHERENCE:g} %")]
    hint = "nothing that a fit could use moved the limb there; of a joint `elbow` may tell more"
    return [*found, Finding("coherence", "unusable", f"{text}: {hint}")]
