"""R, E, leave-one-condition-out R and null R of an activation model, element by element."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.muscles.models.activation.equations import ActivationEquations, SolvedEquations
from armimpedance.muscles.models.least_squares import least_squares_in
from armimpedance.muscles.models.quality import ElementQuality, correlations, element_quality
from armimpedance.muscles.models.rows import ELEMENTS

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

    Parameters
    ----------
    symbol : {"K", "B"}
    equations, solved : the fit
    cone : (p, g) or None
        Cone of the fit.
    seed : int
        Seed of the shuffles.
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
