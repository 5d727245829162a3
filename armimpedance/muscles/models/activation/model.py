"""Joint stiffness and viscosity at one posture as functions of muscle activation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.checks import (
    ActivationRank,
    falling_muscles,
    plausible_size,
    unpredicted,
)
from armimpedance.muscles.models.activation.equations import (
    ActivationEquations,
    SolvedEquations,
    column_names,
    joint_columns,
    powers,
)
from armimpedance.muscles.models.activation.misfit import ActivationMisfit
from armimpedance.muscles.models.fitted_model import ElementQuality, FittedModel, explained
from armimpedance.muscles.models.prediction import JointPrediction
from armimpedance.numerics.regression import FitSummary, Parameters

#: An activation this far beyond the measured range is still inside (rounding in a file).
_EDGE = 1e-6


@dataclass(frozen=True, repr=False)
class ActivationModel(FittedModel):
    """``K_j = K_0 + sum_i (sum_k c_ik alpha_i^k) A_i``, and B with coefficients of its own.

    Attributes
    ----------
    model : str
        A name of `ACTIVATION_MODELS`.
    order : int
        N.
    arm : str
    muscles : (m,) tuple of str
    joint_angles : (2,)
        The one posture, rad.
    patterns, viscous_patterns : (m, 3)
        ``A_i`` of K (with curvature, where it is on) and of B: ``ss, se, ee`` of one N/m.
    stiffness_per_tension : float
        kappa, 1/m.
    stiffness, viscosity : (3 + m N,)
        ``K_0`` (ss, se, ee; N m/rad), then ``c_ik`` muscle by muscle (N/m). The split of K_0
        between muscles is not identifiable and not here.
    stiffness_covariance, viscosity_covariance : (3 + m N, 3 + m N)
        For the matrices that the muscles make together.
    muscle_covariance : (m N, m N)
        Of ``c_ik`` for single muscles: wider where moment arms or the law were found to be wrong.
    dof : float
        Degrees of freedom of the t distribution for intervals.
    activation_range : (m, 2)
        Measured.
    leverage : (3 + m N, 3 + m N)
        ``(X^T X)^-1`` of the measured regressors.
    leverage_limit : float
        The largest leverage of a measured condition.
    quality : tuple of ElementQuality
        K_ss, K_se, K_ee, B_ss, B_se, B_ee.
    summary : FitSummary

    Examples
    --------
    >>> import armimpedance as ai
    >>> from manipulandum_sim.hand import simulate
    >>> hand = [*ai.estimate(simulate("cocontraction", seed=1, sets=1)[0])]
    >>> forces, _ = simulate("force", seed=1, sets=1)
    >>> joint = ai.to_joint([*hand, *ai.estimate(forces)], recording=forces)
    >>> model = ai.fit_activation(joint, order=1, torque=True)
    >>> model.predict([0.1] * 6).stiffness.shape
    (1, 3)
    """

    model: str
    order: int
    arm: str
    muscles: Annotated[tuple[str, ...], "m"]
    joint_angles: Annotated[FloatArray, "2"]
    patterns: Annotated[FloatArray, "m 3"]
    viscous_patterns: Annotated[FloatArray, "m 3"]
    stiffness_per_tension: float
    stiffness: Annotated[FloatArray, "p"]
    viscosity: Annotated[FloatArray, "p"]
    stiffness_covariance: Annotated[FloatArray, "p p covariance"]
    viscosity_covariance: Annotated[FloatArray, "p p covariance"]
    muscle_covariance: Annotated[FloatArray, "a a covariance"]
    dof: float
    activation_range: Annotated[FloatArray, "m 2"]
    leverage: Annotated[FloatArray, "p p"]
    leverage_limit: float
    quality: tuple[ElementQuality, ...]
    summary: FitSummary

    def __post_init__(self) -> None:
        super().__post_init__()
        p = 3 + len(self.muscles) * self.order
        if len(self.stiffness) != p:
            raise InputError(f"{len(self.stiffness)} coefficients of K", expected=f"{p}")

    @property
    def parameters(self) -> Parameters:
        """`stiffness`, then `viscosity`, whose fits are independent, with their covariance."""
        active = len(self.stiffness) - 3
        return Parameters(
            tuple(
                name for symbol in "KB" for name in column_names(symbol, self.muscles, self.order)
            ),
            (*("N m/rad",) * 3, *("N/m",) * active, *("N m s/rad",) * 3, *("N s/m",) * active),
            np.concatenate([self.stiffness, self.viscosity]),
            block_diag(self.stiffness_covariance, self.viscosity_covariance),
            dof=self.dof,
        )

    def predict(self, activation: ArrayLike) -> JointPrediction:
        """K_j and B_j at activations (P, m) or (m,), each 0..1, in the model's posture.

        Raises
        ------
        InputError
            Activations of another shape, or outside of 0..1.
        """
        alpha = checked_activation(activation, self.muscles)
        X = joint_columns(alpha, self.patterns, self.order)
        X_B = joint_columns(alpha, self.viscous_patterns, self.order)
        reasons = self._reasons(alpha, X)
        return JointPrediction(
            joint_angles=np.broadcast_to(self.joint_angles, (len(alpha), 2)),
            stiffness=X @ self.stiffness,
            viscosity=X_B @ self.viscosity,
            stiffness_covariance=X @ self.stiffness_covariance @ X.transpose(0, 2, 1),
            viscosity_covariance=X_B @ self.viscosity_covariance @ X_B.transpose(0, 2, 1),
            dof=self.dof,
            extrapolated=np.array([bool(reason) for reason in reasons]),
            reasons=reasons,
            activation=alpha,
        )

    def muscle_stiffness(self, activation: ArrayLike) -> FloatArray:
        """Stiffness that activation adds to each muscle, ``f_i(alpha) - f_i(0)``, (P, m), N/m.

        f_i(0) itself cannot be told from the other muscles' (see `stiffness`).
        """
        alpha = checked_activation(activation, self.muscles)
        c = self.stiffness[3:].reshape(len(self.muscles), self.order)
        return np.asarray((powers(alpha, self.order) * c).sum(axis=-1))

    def muscle_stiffness_sd(self, activation: ArrayLike) -> FloatArray:
        """Standard errors (P, m) of `muscle_stiffness`."""
        alpha = checked_activation(activation, self.muscles)
        m, N = len(self.muscles), self.order
        C = self.muscle_covariance.reshape(m, N, m, N)
        own = np.einsum("ikil->ikl", C)
        x = powers(alpha, N)
        return np.sqrt(np.einsum("pik,ikl,pil->pi", x, own, x))

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> ActivationModel:
        """The model that `as_plain` wrote; files from before `muscle_covariance` are read too.

        Raises
        ------
        InputError
            A field is missing, unknown or not what it should be.
        """
        if "muscle_covariance" not in plain and "stiffness_covariance" in plain:
            active = [row[3:] for row in plain["stiffness_covariance"][3:]]
            plain = {**plain, "muscle_covariance": active}
        return super().from_plain(plain)

    def _reasons(self, alpha: FloatArray, X: FloatArray) -> tuple[str, ...]:
        low, high = self.activation_range.T
        below, above = alpha < low - _EDGE, alpha > high + _EDGE
        far = leverages(X, self.leverage) > self.leverage_limit * (1 + 1e-9)
        return tuple(
            _reason(self.muscles, below[p] | above[p], bool(far[p])) for p in range(len(alpha))
        )

    def parameter_names(self, symbol: str) -> tuple[str, ...]:
        """Names of `stiffness` ("K") or `viscosity` ("B")."""
        return column_names(symbol, self.muscles, self.order)


def checked_activation(activation: ArrayLike, muscles: tuple[str, ...]) -> FloatArray:
    """Activations (P, m) of the m muscles, each 0..1.

    Raises InputError: another shape, not finite, or outside of 0..1.
    """
    alpha = np.atleast_2d(np.asarray(activation, dtype=float))
    if alpha.ndim != 2 or alpha.shape[1] != len(muscles):
        raise InputError(
            f"activations of shape {np.shape(activation)}", expected=f"(P, {len(muscles)})"
        )
    outside = ~((alpha >= 0) & (alpha <= 1))
    if outside.any():
        row, i = (int(k) for k in np.argwhere(outside)[0])
        raise InputError(
            f"activation {alpha[row, i]:.3g} of {muscles[i]}", expected="0 to 1 (1 is the MVC)"
        )
    return alpha


def leverages(X: FloatArray, inverse: FloatArray) -> FloatArray:
    """Leverage (P,) of conditions with regressors X (P, 3, p): largest eigenvalue of X C X^T."""
    return np.asarray(np.linalg.eigvalsh(X @ inverse @ X.transpose(0, 2, 1))[:, -1])


def _reason(muscles: tuple[str, ...], outside: np.ndarray, far: bool) -> str:
    if outside.any():
        names = ", ".join(np.array(muscles)[outside])
        return f"activation outside of the measured range: {names}"
    return "a combination of activations far from all measured ones" if far else ""


# Solved equations of K and B as an activation model with its summary and warnings.


def activation_result(
    name: str,
    arm: MuscularArm,
    q: FloatArray,
    equations: tuple[ActivationEquations, ActivationEquations],
    solved: tuple[SolvedEquations, SolvedEquations],
    rank: ActivationRank,
    quality: tuple[ElementQuality, ...],
    misfits: tuple[ActivationMisfit, ActivationMisfit],
    session: tuple[Finding, ...],
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
    checks = (*fits, *session, plausible_size(of_K.outputs[:, :3]))
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
