"""Feasible generalised least squares in modes: noise and parameters estimated in turn.

Rows are modes of the window (`modal`). Their covariance is estimated from the residuals of a first
fit (`noise`), so that tremor, slow force and drift are weighted as they occur in this recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen, frozen_array
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.bound import bound_of
from armimpedance.hand.still.modal import (
    ModalEquation,
    expected_motion,
    modal_equation,
    weighted_equations,
)
from armimpedance.hand.still.variance_components import fit_components, total_covariance
from armimpedance.numerics.regression import TrialEquations, solve_total
from armimpedance.numerics.signals import Modes, position_noise

# Noise of a measurement, estimated from the measurement itself.
#
# Force: components of known shape over time (docs/explanation/estimators.md), their sizes from the
# residuals of the impedance equation, rest before and after the disturbance included. Position: the
# sensor's own noise (`numerics.signals.encoder`), which reaches the equation through M, B and K.

#: Frequencies at which tremor is modelled (Hz), and its standard deviation.
TREMOR_HZ = (5.5, 7.0, 8.5, 10.0, 11.5)
TREMOR_WIDTH_HZ = 0.5
#: Correlation time of slow voluntary force (s); still slower force is an offset and a ramp.
SLOW_S = 0.2
#: White force noise is at least this share of the force's rms: without noise there would be no
#: weights.
LEAST_WHITE = 1e-5
NAMES = ("offset", "ramp", "slow", "white", "motion", *(f"tremor {f:g} Hz" for f in TREMOR_HZ))
#: Offset, ramp and slow force have directions of their own, a ramp for example that of K.
_ISOTROPIC = np.array([False, False, False, False, False, *(True for _ in TREMOR_HZ)])


@dataclass(frozen=True, eq=False)
class NoiseModel(FrozenRecord):
    """Covariance of the noise in the rows of a `ModalEquation`.

    `shapes` (J, n, n): components of the force over modes, in the order of `NAMES`.
    `sizes` (J, d, d): covariance of the components over axes, N^2.
    `floor` (d n, d n): keeps the covariance regular where there is no noise.
    `position` (d, 3 n, 3 n): covariance, for each axis, of the position's noise in x'', x', x.
    `sensor_variance`: variance of single readings of the position, m^2 (rad^2).
    `sensor_step`: step of the grid on which the readings lie; 0 if there is no grid.
    """

    shapes: Annotated[FloatArray, "j n n"]
    sizes: Annotated[FloatArray, "j d d"]
    floor: FloatArray
    position: Annotated[FloatArray, "d m m"]
    sensor_variance: float
    sensor_step: float

    @property
    def force(self) -> FloatArray:
        """Covariance of the force's noise, (d n, d n)."""
        return total_covariance(self.sizes, self.shapes, self.floor)

    def covariance(self, parameters: FloatArray) -> FloatArray:
        """Covariance of ``e - A n`` (d n, d n): noise e of the force, n of the position.

        A is the operator ``M d2/dt2 + B d/dt + K`` with `parameters` row by row (3 d^2,). The share
        of a delayed term is far below K's and left out.
        """
        return self.force + self.carried(parameters)

    def carried(self, parameters: FloatArray) -> FloatArray:
        """Covariance (d n, d n) of the position's noise in the rows of the equation."""
        return through_impedance(parameters, self.position)


def through_impedance(parameters: FloatArray, position: FloatArray) -> FloatArray:
    """Covariance ``A Sigma_n A^T`` in the equation by position noise of covariance (d, 3 n, 3 n).

    Parameters
    ----------
    parameters : (3 d^2,) or longer
        M, B, K row by row; what follows them is not read.
    position : (d, 3 n, 3 n)
        Covariance, for each axis, of the position's noise in x'', x', x.

    Returns
    -------
    (d n, d n) array
        Covariance of the force, N^2 (joint: torque, N^2 m^2), that is equivalent to the position
        noise.
    """
    d, n = len(position), position.shape[1] // 3
    theta = parameters[: 3 * d * d].reshape(3, d, d)
    C = position.reshape(d, 3, n, 3, n)
    # [i, n, j, m] = sum_abc theta[a, i, c] theta[b, j, c] C_c[a, n, b, m]
    total = np.zeros((d, n, d, n))
    for c in range(d):
        half = np.tensordot(theta[:, :, c], C[c], axes=(0, 0))
        total += np.tensordot(half, theta[:, :, c], axes=(2, 0)).transpose(0, 1, 3, 2)
    return total.reshape(d * n, d * n)


def regressor_excess(weight: FloatArray, position: FloatArray) -> FloatArray:
    """Expectation of ``N^T V N`` (3 d^2, 3 d^2), N the position noise in W of one trial."""
    d, n = len(position), position.shape[1] // 3
    V = weight.reshape(d, n, d, n).transpose(0, 2, 1, 3).reshape(d * d, n * n)
    excess = np.zeros((3, d, d, 3, d, d))
    for c in range(d):
        C = position[c].reshape(3, n, 3, n).transpose(1, 3, 0, 2).reshape(n * n, 9)
        traces = (V @ C).reshape(d, d, 3, 3)
        excess[:, :, c, :, :, c] = traces.transpose(2, 0, 3, 1)
    return excess.reshape(3 * d * d, 3 * d * d)


@lru_cache(maxsize=32)
def component_shapes(modes: Modes, samples: int, sample_rate_hz: float) -> FloatArray:
    """Shapes of the components in modes (J, n, n), in the order of `NAMES`."""
    lag = np.arange(samples) / sample_rate_hz
    apart = lag[:, None] - lag
    ramp = modes.smooth @ (lag - lag.mean())
    kernels = [np.exp(-np.abs(apart) / SLOW_S)]
    width = np.exp(-0.5 * (2 * np.pi * TREMOR_WIDTH_HZ * apart) ** 2)
    tremor = [width * np.cos(2 * np.pi * f * apart) for f in TREMOR_HZ]
    slow, *tremor = (modes.smooth @ kernel @ modes.smooth.T for kernel in (*kernels, *tremor))
    offset = np.outer(modes.gaps, modes.gaps)
    # position noise in excess of the sensor's, through the inertia, in units of (10 Hz)^4
    motion = modes.second @ modes.second.T / (2 * np.pi * 10.0) ** 4
    shapes = [offset, np.outer(ramp, ramp), slow, np.eye(modes.count), motion, *tremor]
    stacked = np.stack(shapes)
    return frozen_array(stacked, "shapes", stacked.shape)


def force_covariance(
    sizes: FloatArray, floor: FloatArray, modes: Modes, samples: int, sample_rate_hz: float
) -> FloatArray:
    """Covariance (d n, d n) of the force's noise in modes, from the sizes of its components.

    Parameters
    ----------
    sizes : (J, d, d)
        Covariance over axes of each component, N^2, in the order of `NAMES`.
    floor : (d n, d n)
        Covariance that is added to that of the components, N^2.
    modes : Modes
        n of them.
    samples : int
        Length of the window.
    sample_rate_hz : float

    Returns
    -------
    (d n, d n) array
        Covariance of the force's coefficients in the modes, N^2.
    """
    return total_covariance(sizes, component_shapes(modes, samples, sample_rate_hz), floor)


def start_noise(window: Window, equation: ModalEquation) -> NoiseModel:
    """Noise model with the position's noise, but without the force's."""
    modes, d = equation.modes, equation.axes
    shapes = component_shapes(modes, len(equation.lag_s), window.sample_rate_hz)
    white = (LEAST_WHITE**2) * float((equation.force**2).mean())
    sensor = position_noise(window.position[window.usable], window.sample_rate_hz, modes)
    return NoiseModel(
        shapes=shapes,
        sizes=np.zeros((len(shapes), d, d)),
        floor=max(white, 1e-300) * np.eye(d * modes.count),
        position=sensor.covariance,
        sensor_variance=sensor.variance,
        sensor_step=sensor.step,
    )


def refit_noise(
    model: NoiseModel,
    equation: ModalEquation,
    parameters: FloatArray,
    steps: int,
    uncertainty: FloatArray | None = None,
    carried: FloatArray | None = None,
) -> NoiseModel:
    """Estimate the sizes of the components from the residuals at `parameters`.

    Starts from the sizes of the model, if it has any. `uncertainty`, the covariance of the
    parameters (r d^2, r d^2), corrects the residuals for the fit: with it the sizes are those of
    restricted maximum likelihood. Without it the noise of few trials would be underestimated.
    `carried` is the model's `carried` for these parameters, if the caller already has it.
    """
    residual = equation.residual(parameters)
    moment = residual.T @ residual / equation.trials
    if uncertainty is not None:
        moment = moment + _fitted_away(equation, uncertainty)
    sizes = fit_components(
        moment,
        model.shapes,
        model.floor + (model.carried(parameters) if carried is None else carried),
        isotropic=_ISOTROPIC,
        start=model.sizes if model.sizes.any() else None,
        steps=steps,
    )
    return replace(model, sizes=sizes)


def _fitted_away(equation: ModalEquation, uncertainty: FloatArray) -> FloatArray:
    """Mean over trials of ``W_t C W_t^T`` (d n, d n): the residual variance removed by the fit."""
    d, n, r = equation.axes, equation.modes.count, equation.matrices
    X = equation.regressors
    C = uncertainty.reshape(r, d, d, r, d, d).transpose(1, 4, 0, 2, 3, 5)
    C = C.reshape(d, d, r * d, r * d)
    removed = np.empty((d, n, d, n))
    for i in range(d):
        for j in range(d):
            # X_t^T (n, r d) C_ij (r d, r d) X_t (r d, n), summed over trials
            right = (C[i, j] @ X).reshape(-1, n)
            removed[i, :, j] = X.reshape(-1, n).T @ right
    return removed.reshape(d * n, d * n) / equation.trials


#: Fits of the noise model, and their steps: the second starts where the first ended.
NOISE_STEPS: Final = (8, 4)
#: With fewer trials the noise cannot be separated from the fit.
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
        Also fits the response R to the displacement of that much earlier.
    modes : Modes, optional
        Default: `spline_modes` of the window.

    Returns
    -------
    WeightedFit
        The equation in modes, the estimated noise, the trials' equations and the parameters.

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine the parameters.
    """
    equation = modal_equation(window, modes, delay_s=delay_s)
    noise = start_noise(window, equation)
    drift_free = _without_drift(equation.modes, equation.axes)
    equations = weighted_equations(equation, drift_free, kind)
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

    Z (T, r d, n) is the motion expected from the other trials. If there is no such expectation, Z
    is W itself, and the excess by its noise is subtracted: ``A_t = W_t^T V W_t - E[N^T V N]``.
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
    """Weight (d n, d n) that ignores an offset and a ramp of each axis."""
    smooth = modes.smooth
    ramp = np.linspace(-1.0, 1.0, smooth.shape[1])
    Q = np.linalg.qr(smooth @ np.column_stack([np.ones_like(ramp), ramp]))[0]
    return frozen(np.kron(np.eye(axes), np.eye(len(smooth)) - Q @ Q.T))
