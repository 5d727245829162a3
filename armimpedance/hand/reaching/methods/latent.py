"""Method `latent`: the undisturbed course of each reach is a random course with its own history.

The joint equation (`equation`) has a right side with the same distribution in pushed and in free
reaches. The motion before the push predicts most of the undisturbed motion after it. The remainder
is weighted by its covariance, and instruments that are linear in the push's direction keep it out
of the regressors (`solve`).
"""

from __future__ import annotations

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Level
from armimpedance.hand.reaching.equation import REPORTED, ReachEquations, equations_of
from armimpedance.hand.reaching.fitted import PhaseFit, ReachMethod, at_level, doubts_of, where_of
from armimpedance.hand.reaching.solve import InertiaPrior, PhaseSolution, solve
from armimpedance.hand.reaching.windows import PhaseWindows


def fit(windows: PhaseWindows, level: Level, prior: InertiaPrior | None) -> PhaseFit:
    """Fit one phase."""
    equations = equations_of(windows)
    doubted = doubts_of(equations, solve(equations, prior), prior)
    solution = doubted.solution
    values, covariance = at_level(
        level,
        windows.arm,
        where_of(windows),
        solution.theta[REPORTED],
        solution.covariance[REPORTED, REPORTED],
    )
    return PhaseFit(
        level=level,
        values=values,
        covariance=covariance,
        dof=solution.dof,
        condition=solution.condition,
        rank=REPORTED.stop,
        explained=explained_by(equations, solution),
        warnings=doubted.warnings,
        provenance=doubted.provenance,
    )


def explained_by(equations: ReachEquations, solution: PhaseSolution) -> float:
    """Share of the torque's mean response that inertia, viscosity and stiffness describe."""
    response = equations.along_direction(equations.y)
    residual: FloatArray = equations.along_direction(solution.residual)
    return float(1 - (residual**2).sum() / (response**2).sum())


METHOD = ReachMethod(
    assumes="K and B change linearly over the window; the person does not yet answer on purpose",
    reference="docs/explanation/movement.md",
    fit=fit,
    levels=("hand", "joint"),
    throughout=True,
)
