"""Method `latent`: the undisturbed course of each reach as a random course with its own history.

The joint equation (`equation`), whose right side has the same distribution in pushed and in free
reaches; what the trial did before the push tells most of what it would have done after it; what is
left is weighed by its covariance, and instruments that are linear in the push's direction keep it
out of the regressors (`solve`).
"""

from __future__ import annotations

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.equation import TOLD, ReachEquations, equations_of
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod, at_level, doubts_of, where_of
from armimpedance.hand.reaching.solve import Known, PhaseSolution, solve
from armimpedance.hand.reaching.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, known: Known | None) -> PhaseFit:
    """Fit one phase."""
    equations = equations_of(windows)
    doubted = doubts_of(equations, solve(equations, known), known)
    solution = doubted.solution
    values, covariance = at_level(
        level,
        windows.arm,
        where_of(windows),
        solution.theta[TOLD],
        solution.covariance[TOLD, TOLD],
    )
    return PhaseFit(
        level=level,
        values=values,
        covariance=covariance,
        dof=solution.dof,
        condition=solution.condition,
        rank=TOLD.stop,
        explained=explained_by(equations, solution),
        warnings=doubted.warnings,
        provenance=doubted.provenance,
    )


def explained_by(equations: ReachEquations, solution: PhaseSolution) -> float:
    """Share of the torque's mean response that inertia, viscosity and stiffness describe."""
    response = equations.along_direction(equations.y)
    left: FloatArray = equations.along_direction(solution.residual)
    return float(1 - (left**2).sum() / (response**2).sum())


METHOD = ReachMethod(
    assumes="K and B change linearly over the window; the person does not yet answer on purpose",
    reference="docs/explanation/movement.md",
    fit=fit,
    levels=("hand", "joint"),
    throughout=True,
)
