"""Method `likelihood`: maximum likelihood with force and motion both noisy.

The motion of every trial is unknown; measured are motion + n and force + e, both Gaussian.
Maximised over the unknown motion, the likelihood of theta = (M, B, K) is

    -2 log L = sum_t r_t^T Sigma(theta)^-1 r_t,   Sigma = Sigma_e + A Sigma_n A^T,

r_t the equation's residual and A = M d2/dt2 + B d/dt + K (the functional errors-in-variables
model; R. Pintelon & J. Schoukens, *System Identification: A Frequency Domain Approach* (Wiley),
chapter on maximum likelihood). Its gradient vanishes where

    sum_t W(x^_t)^T V r_t = 0,   x^_t = x_t + Sigma_n A^T V r_t,   V = Sigma^-1,

x^ being the most likely motion: instruments that depend on theta. Starting from `weighted`, a few
rounds of linear equations find the maximum. Sigma_n is the scatter of the trials' motions about
the course they share. With a robot much stiffer than the limb it is sensor noise.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.methods import exact, weighted
from armimpedance.hand.still.modal import ModalEquation, expected_motion, weighted_equations
from armimpedance.hand.still.prepared import NO_LINEAR_LIMB, Method, Prepared
from armimpedance.hand.still.result import require_identifiable
from armimpedance.hand.still.weighing import (
    FEWEST_TRIALS,
    WeightedFit,
    refit_noise,
    through_impedance,
    weighted_fit,
)
from armimpedance.numerics.regression import TrialEquations, solve_total

#: Rounds of noise and parameters; further ones change the result by less than a hundredth of a
#: standard error.
ROUNDS = 5
NOISE_STEPS = 6


def prepare(window: Window, kind: Kind) -> Prepared:
    """Equations of one group at the maximum; with very few trials, those of `exact`."""
    if int(window.usable.sum()) < FEWEST_TRIALS:
        return weighted.prepare(window, kind)
    plain = exact.prepare(window, kind)
    require_identifiable(plain.factors)
    start = weighted_fit(window, kind)
    position = motion_scatter(start.equation)
    if position is None:
        position = start.noise.position
        note = "position noise as the sensor's alone: the trials share no course"
    else:
        note = "position noise from the scatter of motions about their shared course"
    return Prepared(plain.factors, maximise(start, position, kind), notes=(note,))


def maximise(start: WeightedFit, position: FloatArray, kind: Kind) -> TrialEquations:
    """Equations whose solution maximises the likelihood for position noise (d, 3 n, 3 n)."""
    equation, noise, parameters = start.equation, start.noise, start.parameters
    for _ in range(ROUNDS):
        noise = refit_noise(noise, equation, parameters, NOISE_STEPS)
        equations = score_equations(equation, noise.force, position, parameters, kind)
        parameters = solve_total(equations)
    return equations


def score_equations(
    equation: ModalEquation,
    force: FloatArray,
    position: FloatArray,
    parameters: FloatArray,
    kind: Kind,
) -> TrialEquations:
    """``A_t = W(x^_t)^T V W_t``, ``b_t = W(x^_t)^T V y_t`` with x^ and V at these parameters."""
    V = np.linalg.inv(force + through_impedance(parameters, position))
    V = (V + V.T) / 2
    likely = _likely_motion(equation, V, position, parameters)
    return weighted_equations(equation, V, kind, instruments=likely)


def motion_scatter(equation: ModalEquation) -> FloatArray | None:
    """Covariance (d, 3 n, 3 n) of the motions about those expected from the other trials."""
    expected = expected_motion(equation)
    if expected is None:
        return None
    T, d, n = equation.trials, equation.axes, equation.modes.count
    apart = (equation.regressors - expected).reshape(T, 3, d, n)
    per_axis = apart.transpose(2, 0, 1, 3).reshape(d, T, 3 * n)
    return np.asarray(per_axis.transpose(0, 2, 1) @ per_axis / T)


def _likely_motion(
    equation: ModalEquation, V: FloatArray, position: FloatArray, parameters: FloatArray
) -> FloatArray:
    """``x^_t = x_t + Sigma_n A^T V r_t`` as x'', x', x in modes, (T, 3 d, n)."""
    T, d, n = equation.trials, equation.axes, equation.modes.count
    u = (equation.residual(parameters) @ V).reshape(T, d, n)
    theta = parameters.reshape(3, d, d)
    # A^T V r: [t, c, b, m] = sum_j theta[b, j, c] u[t, j, m]
    back = np.tensordot(u, theta, axes=(1, 1)).transpose(0, 3, 2, 1).reshape(T, d, 3 * n)
    # Sigma_n,c (3 n, 3 n) of each axis
    moved = (back.transpose(1, 0, 2) @ position).reshape(d, T, 3, n)
    return equation.regressors + moved.transpose(1, 2, 0, 3).reshape(T, 3 * d, n)


METHOD = Method(
    assumes="motions of a group differ only by the position sensor's noise: a robot much stiffer "
    "than the limb is unsteady",
    reference="errors-in-variables likelihood, R. Pintelon & J. Schoukens, System Identification: "
    "A Frequency Domain Approach (Wiley)",
    prepare=prepare,
    differs=f"trials of a direction do not repeat the same motion, or {NO_LINEAR_LIMB}",
)
