"""The weighted fit of a condition, and the number of one departure more in it.

y and K in a departure's column are those that the plain fit finds; the rows are weighted by its
noise, and the number k has a standard error clustered by trial.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.special import stdtrit

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.doubts.columns import columns_of, family
from armimpedance.hand.still.doubts.inner_columns import inner_columns
from armimpedance.hand.still.weighing.expected_motion import expected_motion
from armimpedance.hand.still.weighing.modal import ModalEquation, weighted_equations
from armimpedance.hand.still.weighing.weighted_fit import compensated_equations, weighted_fit
from armimpedance.numerics.regression import TrialEquations, solve_equations

#: A departure is told where chance alone does as much less often than this; of the best of several
#: delays chance makes more.
LEVEL: Final = {
    "delay": 0.007,
    "reflex": 0.006,
    "amplitude": 0.007,
    "friction": 0.003,
    "voluntary": 0.002,
    "inner": 0.0005,
}


@dataclass(frozen=True)
class Departure:
    """The number of one departure.

    Attributes
    ----------
    size, error : float
        k and its standard error.
    expected : float
        The standard error that the estimated noise leads to expect: rougher than `error`, but of
        one measure for all columns, which `error` (of few trials) is not.
    share : float
        By how much of K (of B, for delay and friction) the plain fit is wrong for each unit of k.
    known : float
        Standard error of that matrix along itself, as a part of it: what is less does not matter.
    dof : float
    level : float
        How often chance alone may reach `limit`.
    """

    size: float
    error: float
    expected: float
    share: float
    known: float
    dof: float
    level: float

    @property
    def t(self) -> float:
        """Size in standard errors; those of a normal distribution, whatever the dof."""
        return self.size / self.error

    @property
    def z(self) -> float:
        """Size in expected standard errors: how much it explains beside another departure."""
        return self.size / self.expected

    @property
    def limit(self) -> float:
        """What chance alone does not reach, of size."""
        return float(stdtrit(self.dof, 1 - self.level / 2)) * self.error


@dataclass(frozen=True, eq=False)
class Model:
    """A condition's weighted fit and the columns of the departures.

    Attributes
    ----------
    equation : ModalEquation
    weight : (d n, d n)
        V, the inverse of the noise's covariance.
    instruments : (T, 3 d, n) or None
    equations : TrialEquations
        The plain fit's, W against Z.
    parameters : (3 d^2,)
        Theirs.
    covariance : (3 d^2, 3 d^2)
    columns : mapping str -> (T, d, n)
    way : float
        Median peak displacement.
    """

    equation: ModalEquation
    weight: FloatArray
    instruments: FloatArray | None
    equations: TrialEquations
    parameters: FloatArray
    covariance: FloatArray
    columns: dict[str, FloatArray]
    way: float

    @classmethod
    def of(cls, window: Window, kind: Kind, free_wrist: bool = False) -> Model:
        """Fit the window without departures, and make their columns."""
        found = weighted_fit(window, kind)
        V = np.linalg.inv(found.noise.covariance(found.parameters))
        V = (V + V.T) / 2
        Z = expected_motion(found.equation)
        plain = compensated_equations(found.equation, found.noise, V, Z, kind)
        solved = solve_equations(plain)
        columns, way = columns_of(window, found.equation, Z, solved.parameters)
        columns |= inner_columns(window, found.equation, solved.parameters, free_wrist)
        theta, covariance = solved.parameters, solved.covariance
        return cls(found.equation, V, Z, plain, theta, covariance, columns, way)

    def departure(self, column: str, beside: str | None = None) -> Departure:
        """The number k of one departure, with another one in the model beside it or without."""
        parameters, covariance, dof, total = self._solved(column, beside)
        p = len(self.parameters)
        k, error = float(parameters[p]), max(float(np.sqrt(covariance[p, p])), 1e-300)
        expected = float(np.sqrt(abs(np.linalg.inv(total)[p, p])))
        of_B = family(column) in ("delay", "friction")
        which = slice(p // 3, 2 * p // 3) if of_B else slice(2 * p // 3, p)
        own, apart = self.parameters[which], parameters[which]
        share = float((own - apart) @ own / (own @ own)) / k if k else 0.0
        known = float(np.sqrt(own @ self.covariance[which, which] @ own)) / float(own @ own)
        return Departure(k, error, expected, share, known, dof, LEVEL[family(column)])

    def shift(self, column: str) -> FloatArray:
        """By how much M, B and K (3 d^2,) are wrong for one unit of a departure."""
        parameters = self._solved(column)[0]
        k = float(parameters[-1])
        return (self.parameters - parameters[:-1]) / k if k else np.zeros(len(self.parameters))

    def _solved(
        self, column: str, beside: str | None = None
    ) -> tuple[FloatArray, FloatArray, float, FloatArray]:
        """M, B, K and k (and that of the one beside), covariance, dof, and the normal matrix."""
        columns = [column] if beside is None else [column, beside]
        p, T = len(self.parameters), self.equation.trials
        size = p + len(columns)
        A, b = np.empty((T, size, size)), np.empty((T, size))
        A[:, :p, :p], b[:, :p] = self.equations.A, self.equations.b
        y = self.equation.force.reshape(T, -1)
        flat = [self.columns[name].reshape(T, -1) for name in columns]
        for i, name in enumerate(columns):
            A[:, p + i, :p], A[:, :p, p + i] = self._cross(name)
            weighted = flat[i] @ self.weight
            b[:, p + i] = (weighted * y).sum(axis=1)
            for j, other in enumerate(flat):
                A[:, p + i, p + j] = (weighted * other).sum(axis=1)
        names = (*self.equations.names, *columns)
        units = (*self.equations.units, *("" for _ in columns))
        # [[Z^T V W, Z^T V z], [z^T V W, z^T V z]] (p + 1, p + 1) [theta; k] = [Z^T V y; z^T V y]
        solved = solve_equations(TrialEquations(A, b, names, units))
        return solved.parameters, solved.covariance, solved.dof, A.sum(axis=0)

    def _cross(self, name: str) -> tuple[FloatArray, FloatArray]:
        """``z^T V W`` and ``Z^T V z`` of every trial, (T, p) each."""
        moved = replace(self.equation, force=self.columns[name])
        kind: Kind = "hand"  # only names the parameters
        own = weighted_equations(moved, self.weight, kind).b
        if self.instruments is None:
            return own, own
        return own, weighted_equations(moved, self.weight, kind, instruments=self.instruments).b


def pooled(models: Sequence[Model], column: str, beside: str | None = None) -> Departure:
    """One departure over all conditions, weighted by what each is expected to know of it.

    Errors of few trials are rough. Weights of them would make the mean look more certain than it
    is; their mean is less rough. Its degrees of freedom are Satterthwaite's.
    """
    found = [model.departure(column, beside) for model in models]
    weight = np.array([one.expected**-2 for one in found])
    weight /= weight.sum()
    # var(sum_i w_i k_i) = sum_i w_i^2 error_i^2
    parts = (weight * [one.error for one in found]) ** 2
    return Departure(
        size=float(weight @ [one.size for one in found]),
        error=float(np.sqrt(parts.sum())),
        expected=float(np.sum([one.expected**-2 for one in found])) ** -0.5,
        share=float(weight @ [one.share for one in found]),
        known=float(np.median([one.known for one in found])),
        dof=float(parts.sum() ** 2 / (parts**2 @ [1 / one.dof for one in found])),
        level=LEVEL[family(column)],
    )
