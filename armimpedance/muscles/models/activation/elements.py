"""The source's Table 2: each element of K and B as a polynomial of activations by itself.

Moment arms are constant in experiments 2 and 3 (Tsuji 1997, section 5.3), so each element of
(33)-(35) with (38) is linear in products such as ``d_1s^2 c_1k``. The printed R and E obey
``R = sqrt(1 - E / E_0)`` with one E_0 per element in all eighteen entries: that holds for a
least-squares fit of each element by itself, with products of its own, and not for coefficients c_ik
that the three elements share. No moment arm is needed beyond which joints a muscle spans; nothing
is said of single muscles, and three elements fitted apart may be no stiffness that muscles can
make. `activation.fit` has the model with shared coefficients.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm import MuscularArm
from armimpedance.muscles.models.activation.checks import check_rows
from armimpedance.muscles.models.activation.design import powers
from armimpedance.muscles.models.activation.rank import RANK_TOLERANCE
from armimpedance.muscles.models.packed import triple
from armimpedance.muscles.models.quality import ElementQuality, correlations, element_quality
from armimpedance.muscles.models.rows import ELEMENTS, JointRows

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
