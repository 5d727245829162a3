"""Fit muscle stiffness and viscosity over activation at one posture (Tsuji 1997, section 5.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.core.findings import Finding
from armimpedance.core.progress import Progress, Steps
from armimpedance.limb.arm import MuscularArm, arm_named
from armimpedance.muscles.models.activation.checks import activation_rank, check_rows
from armimpedance.muscles.models.activation.equations import (
    ActivationEquations,
    SolvedEquations,
    muscle_patterns,
    solve_equations,
)
from armimpedance.muscles.models.activation.misfit import ActivationMisfit, misfit_of
from armimpedance.muscles.models.activation.model import ActivationModel, activation_result
from armimpedance.muscles.models.activation.models import ACTIVATION_MODELS, ActivationMethod
from armimpedance.muscles.models.activation.quality import activation_quality
from armimpedance.muscles.models.changed_gain import WhiteRows, gain_change
from armimpedance.muscles.models.fitted_model import ElementQuality
from armimpedance.muscles.models.rows import JointRows, spread_of

# Polynomials in Bernstein form: coefficients that are nonnegative make a curve that is.
#
# ``f(alpha) = sum_k beta_k C(N, k) s^k (1 - s)^(N - k)``, ``s = (alpha - low) / (high - low)``. The
# curve stays between its least and its largest coefficient for s in 0..1, and rises where the
# coefficients do: bounds on the coefficients are bounds on the curve, over the whole range and not
# only at measured points.


def bernstein_basis(s: ArrayLike, order: int) -> FloatArray:
    """The N + 1 Bernstein polynomials at s (...,), as (..., N + 1)."""
    x = np.asarray(s, dtype=float)[..., None]
    k = np.arange(order + 1)
    return np.array([comb(order, i) for i in k]) * x**k * (1 - x) ** (order - k)


def bernstein_slopes(s: ArrayLike, order: int) -> FloatArray:
    """Their derivatives by s, (..., N + 1): ``N (b_{k-1, N-1} - b_{k, N-1})``."""
    below = bernstein_basis(s, order - 1) if order else np.zeros((*np.shape(s), 0))
    nothing = np.zeros((*below.shape[:-1], 1))
    left, right = np.concatenate([nothing, below], -1), np.concatenate([below, nothing], -1)
    return order * (left - right)


def to_powers(low: float, high: float, order: int) -> FloatArray:
    """Matrix (N + 1, N + 1) from Bernstein coefficients over low..high to powers of alpha.

    ``f(alpha) = sum_j a_j alpha^j`` with ``a = to_powers(low, high, N) @ beta``.
    """
    width = high - low
    columns = []
    for k in range(order + 1):
        # C(N, k) s^k (1 - s)^(N - k), each factor a polynomial of alpha
        rising = np.polynomial.Polynomial([-low / width, 1 / width]) ** k
        falling = np.polynomial.Polynomial([high / width, -1 / width]) ** (order - k)
        column = np.zeros(order + 1)
        coefficients = (comb(order, k) * rising * falling).coef
        column[: len(coefficients)] = coefficients
        columns.append(column)
    return np.stack(columns, axis=1)


def increments(order: int, *, increasing: bool) -> FloatArray:
    """Matrix (N + 1, N + 1) from numbers >= 0 to the coefficients.

    The coefficients themselves, or, for a curve that never falls, the running sum of them.
    """
    n = order + 1
    return np.tri(n) if increasing else np.eye(n)


#: Orders N of the source's Table 2, and what is refused beyond.
HIGHEST_ORDER: Final = 5
#: Rounds of, and a relative change that ends, the search for the stiffness per tension.
_KAPPA_ROUNDS, _KAPPA_SETTLED = 50, 1e-4


def fit_activation_model(
    rows: JointRows,
    arm: MuscularArm | str = "planar6",
    *,
    order: int = 1,
    model: str | None = None,
    torque: bool = False,
    increasing: bool = False,
    curvature: bool = True,
    seed: int = 0,
    torque_sd: float | ArrayLike | None = None,
    stiffness_per_tension: float | Literal["fit"] | None = None,
    proportion_sd: float = 0.1,
    progress: Progress | None = None,
) -> ActivationModel:
    """Fit ``K_j(alpha) = sum_i f_i(alpha_i) A_i``, f_i of order N, and B_j likewise.

    Tsuji (1997), eqs. (11), (31), (33)-(35), (38); `activation.design` has the equations.

    Parameters
    ----------
    rows : JointRows
        P conditions at one posture, with activations.
    arm : MuscularArm or str
        A name such as "planar6", or the path of a table of moment arms, stands for its arm.
        Moment arms, curvature, stiffness per tension.
    order : int
        N, from 1.
    model : {"polynomial", "bernstein"}, optional
        Default: polynomial.
    torque : bool
        Add ``tau = tau_0 - G^T t`` with tension t in proportion to the active stiffness, and
        tau_0 free: it needs `stiffness_per_tension`.
    increasing : bool
        Stiffness and viscosity of a muscle never fall as it becomes more active (bernstein only).
    curvature : bool
        False leaves out what tension adds through the curvature of the muscles' lengths, as the
        source does.
    seed : int
        Seed of the shuffles behind the null R.
    torque_sd : float or (P, 2), optional
        Standard error of the torque rows, N m; without it, found from the residuals: that muscles
        pull in proportion to their stiffness is less exact than any sensor.
    stiffness_per_tension : float or "fit", optional
        1/m; default: the arm's. "fit" finds it from stiffness and torque together.
    proportion_sd : float
        Standard deviation of single muscles about `stiffness_per_tension`, as a part of it. It
        also covers the errors of the moment arms.

    progress : function, optional
        Called with what is done and what there is to do.

    Returns
    -------
    ActivationModel

    Raises
    ------
    InputError
        Rows without activation or (where asked) torque, at more than one posture, an unknown
        model or order.
    NotIdentifiableError
        Conditions that cannot tell the muscles apart.
    EstimationError
        The fit does not settle.
    """
    arm, kind = arm_named(arm), _method(model, order, increasing)
    rows = rows.of_muscles(arm.paths.muscles)
    alpha, q = check_rows(rows, arm, torque=torque)
    kappa = _kappa(arm, stiffness_per_tension, torque=torque)
    of_K = _equations(rows, alpha, "K", order, kappa, _patterns(arm, q, curvature, kappa))
    if torque:
        G = arm.paths.moment_arms(q)
        of_K = _with_torque(of_K, rows, G, torque_sd, proportion_sd)
    of_B = _equations(rows, alpha, "B", order, kappa, _patterns(arm, q, False, kappa))
    rank = activation_rank(of_K, arm.paths.muscles)
    if stiffness_per_tension == "fit":
        of_K = _fitted_kappa(of_K, arm, q, kind, curvature, increasing)
    cones = [_cone(e, increasing) if kind.bounded else None for e in (of_K, of_B)]
    steps, solved = Steps(progress, 4), []
    quality: list[ElementQuality] = []
    for equations, cone in zip((of_K, of_B), cones, strict=True):
        solved.append(solve_equations(equations, cone))
        steps.step()
    for symbol, equations, one, cone in zip("KB", (of_K, of_B), solved, cones, strict=True):
        quality += activation_quality(symbol, equations, one, cone, seed)
        steps.step()
    solutions, misfits, session = _with_doubts(
        (of_K, of_B), solved, rows, arm, q, moved=not kind.bounded
    )
    return activation_result(
        kind.name, arm, q, (of_K, of_B), solutions, rank, tuple(quality), misfits, session
    )


def _with_doubts(
    equations: tuple[ActivationEquations, ActivationEquations],
    solved: Sequence[SolvedEquations],
    rows: JointRows,
    arm: MuscularArm,
    q: FloatArray,
    *,
    moved: bool,
) -> tuple[
    tuple[SolvedEquations, SolvedEquations],
    tuple[ActivationMisfit, ActivationMisfit],
    tuple[Finding, ...],
]:
    """K's and B's solutions with intervals that hold lack of fit, shared errors, changed gains.

    `moved`: whether a lack of fit moves the solution, too; one that is bounded stays where it is.
    """
    (of_K, of_B), (K, B) = equations, solved
    G = arm.paths.moment_arms(q)
    misfits = misfit_of(of_K, K, G), misfit_of(of_B, B, G)
    spreads = [
        _shared_spread(one, rows.shared(symbol)) for symbol, one in zip("KB", solved, strict=True)
    ]
    changed = gain_change(_white(of_K, K))
    session = () if changed is None else (changed.finding(arm.paths.muscles, rows.labels),)
    if changed is not None and changed.seen:
        spreads[0] = spreads[0] + changed.spread
    K, B = (
        misfit.allowed_for(one, moved=moved) for one, misfit in zip((K, B), misfits, strict=True)
    )
    K, B = (
        replace(one, covariance=one.covariance + more)
        for one, more in zip((K, B), spreads, strict=True)
    )
    return (K, B), (misfits[0].widened(spreads[0]), misfits[1].widened(spreads[1])), session


def _shared_spread(solved: SolvedEquations, shared: FloatArray) -> FloatArray:
    """Covariance of theta that errors (s, P, 3) shared by all rows add."""
    outputs = solved.weight.shape[-1]
    beside_torque = np.pad(shared, ((0, 0), (0, 0), (0, outputs - shared.shape[-1])))
    design = solved.weight @ solved.design
    return spread_of(solved.covariance, design, solved.weight, beside_torque)


def _white(equations: ActivationEquations, solved: SolvedEquations) -> WhiteRows:
    """The solved equations as rows that are asked for a change of an EMG channel's gain."""
    design = solved.weight @ solved.design
    residual = solved.target - solved.design @ solved.theta
    slopes = equations.slopes(solved.activation, solved.theta) * solved.activation[:, None, :]
    m, order = len(equations.patterns), equations.order
    return WhiteRows(
        design,
        np.einsum("pij,pj->pi", solved.weight, residual),
        solved.theta,
        solved.covariance,
        solved.weight @ slopes,
        3 + np.arange(m * order).reshape(m, order),
    )


def _kappa(arm: MuscularArm, requested: float | str | None, *, torque: bool) -> float:
    """Stiffness per tension (1/m) to start from."""
    if requested == "fit" and not torque:
        raise InputError("stiffness per tension to fit without torque", expected="torque=True")
    kappa = arm.stiffness_per_tension if requested is None or requested == "fit" else requested
    if not isinstance(kappa, int | float) or not (np.isfinite(kappa) and kappa > 0):
        raise InputError(
            f"stiffness per tension {kappa}", expected='a positive number, 1/m, or "fit"'
        )
    return float(kappa)


def _fitted_kappa(
    equations: ActivationEquations,
    arm: MuscularArm,
    q: FloatArray,
    kind: ActivationMethod,
    curvature: bool,
    increasing: bool,
) -> ActivationEquations:
    """The same equations with the stiffness per tension of largest likelihood.

    A common factor 1 + e on all tensions is free; kappa / (1 + e) takes its place until e is zero.

    Raises EstimationError: it does not settle.
    """
    now = replace(equations, free_proportion=True)
    for _ in range(_KAPPA_ROUNDS):
        solved = solve_equations(now, _cone(now, increasing) if kind.bounded else None)
        e = float(solved.theta[-1])
        if not e > -1:
            break
        if abs(e) < _KAPPA_SETTLED:
            return now
        kappa = now.stiffness_per_tension / (1 + e)
        patterns = _patterns(arm, q, curvature, kappa)
        now = replace(now, stiffness_per_tension=kappa, patterns=patterns)
    raise EstimationError("the stiffness per tension does not follow from these torques")


def _method(model: str | None, order: int, increasing: bool) -> ActivationMethod:
    method = ACTIVATION_MODELS.named(model)
    if isinstance(order, bool) or order != int(order) or not 1 <= order <= HIGHEST_ORDER:
        raise InputError(f"order {order} of the activation model", expected=f"1 to {HIGHEST_ORDER}")
    if increasing and not method.bounded:
        raise InputError(
            f"the {method.name} model cannot promise to increase", expected="bernstein"
        )
    return method


def _patterns(arm: MuscularArm, q: FloatArray, curvature: bool, kappa: float) -> FloatArray:
    return muscle_patterns(arm, q, curvature=curvature, stiffness_per_tension=kappa)


def _equations(
    rows: JointRows,
    alpha: FloatArray,
    symbol: str,
    order: int,
    kappa: float,
    patterns: FloatArray,
) -> ActivationEquations:
    """The equations of K or B, without torque."""
    y, sd = rows.elements(symbol)
    exact = np.zeros_like(alpha)
    return ActivationEquations(
        activation=alpha,
        activation_sd=exact if rows.activation_sd is None else rows.activation_sd,
        outputs=y,
        sd=np.ones_like(y) if sd is None else sd,
        group=np.zeros(3, dtype=int),
        known=(sd is not None, False),
        patterns=patterns,
        order=order,
        moment_arms=None,
        stiffness_per_tension=kappa,
    )


def _with_torque(
    equations: ActivationEquations,
    rows: JointRows,
    G: FloatArray,
    torque_sd: float | ArrayLike | None,
    proportion_sd: float,
) -> ActivationEquations:
    torque = np.asarray(rows.torque)
    sd = np.broadcast_to(1.0 if torque_sd is None else torque_sd, torque.shape)
    if not (np.isfinite(sd).all() and (sd > 0).all()):
        raise InputError("a torque_sd that is not positive", expected="more than 0 N m")
    if not (np.isfinite(proportion_sd) and proportion_sd > 0):
        raise InputError(f"proportion_sd {proportion_sd}", expected="a positive number")
    return replace(
        equations,
        outputs=np.hstack([equations.outputs, torque]),
        sd=np.hstack([equations.sd, sd]),
        group=np.array([0, 0, 0, 1, 1]),
        known=(equations.known[0], torque_sd is not None),
        moment_arms=G,
        proportion_sd=proportion_sd,
    )


def _cone(equations: ActivationEquations, increasing: bool) -> FloatArray:
    """Matrix (3 + m N, m (N + 1) + 2) from numbers >= 0 to ``K_0`` and the powers' coefficients.

    The last two are the passive stiffness of shoulder and elbow, which no muscle has to make.
    """
    patterns, N = equations.patterns, equations.order
    low, high = equations.activation.min(axis=0), equations.activation.max(axis=0)
    m = len(patterns)
    cone = np.zeros((3 + m * N, m * (N + 1) + 2))
    cone[0, -2] = cone[2, -1] = 1.0
    for i in range(m):
        powers_of = to_powers(low[i], high[i], N) @ increments(N, increasing=increasing)
        mine = slice(i * (N + 1), (i + 1) * (N + 1))
        cone[:3, mine] = np.outer(patterns[i], powers_of[0])
        cone[3 + i * N : 3 + (i + 1) * N, mine] = powers_of[1:]
    return cone
