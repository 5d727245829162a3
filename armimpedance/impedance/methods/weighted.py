"""Method `weighted`: feasible generalised least squares, free of the position's noise.

Rows are modes of the window (`modal`); their covariance is estimated from the residuals of a first
fit (`noise`), so that tremor, slow force and drift weigh what they weigh in this very recording:

    sum_t Z_t^T V W_t theta = sum_t Z_t^T V y_t,   V = (Sigma_e + A Sigma_n A^T)^-1

Noise of the position in W on both sides would shrink the estimate as any noisy regressor does; in
Z stands the motion that the other trials lead to expect (`expected_motion`) instead. Where they do
not tell, the expectation of the noise is taken off the normal equations, see W. A. Fuller,
*Measurement Error Models* (Wiley, 1987), section 3.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.conventions import Kind
from armimpedance.impedance.bound import bound_of
from armimpedance.impedance.identifiable import require_identifiable
from armimpedance.impedance.methods import exact
from armimpedance.impedance.methods.expected_motion import expected_motion
from armimpedance.impedance.methods.modal import ModalEquation, modal_equation, weighted_equations
from armimpedance.impedance.methods.noise import (
    NoiseModel,
    refit_noise,
    regressor_excess,
    start_noise,
)
from armimpedance.impedance.prepared import Prepared
from armimpedance.records import Window
from armimpedance.regression import TrialEquations, solve_total
from armimpedance.signals import Modes

NAME = "weighted"
#: Fits of the noise model, and their steps: the second starts where the first ended.
NOISE_STEPS = (16, 8)
#: With fewer trials the noise cannot be told from the fit.
FEWEST_TRIALS = 4


@dataclass(frozen=True, eq=False)
class WeightedFit:
    """Equations, noise and solution of one group.

    Attributes
    ----------
    equation : ModalEquation
    noise : NoiseModel
    equations : TrialEquations
        Compensated for the position's noise.
    parameters : (3 d^2,)
        M (with handle), B, K row by row.
    """

    equation: ModalEquation
    noise: NoiseModel
    equations: TrialEquations
    parameters: FloatArray


def prepare(window: Window, kind: Kind) -> Prepared:
    """Equations of one group of trials; with very few trials, those of `exact`."""
    plain = exact.prepare(window, kind)
    require_identifiable(plain.factors)
    trials = int(window.usable.sum())
    if trials < FEWEST_TRIALS:
        note = f"{trials} trials are too few to weigh: unweighted, as method exact"
        return Prepared(plain.factors, notes=(*plain.notes, note))
    found = weighted_fit(window, kind)
    note = f"weighted by the noise of {trials} trials in {found.equation.modes.count} modes"
    return Prepared(plain.factors, found.equations, notes=(note,), bound=bound_of(found.equations))


def weighted_fit(
    window: Window, kind: Kind, *, delay_s: float | None = None, modes: Modes | None = None
) -> WeightedFit:
    """Alternate between noise and parameters, starting from unweighted rows.

    Parameters
    ----------
    window : Window
    kind : {"hand", "joint"}
    delay_s : float, optional
        Fits the answer R to the displacement of that much earlier too.
    modes : Modes, optional
        Default: `spline_modes` of the window.

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine the parameters.
    """
    equation = modal_equation(window, modes, delay_s=delay_s)
    noise = start_noise(window, equation)
    equations = weighted_equations(equation, _without_drift(equation), kind)
    parameters = solve_total(equations)
    instruments, uncertainty = expected_motion(equation), None
    for steps in NOISE_STEPS:
        noise = refit_noise(noise, equation, parameters, steps, uncertainty)
        V = np.linalg.inv(noise.covariance(parameters))
        equations = compensated_equations(equation, noise, (V + V.T) / 2, instruments, kind)
        parameters, uncertainty = solve_total(equations), bound_of(equations)
    return WeightedFit(equation, noise, equations, parameters)


def compensated_equations(
    equation: ModalEquation,
    noise: NoiseModel,
    V: FloatArray,
    instruments: FloatArray | None,
    kind: Kind,
) -> TrialEquations:
    """``A_t = Z_t^T V W_t``, ``b_t = Z_t^T V y_t``.

    Z (T, r d, n) is the motion expected from the other trials; where they do not tell, W itself,
    and the excess of its noise is taken off: ``A_t = W_t^T V W_t - E[N^T V N]``.
    """
    if instruments is not None:
        return weighted_equations(equation, V, kind, instruments=instruments)
    # a delayed displacement is taken as free of noise: its share is far below that of x''
    size = equation.matrices * equation.axes**2
    excess = np.zeros((size, size))
    noisy = regressor_excess(V, noise.position.covariance)
    excess[: len(noisy), : len(noisy)] = noisy
    return weighted_equations(equation, V, kind, excess=excess)


def _without_drift(equation: ModalEquation) -> FloatArray:
    """Weight (d n, d n) that is blind to an offset and a ramp of each axis."""
    smooth = equation.modes.smooth
    drift = smooth @ np.column_stack([np.ones_like(equation.lag_s), equation.lag_s])
    Q = np.linalg.qr(drift)[0]
    return np.kron(np.eye(equation.axes), np.eye(len(smooth)) - Q @ Q.T)
