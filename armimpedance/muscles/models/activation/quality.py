"""R, E, leave-one-condition-out R and null R of an activation model, element by element."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.checks import RANK_TOLERANCE, check_rows
from armimpedance.muscles.models.activation.equations import (
    ActivationEquations,
    SolvedEquations,
    powers,
)
from armimpedance.muscles.models.fitted_model import ElementQuality, correlations, element_quality
from armimpedance.muscles.models.least_squares import least_squares_in
from armimpedance.muscles.models.packed import triple
from armimpedance.muscles.models.rows import ELEMENTS, JointRows

#: Shuffles of the conditions for the null R; a bounded fit is solved again for each.
SHUFFLES, BOUNDED_SHUFFLES = 200, 20


def activation_quality(
    symbol: str,
    equations: ActivationEquations,
    solved: SolvedEquations,
    cone: FloatArray | None,
    seed: int,
) -> tuple[ElementQuality, ...]:
    """Quality of ss, se, ee of K or B.

    Left-out and shuffled conditions are fitted with the weights and activations of the whole fit.

    `cone` (p, g) or None: cone of the fit.
    `seed`: seed of the shuffles.
    """
    measured = equations.outputs[:, :3]
    X = equations.columns(equations.activation)[:, :3]
    k = X.shape[-1]
    fitted = X @ solved.theta[:k]
    left_out = _left_out(solved, cone, equations.n_free)
    held_out = np.einsum("pij,pj->pi", X, left_out[:, :k])
    null = _null(equations, solved, cone, seed)
    coefficients = 1 + _spent(equations.patterns) * equations.order
    return tuple(
        element_quality(
            f"{symbol}_{element}",
            measured[:, e],
            fitted[:, e],
            held_out=held_out[:, e],
            null_r=float(null[e]),
            coefficients=float(coefficients[e]),
        )
        for e, element in enumerate(ELEMENTS)
    )


def _spent(patterns: FloatArray) -> FloatArray:
    """Muscles that count for each element: one that serves three elements counts a third each."""
    serves = patterns != 0
    return np.asarray((serves / serves.sum(axis=1, keepdims=True)).sum(axis=0))


def _left_out(solved: SolvedEquations, cone: FloatArray | None, n_free: int) -> FloatArray:
    """Theta (P, p) of the fits without each condition."""
    P, r, p = solved.design.shape
    Xw, yw = solved.whitened
    rows = np.arange(P * r).reshape(P, r)
    if cone is not None:
        others = np.arange(P * r, len(yw))
        keep = [np.append(np.delete(rows, k, axis=0), others) for k in range(P)]
        return np.array([least_squares_in(Xw[k], yw[k], cone, n_free) for k in keep])
    # theta_(p) = theta - C X_p^T (I - H_p)^-1 e_p, C (p, p), X_p (r, p), H_p (r, r)
    C = solved.covariance
    blocks = Xw[: P * r].reshape(P, r, p)
    error = (yw - Xw @ solved.theta)[: P * r].reshape(P, r)
    rest = np.eye(r) - blocks @ C @ blocks.transpose(0, 2, 1)
    # a condition that alone decides a coefficient cannot be left out: pinv leaves that one alone
    step = (np.linalg.pinv(rest) @ error[..., None])[..., 0]
    return solved.theta - np.einsum("ij,prj,pr->pi", C, blocks, step)


def _null(
    equations: ActivationEquations,
    solved: SolvedEquations,
    cone: FloatArray | None,
    seed: int,
) -> FloatArray:
    """Mean R (3,) of fits to conditions whose outputs were shuffled against the activations."""
    rng = np.random.default_rng(seed)
    count = SHUFFLES if cone is None else BOUNDED_SHUFFLES
    y, X = equations.outputs, equations.columns(equations.activation)
    Xw, _ = solved.whitened
    orders = np.array([rng.permutation(len(y)) for _ in range(count)])
    yw = np.einsum("pij,spj->spi", solved.weight, y[orders]).reshape(count, -1)
    yw = np.hstack([yw, np.zeros((count, len(solved.prior)))])
    if cone is None:
        thetas = least_squares_in(Xw, yw.T, None, equations.n_free).T
    else:
        thetas = np.array([least_squares_in(Xw, one, cone, equations.n_free) for one in yw])
    fits = np.einsum("pej,sj->spe", X[:, :3], thetas[:, : X.shape[-1]])
    return np.array([correlations(y[orders, e], fits[:, :, e]).mean() for e in range(3)])


# The source's Table 2: each element of K and B as a polynomial of activations by itself.
#
# Moment arms are constant in experiments 2 and 3 (Tsuji 1997, section 5.3), so each element of
# (33)-(35) with (38) is linear in products such as ``d_1s^2 c_1k``. The printed R and E obey ``R =
# sqrt(1 - E / E_0)`` with one E_0 per element in all eighteen entries: that holds for a least-
# squares fit of each element by itself, with products of its own, and not for coefficients c_ik
# that the three elements share. No moment arm is needed beyond which joints a muscle spans; nothing
# is said of single muscles, and three elements fitted apart may be no stiffness that muscles can
# make. `activation.fit` has the model with shared coefficients.

#: Shuffles of the rows for the null R.
_SHUFFLES = 200
#: A muscle whose part in an element is below this part of the largest does not act on it.
_NO_PART = 1e-9


def element_fits(
    rows: JointRows, arm: MuscularArm, *, order: int, seed: int = 0
) -> tuple[ElementQuality, ...]:
    """Quality of the separate fits of K_ss, K_se, K_ee, B_ss, B_se, B_ee.

    Parameters
    ----------
    rows : JointRows
        P conditions at one posture, with activations.
    arm : MuscularArm
        Says which muscles act on which element.
    order : int
        N, from 1.
    seed : int
        Seed of the shuffles behind the null R.

    Returns
    -------
    tuple of ElementQuality

    Raises
    ------
    InputError
        Rows without activation, at more than one posture, or an order below 1.
    NotIdentifiableError
        Conditions that cannot tell the terms of an element apart.
    """
    if isinstance(order, bool) or order != int(order) or order < 1:
        raise InputError(f"order {order} of the activation model", expected="1 or more")
    rows = rows.of_muscles(arm.paths.muscles)
    alpha, q = check_rows(rows, arm, torque=False)
    G = arm.paths.moment_arms(q)
    acts = np.abs(triple(G[:, :, None] * G[:, None, :]))
    acting = acts > _NO_PART * acts.max()
    rng = np.random.default_rng(seed)
    shuffles = np.array([rng.permutation(len(alpha)) for _ in range(_SHUFFLES)])
    quality = []
    for symbol, measured in (("K", rows.stiffness), ("B", rows.viscosity)):
        y = triple(measured)
        for e, element in enumerate(ELEMENTS):
            name = f"{symbol}_{element}"
            W = _columns(name, alpha[:, acting[:, e]], order)
            quality.append(_judged(name, W, y[:, e], shuffles))
    return tuple(quality)


def _columns(name: str, alpha: FloatArray, order: int) -> FloatArray:
    """Orthonormal columns (P, p) that span 1 and the powers of the acting muscles."""
    W = np.hstack([np.ones((len(alpha), 1)), powers(alpha, order).reshape(len(alpha), -1)])
    length = np.linalg.norm(W, axis=0)
    U, s, _ = np.linalg.svd(W / np.where(length > 0, length, 1.0), full_matrices=False)
    rank = int((s > RANK_TOLERANCE * s[0]).sum())
    if rank < W.shape[1]:
        raise NotIdentifiableError(
            f"{name}: {len(alpha)} conditions tell {rank} of {W.shape[1]} terms at order {order}: "
            "more conditions of other patterns or a lower order"
        )
    return np.asarray(U)


def _judged(name: str, U: FloatArray, y: FloatArray, shuffles: np.ndarray) -> ElementQuality:
    fitted = U @ (U.T @ y)
    spare = 1 - (U**2).sum(axis=1)
    # y less the prediction without the own row: the residual over 1 - h; a row with h = 1 has none
    tells = spare > _NO_PART
    held_out = y - (y - fitted) / np.where(tells, spare, 1.0)
    shuffled = y[shuffles]
    null = correlations(shuffled, shuffled @ U @ U.T).mean()
    return element_quality(
        name,
        y,
        fitted,
        held_out=held_out if tells.all() else None,
        null_r=float(null),
        coefficients=float(U.shape[1]),
    )
