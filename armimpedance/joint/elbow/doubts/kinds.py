"""Fit one kind of limb over all pathways that its answer may have.

A kind is linear in all parameters but delay and time constant. In every cell of `pathway` these two
are linearised about the cell's middle, with the cell's size as prior: pathways between the middles
are covered too, however precise the record.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.joint.elbow.doubts.pathway import (
    PathwayCells,
    ReflexArc,
    all_cells,
    not_excluded,
    response,
)
from armimpedance.joint.elbow.doubts.record import Posed, fit_models
from armimpedance.joint.elbow.stationary.band import Complex, real_rows

#: Prior sizes, s and shares of K, so wide that they matter only for an uninformative record.
_ANY_LATENESS_S: Final = 20e-3
_ANY_ANSWER: Final = 3.0
#: Time that converts a gain of the deflection to one of the velocity, s.
RATE_S: Final = 0.1
#: Columns per pathway: of K_r, of B_r, and of their derivatives by delay and time constant.
_SHAPES: Final = 5
#: Height that is used for a cell without height, s.
_POINT_S: Final = 1e-9


class Kind(NamedTuple):
    """Additions to I, B and K: a lateness of the angle; motions that the limb answers, see
    `ANSWERS`.
    """

    late_angle: bool
    answers: tuple[int, ...]

    @property
    def further(self) -> int:
        """Number of parameters beside I, B, K."""
        return self.late_angle + len(self.answers)


#: Motions that a limb may answer: none, the deflection (0), its velocity (1), both.
ANSWERS: Final = ((), (0,), (1,), (0, 1))
#: All kinds: angle in step or late, with each of these answers.
KINDS: Final = tuple(Kind(late, answers) for late in (False, True) for answers in ANSWERS)
UNANSWERED: Final = tuple(kind for kind in KINDS if not kind.answers)


@dataclass(frozen=True, eq=False)
class KindFit:
    """Fit of one kind over m pathways; a kind without an answer has one dummy pathway.

    `values` (m, p): I, B, K, then those of T, K_r, B_r and the bends that the kind has.
    `information` (m, p, p), `deviance` (m,): as in `record.WhittleFit`, weighted by the residual
    spectrum of the best pathway.
    `eta` (n,): logarithm of that spectrum over the reference power.
    `delay_s`, `muscle_s`, `belief` (m,): of the pathways, and the prior probability of each.
    """

    values: FloatArray
    information: FloatArray
    deviance: FloatArray
    eta: FloatArray
    delay_s: FloatArray
    muscle_s: FloatArray
    belief: FloatArray

    def pathway(self, number: int) -> ReflexArc:
        """Pathway of model `number`."""
        return ReflexArc(float(self.delay_s[number]), float(self.muscle_s[number]))


@dataclass(frozen=True, eq=False)
class Columns:
    """Columns of a kind of limb.

    `chosen` (q,): indices of the columns of `Posed.X`.
    `bound` (p,): one over the prior variance of each parameter; 0 = no prior.
    `order` (p,): index of each parameter in the chosen columns followed by those of the answers.
    """

    kind: Kind
    chosen: IntArray
    bound: FloatArray
    order: IntArray

    def of(self, rows: Posed, pathway: ReflexArc) -> FloatArray:
        """All columns of one model, (n, 2, p)."""
        X = rows.X[..., self.chosen]
        if self.kind.answers:
            late = rows.late(pathway)[..., list(self.kind.answers)]
            X = np.concatenate([X, late], axis=2)
        return np.asarray(X[..., self.order])


def columns_of(kind: Kind, stiffness: float, bends: tuple[int, ...]) -> Columns:
    """Select the columns of a kind.

    `stiffness`: approximate K, which scales the prior of the answers. `bends`: numbers of the terms
    of amplitude.
    """
    first = 3 + kind.late_angle
    chosen = np.r_[:first, 4 + np.array(bends, dtype=int)]
    sizes = _ANY_ANSWER * stiffness * np.array([1.0, RATE_S])
    answers, q = list(kind.answers), len(chosen)
    bound = np.zeros(3 + kind.further + len(bends))
    bound[3:first] = _ANY_LATENESS_S**-2
    bound[first : first + len(answers)] = sizes[answers] ** -2
    return Columns(kind, chosen, bound, np.r_[:first, q : q + len(answers), first:q])


def fitted(rows: Posed, columns: Columns, rough: KindFit) -> KindFit:
    """Fit one kind over all pathways that the record does not exclude.

    `rough`: its rough fit; the residual spectrum of its best pathway weights all pathways.
    """
    if not columns.kind.answers:
        return rough

    def evaluate(some: PathwayCells) -> list[FloatArray]:
        return list(_over(columns, Products.of(rows, some, rough.eta), some))

    cells, evaluated = not_excluded(all_cells(), evaluate)
    return _compared(rows, columns, cells, _Over(*evaluated))


def roughly(rows: Posed, columns: Columns, products: Products, cells: PathwayCells) -> KindFit:
    """Fit one kind over given cells; `products`: of these cells, weighted by the reference."""
    if not columns.kind.answers:
        return _without_answer(rows, columns)
    return _compared(rows, columns, cells, _over(columns, products, cells))


def _without_answer(rows: Posed, columns: Columns) -> KindFit:
    X = columns.of(rows, ReflexArc(0.0, 0.0))
    fit = fit_models(X[None], rows.y, rows.spectrum, columns.bound)
    zero, parts = np.zeros(1), (fit.values, fit.information, fit.deviance)
    return KindFit(*parts, fit.eta[0], zero, zero, np.ones(1))


def _compared(rows: Posed, columns: Columns, cells: PathwayCells, over: _Over) -> KindFit:
    """Complete a fit: one spectrum (the best pathway's) for all pathways, one's own for each
    kind."""
    eta, own = _own(rows, columns, over.likeliest)
    deviance = own + over.deviance - over.squares[over.deviance.argmin()]
    pathways = (over.delay_s, over.muscle_s, cells.belief)
    return KindFit(over.values, over.information, deviance, eta, *pathways)


def _own(rows: Posed, columns: Columns, pathway: ReflexArc) -> tuple[FloatArray, float]:
    """Spectrum (n,) of the residual of a pathway, and its deviance."""
    fit = fit_models(columns.of(rows, pathway)[None], rows.y, rows.spectrum, columns.bound)
    return fit.eta[0], float(fit.deviance[0])


class _Over(NamedTuple):
    """Fits of D pathways: p parameters each, weighted squares (D,), likeliest pathway of each cell.

    `deviance`: the squares plus the term from integrating over the cell.
    """

    values: FloatArray
    information: FloatArray
    squares: FloatArray
    delay_s: FloatArray
    muscle_s: FloatArray
    deviance: FloatArray

    @property
    def likeliest(self) -> ReflexArc:
        """Pathway of the least deviance."""
        best = int(self.deviance.argmin())
        return ReflexArc(float(self.delay_s[best]), float(self.muscle_s[best]))


def _over(columns: Columns, products: Products, cells: PathwayCells) -> _Over:
    """Fit every pathway's parameters, with its cell as prior.

    Raises LinAlgError: a result is not finite.
    """
    products = products.with_columns(columns.chosen)
    D, a, p = len(cells), len(columns.kind.answers), len(columns.order)
    answers = np.zeros((D, _SHAPES, a))
    answers[:, list(columns.kind.answers), range(a)] = 1
    bound = np.broadcast_to(columns.bound, (D, p))
    middle = products.solved(answers, columns.order, bound)[0]
    # derivatives of (B_r s + K_r) h: by the delay -s (...) h; by m -2 s / (1 + m s) (...) h
    amplitude = np.zeros((D, 2))
    first = 3 + columns.kind.late_angle
    amplitude[:, list(columns.kind.answers)] = middle[:, first : first + a]
    slopes = np.zeros((D, _SHAPES, 2))
    slopes[:, 1:3, 0], slopes[:, 3:5, 1] = -amplitude, -2 * amplitude
    size = np.stack([cells.wide_s, np.maximum(cells.high_s, _POINT_S)], axis=1) / np.sqrt(12)
    q = len(columns.chosen)
    values, N, squares = products.solved(
        np.concatenate([answers, slopes], axis=2),
        np.r_[columns.order, q + a, q + a + 1],
        np.concatenate([bound, size**-2], axis=1),
    )
    # Information on the p parameters after the pathway is integrated over its cell
    own, across = N[:, p:, p:], N[:, :p, p:]
    information = N[:, :p, :p] - across @ np.linalg.solve(own, np.swapaxes(across, 1, 2))
    occam = np.linalg.slogdet(own * size[:, :, None] * size[:, None, :])[1]
    if not np.isfinite(squares + occam).all():
        raise np.linalg.LinAlgError("the motion of a pathway is lost in rounding")
    moved = np.clip(values[:, p:], -np.sqrt(12) * size, np.sqrt(12) * size)
    pathways = cells.delay_s + moved[:, 0], np.maximum(cells.muscle_s + moved[:, 1], 0.0)
    return _Over(values[:, :p], information, squares, *pathways, squares + occam)


def _shapes(s: Complex, cells: PathwayCells) -> Complex:
    """``h, s h, s^2 h, s h / (1 + m s), s^2 h / (1 + m s)`` of D pathways at s (b,), (b, D, 5)."""
    h, s = response(s, cells.delay_s, cells.muscle_s), s[:, None]
    slower = h / (1 + s * cells.muscle_s)
    return np.stack([h, s * h, s**2 * h, s * slower, s**2 * slower], axis=2)


@dataclass(frozen=True, eq=False)
class Products:
    """Weighted inner products of X and y (q + 1, q + 1), and of D pathways' columns.

    `gram`: of X and y. `across` (D, 5, q + 1): of the pathways' columns with X and y.
    `own` (D, 5, 5): of the pathways' columns with each other.
    """

    gram: FloatArray
    across: FloatArray
    own: FloatArray

    @classmethod
    def of(cls, rows: Posed, cells: PathwayCells, eta: FloatArray) -> Products:
        """Compute the products; `eta` (n,): logarithm of the noise power over the reference."""
        w, knots = np.exp(-eta), rows.knots
        base = np.concatenate([rows.X, rows.y[..., None]], axis=2)
        B = base[:, 0] + 1j * base[:, 1]
        moved = np.concatenate([trial.weighed for trial in rows.trials])
        # L (n, D k) = c g: motion c of each line times the pathways' response g, at knots (b, D k)
        D = len(cells)
        # Re g^H x is the real product of columns of stacked real and imaginary parts
        g = real_rows(_shapes(knots.s, cells)).reshape(-1, D * _SHAPES)
        # Re L^H W B, with L^H = g^H c^H
        sums = knots.summed((w * np.conj(moved))[:, None] * B)
        across = (g.T @ real_rows(sums)).reshape(D, _SHAPES, -1)
        power = knots.summed((w * np.abs(moved) ** 2)[:, None])[:, 0]
        each = np.ascontiguousarray(g.T).reshape(D, _SHAPES, -1)
        own = each * np.tile(power, 2) @ each.transpose(0, 2, 1)
        first = 0
        for trial in rows.trials:
            lines = slice(first, first + len(trial.s))
            first = lines.stop
            Q = trial.Q[: len(trial.s)] + 1j * trial.Q[len(trial.s) :]
            wQ, spread = w[lines, None] * Q, np.zeros((len(w), 2 * Q.shape[1]), dtype=complex)
            spread[lines] = np.conj(trial.weighed)[:, None] * np.concatenate([Q, wQ], axis=1)
            both = (g.T @ real_rows(knots.summed(spread))).reshape(D, _SHAPES, -1)
            U, V = both[..., : Q.shape[1]], both[..., Q.shape[1] :]
            # The ends are removed from L as from B: L - Q Q^T L
            across -= U @ (np.conj(wQ).T @ B[lines]).real
            UV = U @ V.transpose(0, 2, 1)
            inner = (np.conj(wQ).T @ Q).real
            own -= UV + UV.transpose(0, 2, 1) - U @ inner @ U.transpose(0, 2, 1)
        weighed = base.reshape(2 * len(w), -1) * np.repeat(np.sqrt(w), 2)[:, None]
        return cls(weighed.T @ weighed, across, own)

    def with_columns(self, chosen: IntArray) -> Products:
        """Products of selected columns of X only."""
        kept = np.r_[chosen, len(self.gram) - 1]
        return Products(self.gram[np.ix_(kept, kept)], self.across[..., kept], self.own)

    def solved(
        self, M: FloatArray, order: IntArray, bound: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Values (D, p), ``[X L M]^T W [X L M]`` + bounds (D, p, p), residual squares (D,).

        `M` (D, 5, a): combinations of each pathway's columns.
        `order` (p,): index of each parameter in the columns of X followed by these.
        """
        D, q = len(M), len(self.gram) - 1
        T = M.transpose(0, 2, 1)
        across, own = T @ self.across, T @ self.own @ M
        corner = np.broadcast_to(self.gram[:q, :q], (D, q, q))
        upper = np.concatenate([corner, across[..., :q].transpose(0, 2, 1)], axis=2)
        N = np.concatenate([upper, np.concatenate([across[..., :q], own], axis=2)], axis=1)
        b = np.concatenate([np.broadcast_to(self.gram[:q, q], (D, q)), across[..., q]], axis=1)
        N, b = N[:, order[:, None], order], b[:, order]
        N = N + bound[:, :, None] * np.eye(len(order))
        scale = np.sqrt(np.diagonal(N, axis1=1, axis2=2)) + np.finfo(float).tiny
        # N (p, p) values (p,) = b (p,)
        scaled = N / (scale[:, :, None] * scale[:, None, :])
        values = np.linalg.solve(scaled, (b / scale)[..., None])[..., 0] / scale
        return values, N, self.gram[q, q] - np.einsum("dp,dp->d", b, values)
