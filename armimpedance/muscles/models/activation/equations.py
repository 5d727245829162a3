"""Equations of one matrix (K or B) over activation, and their weighted solution.

Activations carry errors too. Each condition's outputs y (r,) = K's three elements and, where
asked, two torques, all move with the same errors delta of its m activations:
``y - X(alpha - delta) theta = e``. Fitted is the pair (theta, true activations) of largest
likelihood: orthogonal distance regression. Weights alone ("effective variance") would leave the
slopes too small, because the measured activations spread more than the true ones.

Torque: a muscle's tension is ``t_i = (1 + e_i) f_active_i / kappa`` with e_i of a stated standard
deviation. Were all e_i zero, many conditions would make the torque as sure of each muscle's
stiffness as kappa is taken to be known, and the intervals would be too short wherever the
proportion does not hold.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.least_squares import least_squares_in, whitening
from armimpedance.muscles.models.packed import triple
from armimpedance.muscles.models.rows import ELEMENTS

# The linear equations of joint stiffness over muscle activation at one posture.
#
# ``K_j = G^T K_m G`` with ``K_m = diag f_i(alpha_i)`` (Tsuji 1997, (11), (31)) and
# ``f_i = sum_k c_ik alpha_i^k`` (38): each muscle adds ``f_i(alpha_i) A_i``, with a pattern
# ``A_i = g_i g_i^T`` that is known from its moment arms ``g_i``. A muscle that bears a tension adds
# its length's curvature: with a tension in proportion to stiffness, ``t_i = f_i / kappa``, that is
# ``A_i = g_i g_i^T + d2L_i / kappa``.
#
# The six constants c_i0 reach the joint only through ``K_0 = sum_i c_i0 A_i``: three numbers. So 6
# (N + 1) coefficients are 6 N + 3 that data can tell.


def muscle_patterns(
    arm: MuscularArm, q: ArrayLike, *, curvature: bool, stiffness_per_tension: float
) -> FloatArray:
    """``ss, se, ee`` per N/m of each muscle at a posture q (..., 2), (..., m, 3)."""
    G = arm.paths.moment_arms(q)
    A = G[..., :, None] * G[..., None, :]
    if curvature:
        A = A + arm.paths.curvature(q) / stiffness_per_tension
    return triple(A)


def powers(activation: FloatArray, order: int) -> FloatArray:
    """``alpha^1 .. alpha^N`` of activations (P, m), (P, m, N)."""
    return activation[..., None] ** np.arange(1, order + 1)


def power_slopes(activation: FloatArray, order: int) -> FloatArray:
    """Their derivatives by alpha, (P, m, N)."""
    k = np.arange(1, order + 1)
    return k * activation[..., None] ** (k - 1)


def joint_columns(activation: FloatArray, patterns: FloatArray, order: int) -> FloatArray:
    """Regressors (P, 3, 3 + m N) of ``ss, se, ee``: ``K_0``, then ``alpha_i^k A_i``."""
    P, m = activation.shape
    # (P, 3, m, N): of element e, the pattern A_ie times alpha_i^k
    active = patterns.T[None, :, :, None] * powers(activation, order)[:, None]
    constants = np.broadcast_to(np.eye(3), (P, 3, 3))
    return np.concatenate([constants, active.reshape(P, 3, m * order)], axis=-1)


def torque_columns(
    activation: FloatArray, G: FloatArray, stiffness_per_tension: float, order: int
) -> FloatArray:
    """Regressors (P, 2, 3 + m N + 2) of the torque ``tau_0 - G^T t``, t = c alpha^k / kappa."""
    P, m = activation.shape
    active = -G.T[None, :, :, None] * powers(activation, order)[:, None] / stiffness_per_tension
    columns = [np.zeros((P, 2, 3)), active.reshape(P, 2, m * order)]
    return np.concatenate([*columns, np.broadcast_to(np.eye(2), (P, 2, 2))], axis=-1)


def slopes_by_activation(
    activation: FloatArray, coefficients: FloatArray, reach: FloatArray
) -> FloatArray:
    """Derivative (P, r, m) of r outputs by each activation.

    `activation` (P, m).
    `coefficients` (m, N): ``c_ik``.
    `reach` (m, r): contribution of one N/m (or N s/m) of each muscle to each output.
    """
    order = coefficients.shape[1]
    df = (power_slopes(activation, order) * coefficients).sum(axis=-1)
    return np.asarray(df[:, None, :] * reach.T)


def column_names(symbol: str, muscles: tuple[str, ...], order: int) -> tuple[str, ...]:
    """Names of `joint_columns`: ``K_0_ss``, then ``c_pectoralis_major_1``; b for viscosity."""
    letter = "c" if symbol == "K" else "b"
    active = (f"{letter}_{muscle}_{k}" for muscle in muscles for k in range(1, order + 1))
    return (*(f"{symbol}_0_{element}" for element in ELEMENTS), *active)


#: Rounds of weights, activations and coefficients.
_ROUNDS = 300
#: Fitted values (over their size) that change by less are the same.
_SETTLED = 1e-6
#: Standard deviations of K and B below this part of their size count as this.
_LEAST_SD = 1e-9
#: A torque (N m) is never better known: .05 N, the resolution of the source's sensor, at .4 m.
_LEAST_TORQUE_SD = 0.02


@dataclass(frozen=True)
class ActivationEquations:
    """P conditions of r outputs: ``ss, se, ee`` of K or B, then torque where it is used.

    `activation` (P, m), `patterns` (m, 3).
    `activation_sd` (P, m): 0 where activations count as exact.
    `outputs`, `sd` (P, r): measured values; their standard errors, up to a factor for each group
    unless `known`.
    `group` (r,) int: 0 for elements of the matrix, 1 for torque.
    `known` (bool, bool): whether a group's `sd` are what they say: its factor is then at least 1.
    `moment_arms` (m, 2) or None: G where there are torque rows.
    `proportion_sd`: standard deviation of the e_i.
    `free_proportion`: a common factor 1 + e on all tensions is free.
    """

    activation: FloatArray
    activation_sd: FloatArray
    outputs: FloatArray
    sd: FloatArray
    group: np.ndarray
    known: tuple[bool, bool]
    patterns: FloatArray
    order: int
    moment_arms: FloatArray | None
    stiffness_per_tension: float
    proportion_sd: float = 0.1
    free_proportion: bool = False

    @property
    def n_active(self) -> int:
        """Coefficients without K_0 and tau_0."""
        return len(self.patterns) * self.order

    @property
    def n_free(self) -> int:
        """Columns that may have any sign: tau_0, then e_i, then the common e."""
        if self.moment_arms is None:
            return 0
        return 2 + len(self.patterns) + self.free_proportion

    @property
    def reach(self) -> FloatArray:
        """Change of each output per N/m of each muscle, (m, r)."""
        if self.moment_arms is None:
            return self.patterns
        return np.hstack([self.patterns, -self.moment_arms / self.stiffness_per_tension])

    def columns(self, activation: FloatArray) -> FloatArray:
        """Regressors (P, r, p) of the outputs."""
        joint = joint_columns(activation, self.patterns, self.order)
        if self.moment_arms is None:
            return joint
        kappa = self.stiffness_per_tension
        torque = torque_columns(activation, self.moment_arms, kappa, self.order)
        joint = np.concatenate([joint, np.zeros((*joint.shape[:2], 2))], axis=-1)
        return np.concatenate([joint, torque], axis=1)

    def proportion_columns(self, activation: FloatArray, theta: FloatArray) -> FloatArray:
        """Regressors (P, r, n_free - 2) of the e: ``-G_i f_active_i / kappa`` at theta."""
        if self.moment_arms is None:
            return np.zeros((*self.outputs.shape, 0))
        c = theta[3 : 3 + self.n_active].reshape(-1, self.order)
        tension = (powers(activation, self.order) * c).sum(axis=-1) / self.stiffness_per_tension
        columns = np.zeros((*self.outputs.shape, self.n_free - 2))
        columns[:, 3:, : len(c)] = -self.moment_arms.T * tension[:, None, :]
        if self.free_proportion:
            columns[:, 3:, -1] = columns[:, 3:, : len(c)].sum(axis=-1)
        return columns

    @property
    def prior(self) -> FloatArray:
        """Rows (., p) that say how near to zero the e_i are, in standard errors."""
        m = 0 if self.moment_arms is None else len(self.patterns)
        rows = np.zeros((m, 3 + self.n_active + self.n_free))
        start = 3 + self.n_active + 2
        rows[:, start : start + m] = np.eye(m) / self.proportion_sd
        return rows

    def slopes(self, activation: FloatArray, theta: FloatArray) -> FloatArray:
        """Derivative (P, r, m) of the outputs by the activations."""
        c = theta[3 : 3 + self.n_active].reshape(-1, self.order)
        return slopes_by_activation(activation, c, self.reach)

    def select(self, rows: np.ndarray) -> ActivationEquations:
        """These conditions only."""
        taken = {
            n: getattr(self, n)[rows] for n in ("activation", "activation_sd", "outputs", "sd")
        }
        return replace(self, **taken)


@dataclass(frozen=True)
class SolvedEquations:
    """Coefficients of largest likelihood.

    `covariance` (p, p).
    `theta` (p,): ``K_0`` (3), ``c_ik`` (m N), and with torque ``tau_0`` (2), e_i (m), the common e.
    `activation` (P, m): of largest likelihood.
    `design`, `weight` (P, r, p), (P, r, r): regressors at these activations, and L^-1 of each
    condition's covariance L L^T.
    `target` (P, r): what `design` is fitted to: outputs less the part that the activations' errors
    made.
    `prior` (., p): further rows, fitted to zero with unit variance.
    `group_sd` (2,): factor of the standard errors of each group.
    """

    theta: FloatArray
    covariance: FloatArray
    activation: FloatArray
    design: FloatArray
    weight: FloatArray
    target: FloatArray
    prior: FloatArray
    group_sd: FloatArray

    @property
    def whitened(self) -> tuple[FloatArray, FloatArray]:
        """Regressors (P r + ., p) and target with errors of unit variance; prior rows last."""
        X = self.weight @ self.design
        y = np.einsum("pij,pj->pi", self.weight, self.target)
        nothing = np.zeros(len(self.prior))
        return np.vstack([X.reshape(-1, X.shape[-1]), self.prior]), np.append(y, nothing)


def solve_equations(
    equations: ActivationEquations, cone: FloatArray | None = None
) -> SolvedEquations:
    """Fit theta, the activations and the size of each group's errors by turns.

    Parameters
    ----------
    equations : ActivationEquations
        Equations of full rank (`activation_rank`).
    cone : (3 + m N, g) or None
        ``theta = cone @ gamma`` with gamma >= 0 for all but tau_0; None: theta is free.

    Raises
    ------
    EstimationError
        The rounds do not settle.
    """
    y = equations.outputs
    size = float(np.abs(y).max())
    least = _least_factors(equations)
    factor, at = np.maximum(1.0, least), equations.activation
    theta = _first(equations)
    fitted, J = None, np.zeros((*y.shape, at.shape[1]))
    for _ in range(_ROUNDS):
        X = np.concatenate(
            [equations.columns(at), equations.proportion_columns(at, theta)], axis=-1
        )
        weight = whitening(_covariance(equations, factor, J))
        # y = X(at) theta + J (measured - at), linear about the current activations
        target = y - np.einsum("prm,pm->pr", J, equations.activation - at)
        now = SolvedEquations(
            theta, np.eye(X.shape[-1]), at, X, weight, target, equations.prior, factor
        )
        Xw, yw = now.whitened
        theta = least_squares_in(Xw, yw, cone, equations.n_free)
        error = (yw - Xw @ theta)[: y.size].reshape(y.shape)
        grown = np.maximum(factor * _group_scales(error, Xw, equations), least)
        if fitted is not None and np.abs(X @ theta - fitted).max() <= _SETTLED * size:
            break
        fitted, factor = X @ theta, grown
        J = equations.slopes(at, theta)
        at = _activations(equations, factor, J, target - fitted)
    else:
        raise EstimationError(
            f"the activation model did not settle in {_ROUNDS} rounds of reweighting"
        )
    length = np.linalg.norm(Xw, axis=0)
    inverse = np.linalg.inv(np.linalg.qr(Xw / length, mode="r")) / length[:, None]
    return replace(now, theta=theta, covariance=inverse @ inverse.T)


def _first(equations: ActivationEquations) -> FloatArray:
    """Unweighted least squares, to start from; without the e."""
    X = equations.columns(equations.activation)
    flat = X.reshape(-1, X.shape[-1])
    return least_squares_in(flat, equations.outputs.ravel(), None, 0)


def _least_factors(equations: ActivationEquations) -> FloatArray:
    """Factors (2,) of the groups' standard errors are not below these."""
    least = np.ones(2)
    for g in np.unique(equations.group):
        mine = equations.group == g
        size = np.sqrt((equations.outputs[:, mine] ** 2).mean())
        floor = max(_LEAST_SD * size, 1e-12) if g == 0 else _LEAST_TORQUE_SD
        if not equations.known[g]:
            least[g] = floor / np.sqrt((equations.sd[:, mine] ** 2).mean())
    return least


def _covariance(equations: ActivationEquations, factor: FloatArray, J: FloatArray) -> FloatArray:
    """Covariance of each condition's outputs, (P, r, r): own errors and its activations' errors."""
    own = (factor[equations.group] * equations.sd) ** 2
    spread = J * equations.activation_sd[:, None, :]
    # S (r, r) = diag(sd^2) + J (r, m) diag(sd_alpha^2) J^T
    return own[:, :, None] * np.eye(own.shape[1]) + spread @ spread.transpose(0, 2, 1)


def _activations(
    equations: ActivationEquations, factor: FloatArray, J: FloatArray, off: FloatArray
) -> FloatArray:
    """The true activations of largest likelihood, given what is left of the outputs (P, r)."""
    S = _covariance(equations, factor, J)
    # alpha = measured + D J^T S^-1 off
    pulled = np.einsum("prm,pr->pm", J, np.linalg.solve(S, off[..., None])[..., 0])
    return equations.activation + equations.activation_sd**2 * pulled


def _group_scales(error: FloatArray, Xw: FloatArray, equations: ActivationEquations) -> FloatArray:
    """Root mean square of whitened residuals of each group, per degree of freedom, (2,)."""
    Q = np.linalg.qr(Xw)[0]
    spent = (Q**2).sum(axis=1)[: error.size].reshape(error.shape)
    scales = np.ones(2)
    for g in np.unique(equations.group):
        mine = equations.group == g
        spare = max(error[:, mine].size - spent[:, mine].sum(), 1e-9)
        scales[g] = np.sqrt((error[:, mine] ** 2).sum() / spare)
    return scales
