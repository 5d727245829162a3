"""Twice the log likelihood of whitened rows, for choices of columns and of noise models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.joint.relaxed.doubts.friction_laws import FRICTION_COLUMNS, friction_columns
from armimpedance.joint.relaxed.equations import Terms
from armimpedance.joint.relaxed.hinge import harmonics_at
from armimpedance.joint.relaxed.joint_spline import TrialSpline, smoothest, trial_spline
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.joint.relaxed.state_noise import StateSteps
from armimpedance.joint.relaxed.swing import linearised, push_ratios, settled, swings_of


@dataclass(frozen=True)
class WhiteningNoise:
    """A noise model, and the rows that it whitens.

    `triangle` (r, m + 1): has the same products as all white rows; the last column is to be
    explained.
    `lost`: log determinant of the whitening.
    `slow`: size of a slow torque in the noise model, over the noise of a sample; 0: none.
    `bump_sd`: standard error of a slow torque of half a second, over the noise of a sample.
    """

    triangle: FloatArray
    lost: float
    slow: float
    bump_sd: float


@dataclass(frozen=True)
class WhiteFit:
    """Fit of selected columns with the likeliest noise model.

    `values` (c,), `covariance` (c, c).
    `deviance`: minus twice the log likelihood, up to a constant.
    `slow_Nm`, `bump_sd_Nm`: as in `WhiteningNoise`, in N m.
    """

    deviance: float
    values: FloatArray
    covariance: FloatArray
    slow_Nm: float
    bump_sd_Nm: float


@dataclass(frozen=True)
class RowEvidence:
    """Rows to which any choice of columns can be fitted.

    `names`: of the columns.
    `count`: number of samples.
    """

    names: tuple[str, ...]
    noises: tuple[WhiteningNoise, ...]
    count: int

    def fit(
        self, columns: Sequence[str], *, slow: bool = True, known: Mapping[str, float] | None = None
    ) -> WhiteFit:
        """Fit these columns with the likeliest noise, with or without slow torque.

        `known`: further columns of fixed size.
        """
        chosen = [self.names.index(name) for name in columns]
        sizes = np.zeros(len(self.names))
        for name, size in (known or {}).items():
            sizes[self.names.index(name)] = size
        tried = [noise for noise in self.noises if slow or noise.slow == 0]
        fits = (self._fit(chosen, sizes, noise) for noise in tried)
        return min(fits, key=lambda fit: fit.deviance)

    def _fit(self, chosen: list[int], known: FloatArray, noise: WhiteningNoise) -> WhiteFit:
        rows, c = noise.triangle, len(chosen)
        target = rows[:, -1] - rows[:, :-1] @ known
        scale = np.linalg.norm(rows[:, chosen], axis=0)
        scale = np.where(scale > 0, scale, 1.0)
        # y (r,) = X (r, c) theta by X = Q R, with columns of length one
        stacked = np.column_stack([rows[:, chosen] / scale, target])
        R: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
        square = float((R[c:, c] ** 2).sum()) + float(np.finfo(np.float64).tiny)
        inverse = np.linalg.pinv(R[:c, :c], rcond=1e-10) / scale[:, None]
        variance = square / (self.count - c)
        sigma = float(np.sqrt(variance))
        return WhiteFit(
            self.count * np.log(square) + noise.lost,
            inverse @ R[:c, c],
            variance * inverse @ inverse.T,
            sigma * noise.slow,
            sigma * noise.bump_sd,
        )


# Evidence for a joint with measured torque: remaining weight or inertia, or a delay.
#
# Columns: the model's own, the stiffness's terms of second and third order, the limb's weight (any
# direction), its inertia, and the model's columns with an earlier angle, for a delayed torque.
# Noise: white, with or without a random walk, which describes the torque of active muscles.

#: Longest tried delay, s, and length left out at both ends for it.
LATEST_S: Final = 0.1
#: Samples are averaged over blocks, to about this rate, and to at most so many samples.
_RATE_HZ: Final = 40.0
_MOST: Final = 4000
#: Tried sizes of the random walk in a second, over the noise of a block.
_WALKS: Final = 10 ** np.linspace(-1.0, 2.0, 13)
#: Duration of the random walk before a trial, s: its first torque is not zero.
_BEFORE_S: Final = 5.0


@dataclass(frozen=True)
class TorqueRows:
    """Torque of a joint and smooth curves of its motion, for rows with any delay.

    `samples`: of a single joint.
    `terms`: with a free rest angle.
    `trials` tuple of (TrialSpline, (c,)): smoothest spline of each trial and its coefficients.
    """

    samples: PassiveSamples
    terms: Terms
    trials: tuple[tuple[TrialSpline, FloatArray], ...]

    @property
    def block(self) -> int:
        """Number of samples that are averaged."""
        count = len(self.samples.measured_q)
        return max(int(self.samples.sample_rate_hz / _RATE_HZ), -(-count // _MOST), 1)

    def evidence(
        self, late_s: Sequence[float] = (0.0,), more: bool = True
    ) -> tuple[RowEvidence, ...]:
        """White rows for each delay of the torque after the angle.

        `more`: True to include columns of terms that the model may lack.
        """
        names: tuple[str, ...] = ()
        parts = []
        for trial, curve in self.trials:
            names, columns = self._columns(trial, curve, late_s, more)
            parts.append(columns)
        longest = max(map(len, parts))
        seen = np.arange(longest)[:, None] < [len(part) for part in parts]
        measured = np.stack([_longer(part, longest) for part in parts], axis=1)
        rows, lost = self._white(measured, seen)
        q, count = len(names), int(seen.sum())
        return tuple(
            self._compressed(rows[..., [*range(i * q, (i + 1) * q), -1]], lost, names, count)
            for i in range(len(late_s))
        )

    @property
    def reversal_error_s(self) -> float:
        """Standard error of a delay from the times at which the angle turns, s.

        Friction jumps when the joint turns. The angle gives this time with the error of its noise,
        the torque with that of a sample interval.
        """
        rate = self.samples.sample_rate_hz
        weight = 0.0
        for trial, curve in self.trials:
            _, v, a = trial.motion(curve, np.arange(len(trial.q)) / rate)
            turns = np.flatnonzero(np.diff(np.sign(v)) != 0)
            angle = trial.qd_sd / np.maximum(np.abs(a[turns]), 1e-9)
            weight += float((1 / (angle**2 + 1 / (12 * rate**2))).sum())
        return 1 / float(np.sqrt(weight)) if weight > 0 else 0.0

    def _columns(
        self, trial: TrialSpline, curve: FloatArray, late_s: Sequence[float], more: bool
    ) -> tuple[tuple[str, ...], FloatArray]:
        """Names, and block means (B, columns x delays + 1) with the torque last."""
        rate, count = self.samples.sample_rate_hz, len(trial.q)
        end = int(np.ceil(LATEST_S * rate))
        t = np.arange(end, count - end) / rate
        terms = self.terms
        names: tuple[str, ...] = terms.columns
        if more:
            terms = replace(terms, quadratic=True, cubic=True)
            names = (*terms.columns, "cos", "sin", "inertia", *FRICTION_COLUMNS)
        columns = []
        for late in late_s:
            q, v, a = trial.motion(curve, t - late)
            columns.append(terms.matrix(q, v, trial.sign(v)))
            if more:
                columns.append(np.stack([np.cos(q), np.sin(q), a], axis=-1))
                columns.append(friction_columns(v, trial.sign(v), 1 / rate))
        columns.append(trial.torque[end : count - end, None])
        both, block = np.concatenate(columns, axis=1), self.block
        kept = len(both) // block * block
        return names, both[:kept].reshape(-1, block, both.shape[1]).mean(axis=1)

    def _white(self, measured: FloatArray, seen: BoolArray) -> tuple[FloatArray, FloatArray]:
        """Rows (V, T S, m) whitened by white noise and a random walk of V sizes, the first zero."""
        S, T, m = measured.shape
        rate = self.samples.sample_rate_hz / self.block
        # one unmeasured step for the walk of `_BEFORE_S` before the trial
        push = np.zeros((S, T, 2))
        push[..., 0] = 1.0
        push[0, :, 0] = np.sqrt(_BEFORE_S * rate)
        steps = StateSteps(
            np.broadcast_to(np.eye(2), (S, T, 2, 2)), push, np.pad(seen, ((1, 0), (0, 0)))
        )
        ratios = np.concatenate([[0.0], _WALKS**2 / rate])
        rows, lost = steps.whiten(
            np.pad(measured, ((1, 0), (0, 0), (0, 0))),
            np.zeros((S, T, 2, m)),
            np.zeros((T, 2, m)),
            ratios,
        )
        return rows.reshape(len(ratios), -1, m), lost

    def _compressed(
        self, rows: FloatArray, lost: FloatArray, names: tuple[str, ...], count: int
    ) -> RowEvidence:
        R: FloatArray = np.asarray(np.linalg.qr(rows, mode="r"))
        # a triangular pulse of half a second has a third of its samples' energy
        bump = float(np.sqrt(6 * self.block / self.samples.sample_rate_hz))
        walks = (0.0, *_WALKS)
        noises = [
            WhiteningNoise(triangle, float(log), float(walk), bump)
            for triangle, log, walk in zip(R, lost, walks, strict=True)
        ]
        return RowEvidence(names, tuple(noises), count)


def torque_rows(samples: PassiveSamples, terms: Terms) -> TorqueRows:
    """Build the rows of a single joint.

    Raises InputError: the torque was not measured.
    """
    trials = tuple(smoothest(trial_spline(samples, part)) for part in samples.slices())
    return TorqueRows(samples, terms, trials)


def _longer(columns: FloatArray, count: int) -> FloatArray:
    return np.pad(columns, ((0, count - len(columns)), (0, 0)))


# Evidence for a filmed swing: effects of torques that the model lacks.
#
# The steps from one sample to the next are linear in any small torque. Columns: the model's own,
# the stiffness's terms of second and third order, the weight's torque (whose size depends on the
# clock and the place of the mass, and whose direction depends on the axes), other laws of friction,
# and a slow torque of any size, linear between nodes.

#: Columns of the limb's weight if x, y or z pointed up.
WEIGHT_COLUMNS: Final = ("weight x", "weight y", "weight z")
#: Seconds between nodes of a slow torque; more if a trial would have over `_MOST_NODES`.
_NODE_S: Final = 0.25
_MOST_NODES: Final = 60
#: Tried sizes of the slow torque, N m.
_SIZES: Final = 10 ** np.linspace(-2.5, 0.5, 7)


def swing_evidence(samples: PassiveSamples, terms: Terms) -> RowEvidence:
    """White rows of the swings of a single joint, with columns of the model and of missing terms.

    `samples`: with the hinge's dynamics.
    `terms`: with a free rest angle.
    Raises EstimationError, NotIdentifiableError, InputError: as `solve_swing`.
    """
    solution = settled(samples, terms)
    swings = swings_of(samples, terms)
    linear = linearised(swings, solution.fit.parameters, solution.states, solution.fit.sd)
    more = replace(terms, quadratic=True, cubic=True)
    lacking = (n for n in more.columns if n not in terms.columns)
    names = (*terms.columns, *lacking, *WEIGHT_COLUMNS, *FRICTION_COLUMNS)
    phi = _torques(solution.states, terms, samples)
    slow = _nodes(samples, len(solution.states) - 1)
    T, p, e, H = swings.seen.shape[1], len(terms.columns), phi.shape[2], slow.shape[1]

    # columns: slow torque, the model's parameters, missing terms, residual, two starts
    m = H + p + e + 1 + 2
    inputs = np.zeros((len(slow), T, 2, m))
    push = linear.steps.push[..., None]
    inputs[..., :H] = push * slow[:, None, None, :]
    inputs[..., H : H + p] = -linear.by_parameters
    inputs[..., H + p : H + p + e] = push * phi[:, :, None, :]
    inputs[..., H + p + e] = linear.jump
    measured, start = np.zeros((*swings.seen.shape, m)), np.zeros((T, 2, m))
    measured[..., H + p + e] = swings.measured - solution.states[..., 0]
    start[:, [0, 1], [m - 2, m - 1]] = -1.0
    ratios = push_ratios(linear)[::2]
    rows, lost = linear.steps.whiten(measured, inputs, start, ratios)
    rows[..., H + p + e] += rows[..., H : H + p] @ solution.fit.parameters
    count = int(swings.seen.sum()) - 2 * T
    return RowEvidence(names, tuple(_noises(rows, lost, H, p, count)), count)


def _torques(states: FloatArray, terms: Terms, samples: PassiveSamples) -> FloatArray:
    """Torques (S - 1, T, e) of missing terms, at the middle of each step."""
    q, v = np.moveaxis((states[:-1] + states[1:]) / 2, -1, 0)
    columns = [q**3] if terms.quadratic else [q**2, q**3]
    # weight (S - 1, T, 3): its harmonics (S - 1, T, 3, 5) times those of the angle
    weight = np.einsum("stdh,sth->std", _weights(samples, len(q)), harmonics_at(q))
    friction = friction_columns(v, np.sign(v), 1 / samples.sample_rate_hz)
    return np.concatenate([np.stack(columns, axis=-1), weight, friction], axis=-1)


def _weights(samples: PassiveSamples, steps: int) -> FloatArray:
    """Harmonics (steps, T, 3, 5) of the weight in every step; shorter trials repeat their last."""
    parts = samples.hinges[0].weights if samples.hinges else ()
    short = ((0, max(steps - len(part), 0)) for part in parts)
    padded = (
        np.pad(p, (s, (0, 0), (0, 0)), mode="edge") for p, s in zip(parts, short, strict=True)
    )
    return np.stack([part[:steps] for part in padded], axis=1)


def _nodes(samples: PassiveSamples, steps: int) -> FloatArray:
    """Hat functions (S - 1, H) in time, at every step's middle."""
    t = (np.arange(steps) + 0.5) / samples.sample_rate_hz
    end = steps / samples.sample_rate_hz
    count = int(np.clip(np.ceil(end / _NODE_S), 2, _MOST_NODES))
    nodes = np.linspace(0, end, count + 1)
    return np.asarray(np.maximum(0, 1 - np.abs(t[:, None] - nodes) / (end / count)))


def _noises(
    rows: FloatArray, lost: FloatArray, H: int, p: int, count: int
) -> Iterator[WhiteningNoise]:
    """Yield noise models with and without slow torque, from white rows (V, T, S, H + m + 1 + 2).

    The first p of the m columns are the model's own.
    """
    V, T, S, width = rows.shape
    # starts first, so that they are eliminated; then slow torque, the columns, the residual
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
        largest, rest = _without_bumps(Z, X, Q, e)
        # one bump at any place in each trial: expected gain of the best of H by chance
        price = T * (1 + 2 * float(np.log(H)))
        yield WhiteningNoise(rest, float(log) + price, largest / sigma, bump)
        for size in _SIZES / sigma:
            yield _with_walk(triangle, H, float(size), float(log), bump)


def _with_walk(
    triangle: FloatArray, H: int, size: float, log: float, bump: float
) -> WhiteningNoise:
    """Noise model with slow torque u (T, H) ~ N(0, size^2 s^2) at all nodes, from rows (T, r, H + m
    + 1).
    """
    T, _, width = triangle.shape
    prior = np.zeros((T, H, width))
    prior[:, np.arange(H), np.arange(H)] = 1 / size
    # rows [Z (r, H), X (r, m + 1); 1 / size, 0] = Q R, and Z is projected out of the rows below
    stacked = np.concatenate([triangle, prior], axis=1)
    R: FloatArray = np.asarray(np.linalg.qr(stacked, mode="r"))
    own = np.abs(np.diagonal(R, axis1=-2, axis2=-1))[:, :H]
    rest = R[:, H:, H:]
    lost = log + 2 * float(np.log(own * size).sum())
    return WhiteningNoise(rest.reshape(T * rest.shape[1], -1), lost, size, bump)


def _residual(X: FloatArray, p: int) -> tuple[FloatArray, FloatArray]:
    """Basis Q (T, r, c) of the model's columns of X (T, r, m + 1), and the residual of the last."""
    T, r, _ = X.shape
    flat = X.reshape(T * r, -1)
    Q: FloatArray = np.asarray(np.linalg.qr(flat[:, :p], mode="reduced")[0])
    e = flat[:, -1] - Q @ (Q.T @ flat[:, -1])
    return Q.reshape(T, r, -1), e.reshape(T, r)


def _without_bumps(
    Z: FloatArray, X: FloatArray, Q: FloatArray, e: FloatArray
) -> tuple[float, FloatArray]:
    """Size of the largest bump, and rows X without the bump that explains most in each trial."""
    T, r, _ = Z.shape
    # for every bump: product with the residual, and length orthogonal to the model's columns
    shared = np.einsum("trh,tr->th", Z, e)
    whole = (Z**2).sum(axis=1)
    length = whole - (np.einsum("trh,trc->thc", Z, Q) ** 2).sum(axis=-1)
    length = np.maximum(length, 1e-6 * whole + np.finfo(np.float64).tiny)
    best, at = (shared**2 / length).argmax(axis=1), np.arange(T)
    z = Z[at, :, best]
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    rest = X - z[:, :, None] * np.einsum("tr,trc->tc", z, X)[:, None, :]
    sizes = np.abs(shared[at, best]) / length[at, best]
    return float(sizes.max()), rest.reshape(T * r, -1)
