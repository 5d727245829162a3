"""Feasible generalised least squares in modes: noise and parameters found in turn.

Rows are modes of the window (`modal`); their covariance is estimated from the residuals of a first
fit (`noise`), so that tremor, slow force and drift weigh what they weigh in this very recording.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, frozen
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.bound import bound_of
from armimpedance.hand.still.weighing.expected_motion import expected_motion
from armimpedance.hand.still.weighing.modal import ModalEquation, modal_equation, weighted_equations
from armimpedance.hand.still.weighing.noise import (
    NoiseModel,
    refit_noise,
    regressor_excess,
    start_noise,
)
from armimpedance.numerics.regression import TrialEquations, solve_total
from armimpedance.numerics.signals import Modes

#: Fits of the noise model, and their steps: the second starts where the first ended.
NOISE_STEPS: Final = (8, 4)
#: With fewer trials the noise cannot be told from the fit.
FEWEST_TRIALS: Final = 4


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

    Returns
    -------
    WeightedFit
        The equation in modes, the noise that was found, the trials' equations and the parameters.

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine the parameters.
    """
    equation = modal_equation(window, modes, delay_s=delay_s)
    noise = start_noise(window, equation)
    blind = _without_drift(equation.modes, equation.axes)
    equations = weighted_equations(equation, blind, kind)
    parameters = solve_total(equations)
    instruments, uncertainty = expected_motion(equation), None
    for steps in NOISE_STEPS:
        carried = noise.carried(parameters)
        noise = refit_noise(noise, equation, parameters, steps, uncertainty, carried)
        V = np.linalg.inv(noise.force + carried)
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
    noisy = regressor_excess(V, noise.position)
    excess[: len(noisy), : len(noisy)] = noisy
    return weighted_equations(equation, V, kind, excess=excess)


@lru_cache(maxsize=4)
def _without_drift(modes: Modes, axes: int) -> FloatArray:
    """Weight (d n, d n) that is blind to an offset and a ramp of each axis."""
    smooth = modes.smooth
    ramp = np.linspace(-1.0, 1.0, smooth.shape[1])
    Q = np.linalg.qr(smooth @ np.column_stack([np.ones_like(ramp), ramp]))[0]
    return frozen(np.kron(np.eye(axes), np.eye(len(smooth)) - Q @ Q.T))
