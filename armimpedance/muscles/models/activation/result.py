"""Solved equations of K and B as an activation model with its summary and warnings."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.checks import (
    falling_muscles,
    plausible_size,
    unpredicted,
)
from armimpedance.muscles.models.activation.design import column_names
from armimpedance.muscles.models.activation.equations import ActivationEquations, SolvedEquations
from armimpedance.muscles.models.activation.misfit import Misfit
from armimpedance.muscles.models.activation.model import ActivationModel, leverages
from armimpedance.muscles.models.activation.rank import ActivationRank
from armimpedance.muscles.models.quality import ElementQuality, explained
from armimpedance.numerics.regression import FitSummary, Parameters


def activation_result(
    name: str,
    arm: MuscularArm,
    q: FloatArray,
    equations: tuple[ActivationEquations, ActivationEquations],
    solved: tuple[SolvedEquations, SolvedEquations],
    rank: ActivationRank,
    quality: tuple[ElementQuality, ...],
    misfits: tuple[Misfit, Misfit],
) -> ActivationModel:
    """The model of solved equations of K and B at the posture q (2,)."""
    of_K, of_B = equations
    K, B = solved
    n = 3 + of_K.n_active
    X = of_K.columns(of_K.activation)[:, :3, :n]
    leverage = _inverse_gram(X.reshape(-1, n))
    alpha = of_K.activation
    reach = np.stack([alpha.min(axis=0), alpha.max(axis=0)], axis=1)
    falling = falling_muscles(K.theta, reach, arm.paths.muscles, of_K)
    fits = (
        misfit.finding(symbol, _doubt(one.theta[3:n], one.covariance[3:n, 3:n]))
        for symbol, misfit, one in zip("KB", misfits, solved, strict=True)
    )
    checks = (*fits, plausible_size(of_K.outputs[:, :3]))
    warnings = (*rank.warnings, *falling, *unpredicted(quality), *warnings_of(checks))
    alone = tuple(m.muscle_covariance() for m in misfits)
    return ActivationModel(
        model=name,
        order=of_K.order,
        arm=arm.name,
        muscles=arm.paths.muscles,
        joint_angles=q,
        patterns=of_K.patterns,
        viscous_patterns=of_B.patterns,
        stiffness_per_tension=of_K.stiffness_per_tension,
        stiffness=K.theta[:n],
        viscosity=B.theta,
        stiffness_covariance=misfits[0].matrix_covariance(K.covariance)[:n, :n],
        viscosity_covariance=misfits[1].matrix_covariance(B.covariance),
        muscle_covariance=alone[0][3:n, 3:n],
        dof=_dof(of_K, K),
        activation_range=reach,
        leverage=leverage,
        leverage_limit=float(leverages(X, leverage).max()),
        quality=quality,
        summary=_summary(name, arm.paths.muscles, equations, solved, alone, rank, warnings, checks),
    )


def _inverse_gram(X: FloatArray) -> FloatArray:
    """``(X^T X)^-1`` (n, n) of regressors (rows, n), by their triangle."""
    length = np.linalg.norm(X, axis=0)
    R = np.linalg.inv(np.linalg.qr(X / length, mode="r")) / length[:, None]
    return np.asarray(R @ R.T)


def _doubt(c: FloatArray, covariance: FloatArray) -> float:
    """Relative standard error of a muscle's coefficients, the median."""
    return float(np.median(np.sqrt(np.diag(covariance)) / np.maximum(np.abs(c), 1e-100)))


def _dof(equations: ActivationEquations, solved: SolvedEquations) -> float:
    return float(max(equations.outputs.size - len(solved.theta), 1))


def _summary(
    kind: str,
    muscles: tuple[str, ...],
    equations: tuple[ActivationEquations, ActivationEquations],
    solved: tuple[SolvedEquations, SolvedEquations],
    covariances: tuple[FloatArray, ...],
    rank: ActivationRank,
    warnings: tuple[str, ...],
    checks: tuple[Finding, ...],
) -> FitSummary:
    of_K, N = equations[0], equations[0].order
    parameters = [
        p
        for symbol, e, one, C in zip("KB", equations, solved, covariances, strict=True)
        for p in _parameters(symbol, muscles, e, one, C)
    ]
    measured = of_K.outputs[:, :3]
    X = of_K.columns(of_K.activation)[:, :3]
    r2, vaf = explained(measured, X @ solved[0].theta[: X.shape[-1]])
    return FitSummary(
        method=f"activation, {kind}, order {N}",
        n=sum(e.outputs.size for e in equations),
        cond_raw=rank.cond_raw,
        cond_scaled=rank.cond_scaled,
        rank=rank.rank,
        r2=r2,
        vaf=vaf,
        parameters=tuple(parameters),
        warnings=warnings,
        checks=checks,
    )


def _parameters(
    symbol: str,
    muscles: tuple[str, ...],
    equations: ActivationEquations,
    solved: SolvedEquations,
    covariance: FloatArray,
) -> Parameters:
    """Coefficients of K or B, then those of the torque where it was fitted."""
    second = "" if symbol == "K" else "s"
    names = list(column_names(symbol, muscles, equations.order))
    units = [f"N m{second}/rad"] * 3 + [f"N{second}/m"] * equations.n_active
    if equations.n_free:
        names += ["tau_0_s", "tau_0_e", *(f"proportion_{name}" for name in muscles)]
        units += ["N m", "N m", *("1",) * len(muscles)]
    if equations.free_proportion:
        names, units = [*names, "tension_factor"], [*units, "1"]
    return Parameters(
        tuple(names), tuple(units), solved.theta, covariance, dof=_dof(equations, solved)
    )
