"""Joint stiffness and viscosity at one posture as functions of muscle activation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arrays import FloatArray, frozen_array
from armimpedance.errors import InputError
from armimpedance.muscles.activation.design import column_names, joint_columns, powers
from armimpedance.muscles.prediction import JointPrediction
from armimpedance.muscles.quality import ElementQuality
from armimpedance.plain import from_plain, to_plain
from armimpedance.regression import FitSummary

#: An activation this far beyond the measured range is still inside (rounding in a file).
_EDGE = 1e-6


@dataclass(frozen=True)
class ActivationModel:
    """``K_j = K_0 + sum_i (sum_k c_ik alpha_i^k) A_i``, and B with coefficients of its own.

    Attributes
    ----------
    model : str
        A name of `activation_fit.ACTIVATION_MODELS`.
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
        ``K_0`` (ss, se, ee; Nm/rad), then ``c_ik`` muscle by muscle (N/m). The split of K_0
        between muscles is not identifiable and not here.
    stiffness_covariance, viscosity_covariance : (3 + m N, 3 + m N)
    dof : float
        Of the t distribution for intervals.
    activation_range : (m, 2)
        Measured.
    leverage : (3 + m N, 3 + m N)
        ``(X^T X)^-1`` of the measured regressors.
    leverage_limit : float
        The largest leverage of a measured condition.
    quality : tuple of ElementQuality
        K_ss, K_se, K_ee, B_ss, B_se, B_ee.
    summary : FitSummary
    """

    model: str
    order: int
    arm: str
    muscles: tuple[str, ...]
    joint_angles: FloatArray
    patterns: FloatArray
    viscous_patterns: FloatArray
    stiffness_per_tension: float
    stiffness: FloatArray
    viscosity: FloatArray
    stiffness_covariance: FloatArray
    viscosity_covariance: FloatArray
    dof: float
    activation_range: FloatArray
    leverage: FloatArray
    leverage_limit: float
    quality: tuple[ElementQuality, ...]
    summary: FitSummary

    def __post_init__(self) -> None:
        m = len(self.muscles)
        p = 3 + m * self.order
        for name, shape in (
            ("joint_angles", (2,)),
            ("patterns", (m, 3)),
            ("viscous_patterns", (m, 3)),
            ("stiffness", (p,)),
            ("viscosity", (p,)),
            ("stiffness_covariance", (p, p)),
            ("viscosity_covariance", (p, p)),
            ("activation_range", (m, 2)),
            ("leverage", (p, p)),
        ):
            object.__setattr__(self, name, frozen_array(getattr(self, name), name, shape))
        if not self.dof > 0:
            raise InputError(f"{self.dof} degrees of freedom", expected="more than 0")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Those of the fit."""
        return self.summary.warnings

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
        """What activation adds to each muscle's stiffness, ``f_i(alpha) - f_i(0)``, (P, m), N/m.

        f_i(0) itself cannot be told from the other muscles' (see `stiffness`).
        """
        alpha = checked_activation(activation, self.muscles)
        c = self.stiffness[3:].reshape(len(self.muscles), self.order)
        return np.asarray((powers(alpha, self.order) * c).sum(axis=-1))

    def muscle_stiffness_sd(self, activation: ArrayLike) -> FloatArray:
        """Standard errors (P, m) of `muscle_stiffness`."""
        alpha = checked_activation(activation, self.muscles)
        m, N = len(self.muscles), self.order
        C = self.stiffness_covariance[3:, 3:].reshape(m, N, m, N)
        own = np.einsum("ikil->ikl", C)
        x = powers(alpha, N)
        return np.sqrt(np.einsum("pik,ikl,pil->pi", x, own, x))

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

    def as_plain(self) -> dict[str, Any]:
        """Numbers, texts, lists and dictionaries only: what JSON can hold."""
        plain: dict[str, Any] = to_plain(self)
        return plain

    @classmethod
    def from_plain(cls, plain: Mapping[str, Any]) -> ActivationModel:
        """What `as_plain` made.

        Raises
        ------
        InputError
            A field is missing or is not what it should be.
        """
        return from_plain(cls, plain)


def checked_activation(activation: ArrayLike, muscles: tuple[str, ...]) -> FloatArray:
    """Activations (P, m) of the m muscles, each 0..1.

    Raises
    ------
    InputError
        Another shape, not finite, or outside of 0..1.
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
