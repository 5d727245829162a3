"""An estimator's record, and what it hands to the solver."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS, Kind, parameter_names
from armimpedance.core.records import Window
from armimpedance.hand.still.chart import Chart
from armimpedance.hand.still.regressors import output_major_order
from armimpedance.numerics.regression import TrialEquations, TrialFactors


@dataclass(frozen=True)
class Prepared:
    """The impedance equation of one group of trials, ready to solve.

    Attributes
    ----------
    factors : TrialFactors
        Triangular factors of ``[W y]`` per trial. Condition, rank and multiple correlation are
        judged on them; least squares is solved on them where there are no `equations`.
    equations : TrialEquations, optional
        Equations of an estimator that is not plain least squares, for the same clusters. Their
        parameters are M, B, K row by row (`core.conventions.parameter_names`).
    notes : tuple of str
        For the provenance: how it was done.
    warnings : tuple of str
        For the user.
    bound : (3 d^2, 3 d^2) array, optional
        Cramer-Rao bound of M, B, K row by row, where the method finds it on its way.
    chart : Chart, optional
        Chart of the equations' parameters, where a constraint ties them.
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

    Attributes
    ----------
    assumes : str
        Condition under which the estimate is right, in one sentence.
    reference : str
    prepare : function
        Function that turns the raw windows of one group into the equations to solve.
    differs : str
        Likely cause if this method alone disagrees with the default, in one clause.
    """

    assumes: str
    reference: str
    prepare: Callable[[Window, Kind], Prepared]
    differs: str = ""


#: Methods that weigh the same equation differently agree unless the equation is wrong.
NO_LINEAR_LIMB: Final = "the response is not that of a linear second-order limb, as with a reflex"
