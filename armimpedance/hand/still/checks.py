"""The checks of a limb under returning disturbances: can it be one, and is it the model's?"""

from __future__ import annotations

from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.still.doubts.told import check_departures
from armimpedance.hand.still.plausible import check_limb


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
