"""Evidence of a filmed swing: what a torque that the model lacks would do to it.

The steps from one sample to the next are linear in any small torque. Columns: the model's own, the
stiffness's terms of second and third order, gravity's torque (which a wrong clock or a wrong place
of the mass makes larger or smaller), and slow torque, linear between nodes and of any size.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.joint.relaxed.doubts.evidence import RowEvidence, WhiteningNoise
from armimpedance.joint.relaxed.equations import Terms
from armimpedance.joint.relaxed.samples import SUBSTEPS, PassiveSamples, harmonics_at
from armimpedance.joint.relaxed.swing import linearised, push_ratios, settled, swings_of

#: Seconds between nodes of a slow torque; more where a trial would have over `_MOST`.
_NODE_S: Final = 0.25
_MOST: Final = 60
#: Sizes of the slow torque that are tried, N m.
_SIZES: Final = 10 ** np.linspace(-2.5, 0.5, 7)


def swing_evidence(samples: PassiveSamples, terms: Terms) -> RowEvidence:
    """White rows of the swings of a single joint, by the model's columns and what it may lack.

    `samples`: with the hinge's dynamics.
    `terms`: with a free rest angle.
    Raises EstimationError, NotIdentifiableError, InputError: as `solve_swing`.
    """
    found = settled(samples, terms)
    swings = swings_of(samples, terms)
    linear = linearised(swings, found.fit.parameters, found.states, found.fit.sd)
    more = replace(terms, quadratic=True, cubic=True)
    names = (*terms.columns, *(n for n in more.columns if n not in terms.columns), "gravity")
    phi = _torques(found.states, terms, _gravity(samples))
    slow = _nodes(samples, len(found.states) - 1)
    T, p, e, H = swings.seen.shape[1], len(terms.columns), phi.shape[2], slow.shape[1]

    # columns: slow torque, the model's parameters, what it lacks, what is left, two starts
    m = H + p + e + 1 + 2
    inputs = np.zeros((len(slow), T, 2, m))
    push = linear.steps.push[..., None]
    inputs[..., :H] = push * slow[:, None, None, :]
    inputs[..., H : H + p] = -linear.by_parameters
    inputs[..., H + p : H + p + e] = push * phi[:, :, None, :]
    inputs[..., H + p + e] = linear.jump
    measured, start = np.zeros((*swings.seen.shape, m)), np.zeros((T, 2, m))
    measured[..., H + p + e] = swings.measured - found.states[..., 0]
    start[:, [0, 1], [m - 2, m - 1]] = -1.0
    ratios = push_ratios(linear)[::2]
    rows, lost = linear.steps.whiten(measured, inputs, start, ratios)
    rows[..., H + p + e] += rows[..., H : H + p] @ found.fit.parameters
    count = int(swings.seen.sum()) - 2 * T
    return RowEvidence(names, tuple(_noises(rows, lost, H, p, count)), count)


def _gravity(samples: PassiveSamples) -> FloatArray:
    """Mean harmonics (T, 5) of the hinge's torque in each trial.

    Gravity alone: what the other coordinates' acceleration adds has a mean of zero.
    """
    parts = samples.hinges[0].coefficients if samples.hinges else ()
    return np.stack([c[:: 2 * SUBSTEPS, 2:].mean(axis=0) for c in parts])


def _torques(states: FloatArray, terms: Terms, gravity: FloatArray) -> FloatArray:
    """Torques (S - 1, T, e) that the model may lack, at the middle of each step."""
    q = (states[:-1, :, 0] + states[1:, :, 0]) / 2
    columns = [] if terms.quadratic else [q**2]
    columns += [q**3, (harmonics_at(q) * gravity).sum(axis=-1)]
    return np.stack(columns, axis=-1)


def _nodes(samples: PassiveSamples, steps: int) -> FloatArray:
    """Hats (S - 1, H) in time, at every step's middle."""
    t = (np.arange(steps) + 0.5) / samples.sample_rate_hz
    end = steps / samples.sample_rate_hz
    count = int(np.clip(np.ceil(end / _NODE_S), 2, _MOST))
    nodes = np.linspace(0, end, count + 1)
    return np.asarray(np.maximum(0, 1 - np.abs(t[:, None] - nodes) / (end / count)))


def _noises(
    rows: FloatArray, lost: FloatArray, H: int, p: int, count: int
) -> Iterator[WhiteningNoise]:
    """Noises with and without slow torque, from white rows (V, T, S, H + m + 1 + 2).

    The first p of the m columns are the model's own.
    """
    V, T, S, width = rows.shape
    # starts first, so that they leave the others; then slow torque, the columns, what is left
    order = np.concatenate([[width - 2, width - 1], np.arange(width - 2)])
    padded = np.pad(rows[..., order], ((0, 0), (0, 0), (0, max(width - S, 0)), (0, 0)))
    R: FloatArray = np.asarray(np.linalg.qr(padded, mode="r"))
    starts = 2 * np.log(np.abs(np.diagonal(R, axis1=-2, axis2=-1))[..., :2]).sum(axis=(1, 2))
    for triangle, log in zip(R[..., 2:, 2:], lost + starts, strict=True):
        Z, X = triangle[..., :H], triangle[..., H:]
        norm = float(np.median(np.linalg.norm(Z, axis=1)))
        bump = 1 / norm if norm > 0 else float("inf")
        yield WhiteningNoise(X.reshape(T * X.shape[1], -1), float(log), 0.0, bump)
        Q, e = _residual(X, p)
        sigma = max(float(np.sqrt((e**2).sum() / count)), 1e-12)
        largest, left = _without_bumps(Z, X, Q, e)
        # a bump of any place in each trial: what the best of H gains by chance
        price = T * (1 + 2 * float(np.log(H)))
        yield WhiteningNoise(left, float(log) + price, largest / sigma, bump)
        for size in _SIZES / sigma:
            yield _with_walk(triangle, H, float(size), float(log), bump)


def _with_walk(
    triangle: FloatArray, H: int, size: float, log: float, bump: float
) -> WhiteningNoise:
    """Slow torque u (T, H) ~ N(0, size^2 s^2) at all nodes, from rows (T, r, H + m + 1)."""
    T, _, width = triangle.shape
    prior = np.zeros((T, H, width))
    prior[:, np.arange(H), np.arange(H)] = 1 / size
    # rows [Z (r, H), X (r, m + 1); 1 / size, 0] = Q R, and Z is projected out of the rows below
    stacked = np.concatenate([triangle, prior], axis=1)
    R: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
    own = np.abs(np.diagonal(R, axis1=-2, axis2=-1))[:, :H]
    kept = R[:, H:, H:]
    lost = log + 2 * float(np.log(own * size).sum())
    return WhiteningNoise(kept.reshape(T * kept.shape[1], -1), lost, size, bump)


def _residual(X: FloatArray, p: int) -> tuple[FloatArray, FloatArray]:
    """Q (T, r, c) of the model's columns of X (T, r, m + 1), and what they leave of the last."""
    T, r, _ = X.shape
    flat = X.reshape(T * r, -1)
    Q: FloatArray = np.asarray(np.linalg.qr(flat[:, :p], mode="reduced")[0])
    e = flat[:, -1] - Q @ (Q.T @ flat[:, -1])
    return Q.reshape(T, r, -1), e.reshape(T, r)


def _without_bumps(
    Z: FloatArray, X: FloatArray, Q: FloatArray, e: FloatArray
) -> tuple[float, FloatArray]:
    """Size of the largest bump, and rows X less, in each trial, the bump that explains most."""
    T, r, _ = Z.shape
    # of every bump: what it shares with the residual, and its length beside the model's columns
    shared = np.einsum("trh,tr->th", Z, e)
    whole = (Z**2).sum(axis=1)
    length = whole - (np.einsum("trh,trc->thc", Z, Q) ** 2).sum(axis=-1)
    length = np.maximum(length, 1e-6 * whole + np.finfo(np.float64).tiny)
    best, at = (shared**2 / length).argmax(axis=1), np.arange(T)
    z = Z[at, :, best]
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    left = X - z[:, :, None] * np.einsum("tr,trc->tc", z, X)[:, None, :]
    sizes = np.abs(shared[at, best]) / length[at, best]
    return float(sizes.max()), left.reshape(T * r, -1)
