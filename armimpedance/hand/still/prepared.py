"""Record of an estimator, and its equations for the solver: regressors and coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES, FORCE_UNIT, UNITS, Kind, parameter_names
from armimpedance.core.records import Response, Window
from armimpedance.numerics.regression import TrialEquations, TrialFactors, trial_factors

# The regressor of the impedance equation, and the conversion of its solution to M, B, K.

#: An offset and a ramp per trial and output have been projected out before the fit.
NUISANCE_PER_TRIAL = 2
#: A single trial is cut into this many blocks, each used as a cluster. The intervals are rough,
#: which a warning says.
BLOCKS_OF_ONE_TRIAL = 5


def regressor_names(kind: Kind, d: int) -> tuple[str, ...]:
    """Names ``x'', y'', x', y', x, y`` for hands, ``q1'', …`` for joints."""
    axes = AXES[:d] if kind == "hand" else tuple(f"q{i}" for i in range(1, d + 1))
    return tuple(f"{axis}{dots}" for dots in ("''", "'", "") for axis in axes)


def output_names(kind: Kind, d: int) -> tuple[str, ...]:
    """Names ``-Fx, -Fy`` for hands, ``-tau1, …`` for joints."""
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
    """Cut one trial (1, S, c) into blocks (b, S // b, c): clusters if there are no other trials."""
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


# Coordinates of the parameters that a constraint leaves free.
#
# A fit under constraints that are linear, or taken by their tangent at the solution, is an ordinary
# one in fewer numbers: ``theta = origin + basis u``. Standard errors follow in u and are carried
# back; a combination that the constraint fixes has a standard error of zero.


@dataclass(frozen=True, eq=False)
class Chart(FrozenRecord):
    """``theta (n,) = origin (n,) + basis (n, r) u (r,)``.

    `origin` (n,).
    `basis` (n, r): columns that span the free directions; they are linearly independent.
    """

    origin: Annotated[FloatArray, "n"]
    basis: Annotated[FloatArray, "n r"]

    def restrict(self, equations: TrialEquations) -> TrialEquations:
        """Equations of every cluster for u, with names ``u_1 …``."""
        T, r = self.basis, self.basis.shape[1]
        # T^T A_t T (r, r) u (r,) = T^T (b_t - A_t origin) (r,)
        A = T.T @ equations.A @ T
        b = (equations.b - equations.A @ self.origin) @ T
        return TrialEquations(A, b, tuple(f"u_{i + 1}" for i in range(r)), ("",) * r)

    def expand(self, free: FloatArray) -> FloatArray:
        """Parameters (..., n) of coordinates (..., r)."""
        return self.origin + free @ self.basis.T

    def expand_change(self, change: FloatArray) -> FloatArray:
        """Changes of the parameters (..., n) for changes of the coordinates (..., r)."""
        return change @ self.basis.T


@dataclass(frozen=True)
class Prepared:
    """The impedance equation of one group of trials, ready to solve.

    `factors`: triangular factors of ``[W y]`` per trial. Condition, rank and multiple correlation
    are judged on them; least squares is solved on them if there are no `equations`.
    `equations`: equations of an estimator that is not plain least squares, for the same clusters.
    Their parameters are M, B, K row by row (`core.conventions.parameter_names`).
    `notes`: the procedure, for the provenance.
    `warnings`: for the user.
    `bound` (3 d^2, 3 d^2): Cramer-Rao bound of M, B, K row by row, if the method computes it
    anyway.
    `chart`: chart of the equations' parameters, if a constraint links them.
    """

    factors: TrialFactors
    equations: TrialEquations | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    bound: FloatArray | None = None
    chart: Chart | None = None

    def trial_equations(self, kind: Kind) -> TrialEquations:
        """The equations of every trial for M, B, K row by row, also of a least-squares method."""
        if self.equations is not None:
            return self.equations
        d = self.factors.n_outputs
        names = parameter_names(d)
        units = tuple(UNITS[kind][name[0]] for name in names)
        plain = TrialEquations.of(self.factors, names, units)
        # position in the fit's order of each parameter in matrix order
        order = np.argsort(output_major_order(d))
        A = plain.A[:, order][:, :, order]
        return TrialEquations(A, plain.b[:, order], names, units)


@dataclass(frozen=True)
class Method:
    """An estimator; its name is that of its file in `methods`.

    `assumes`: condition under which the estimate is right, in one sentence.
    `prepare`: function that turns the raw windows of one group into the equations to solve.
    `differs`: likely cause if this method alone disagrees with the default, in one clause.
    """

    assumes: str
    reference: str
    prepare: Callable[[Window, Kind], Prepared]
    differs: str = ""


#: Methods that weigh the same equation differently agree unless the equation is wrong.
NO_LINEAR_LIMB: Final = "the response is not that of a linear second-order limb, as with a reflex"
