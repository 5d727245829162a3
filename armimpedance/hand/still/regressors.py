"""The regressor of the impedance equation, and the way from its solution to M, B, K."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, FORCE_UNIT, UNITS, Kind, parameter_names
from armimpedance.core.records import Response
from armimpedance.numerics.regression import TrialFactors, trial_factors

#: An offset and a ramp per trial and output have been projected out before the fit.
NUISANCE_PER_TRIAL = 2
#: A single trial is cut into this many blocks, each taken for a cluster: rough, and said so.
BLOCKS_OF_ONE_TRIAL = 5


def regressor_names(kind: Kind, d: int) -> tuple[str, ...]:
    """``x'', y'', x', y', x, y`` for hands, ``q1'', …`` for joints."""
    axes = AXES[:d] if kind == "hand" else tuple(f"q{i}" for i in range(1, d + 1))
    return tuple(f"{axis}{dots}" for dots in ("''", "'", "") for axis in axes)


def output_names(kind: Kind, d: int) -> tuple[str, ...]:
    """``-Fx, -Fy`` for hands, ``-tau1, …`` for joints."""
    if kind == "hand":
        return tuple(f"-F{axis}" for axis in AXES[:d])
    return tuple(f"-tau{i}" for i in range(1, d + 1))


def stack_columns(response: Response) -> FloatArray:
    """W of the impedance equation, (T, S, 3 d): acceleration, velocity, displacement."""
    columns = (response.acceleration, response.velocity, response.displacement)
    return np.concatenate(columns, axis=2)


def impedance_factors(
    response: Response, kind: Kind, *, nuisance_per_trial: int = NUISANCE_PER_TRIAL
) -> TrialFactors:
    """Triangular factors of ``[W y]`` per trial.

    Row by row ``[x''^T x'^T x^T] [M B K]^T = -f^T``, (1, 3 d) (3 d, d) = (1, d): (28) with both
    sides corrected.
    """
    d = response.axes
    used = response.usable
    columns, force = stack_columns(response)[used], response.force[used]
    if len(columns) == 1:
        columns, force = in_blocks(columns), in_blocks(force)
    # (T, S, 3 d) Theta = (T, S, d)
    return trial_factors(
        columns,
        -force,
        regressors=regressor_names(kind, d),
        outputs=output_names(kind, d),
        regressor_units=_regressor_units(kind, d),
        output_units=(FORCE_UNIT[kind],) * d,
        nuisance_per_trial=nuisance_per_trial,
    )


def in_blocks(single: FloatArray) -> FloatArray:
    """One trial (1, S, c) as blocks (b, S // b, c): clusters where there are no other trials."""
    rows = single.shape[1] // BLOCKS_OF_ONE_TRIAL
    return single[0, : rows * BLOCKS_OF_ONE_TRIAL].reshape(BLOCKS_OF_ONE_TRIAL, rows, -1)


def _regressor_units(kind: Kind, d: int) -> tuple[str, ...]:
    unit = "m" if kind == "hand" else "rad"
    return tuple(f"{unit}{per}" for per in ("/s^2", "/s", "") for _ in range(d))


def fit_names(kind: Kind, d: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names and units of the fit's parameters, all of output 1 first: ``M_11, M_12, B_11, …``."""
    order = output_major_order(d)
    by_matrix = parameter_names(d)
    names = tuple(by_matrix[i] for i in order)
    return names, tuple(UNITS[kind][name[0]] for name in names)


def output_major_order(d: int) -> np.ndarray:
    """Index into (M, B, K row by row) of each parameter of a fit, all of output 1 first."""
    index = np.arange(3 * d * d).reshape(3, d, d)  # [matrix, output, axis]
    return index.transpose(1, 0, 2).ravel()


def to_matrix_order(parameters: FloatArray, covariance: FloatArray, d: int) -> np.ndarray:
    """Reorder a fit's parameters and covariance to M, B, K row by row: (1 + 3 d^2, 3 d^2)."""
    order = output_major_order(d)
    result = np.empty((1 + len(order), len(order)))
    result[0, order] = parameters
    result[1:][np.ix_(order, order)] = covariance
    return result


def to_fit_order(parameters: FloatArray, d: int) -> FloatArray:
    """Coefficients Theta (3 d, d) of a fit from M, B, K row by row (3 d^2,)."""
    # Theta = [M B K]^T: column i predicts output i
    return np.asarray(parameters.reshape(3, d, d).transpose(0, 2, 1).reshape(3 * d, d))
