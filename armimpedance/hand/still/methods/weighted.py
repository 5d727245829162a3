"""Method `weighted`: feasible generalised least squares, free of the position's noise.

Rows are modes of the window (`weighing.modal`). Their covariance is estimated from the residuals of
a first fit (`weighing.noise`), so that tremor, slow force and drift are weighted as they occur in
this recording:

    sum_t Z_t^T V W_t theta = sum_t Z_t^T V y_t,   V = (Sigma_e + A Sigma_n A^T)^-1

Noise of the position in W on both sides would bias the estimate towards zero, as any noisy
regressor does. So Z is the motion expected from the other trials (`expected_motion`). If there is
no such expectation, the expected contribution of the noise is subtracted from the normal equations,
see W. A. Fuller, *Measurement Error Models* (Wiley, 1987), section 3.1.
"""

from __future__ import annotations

from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.bound import bound_of
from armimpedance.hand.still.methods import exact
from armimpedance.hand.still.prepared import Method, Prepared
from armimpedance.hand.still.result import require_identifiable
from armimpedance.hand.still.variance_components import is_silent
from armimpedance.hand.still.weighing import FEWEST_TRIALS, weighted_fit


def prepare(window: Window, kind: Kind) -> Prepared:
    """Equations of one group of trials; with very few trials or no noise, those of `exact`."""
    plain = exact.prepare(window, kind)
    require_identifiable(plain.factors)
    trials = int(window.usable.sum())
    if trials < FEWEST_TRIALS:
        note = f"{trials} trials are too few to weigh: unweighted, as method exact"
        return Prepared(plain.factors, notes=(*plain.notes, note))
    if is_silent(window):
        note = "no noise at rest to weigh by: unweighted, as method exact"
        return Prepared(plain.factors, notes=(*plain.notes, note))
    fit = weighted_fit(window, kind)
    note = f"weighted by the noise of {trials} trials in {fit.equation.modes.count} modes"
    return Prepared(plain.factors, fit.equations, notes=(note,), bound=bound_of(fit.equations))


METHOD = Method(
    assumes="noise is alike in all trials of a group; otherwise as exact",
    reference="feasible generalised least squares, compensated for the position's noise as in "
    "W. A. Fuller, Measurement Error Models (1987)",
    prepare=prepare,
)
