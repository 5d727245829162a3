"""Predicted precision of an experiment: planned motion, bound, standard errors, trials needed.

The bound for a planned motion and noise, times the inefficiency of the estimator, is the covariance
of M, B, K per trial; with n trials in sets of all directions it is an n-th of that. The intervals
are those of a future estimate: t with n - 1 degrees of freedom, standard errors clustered by trial,
and the allowance of `estimate` for departures that so many trials do not exclude.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from operator import add
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import Window
from armimpedance.hand.ellipses import Ellipse, Ellipsoid, ellipse, ellipsoid_of_matrix
from armimpedance.hand.planning.profile import Profile
from armimpedance.hand.planning.setting import Setting, follow, unit_directions
from armimpedance.hand.still import (
    Knowledge,
    foretold_allowance,
    inverse_information,
    knowledge_by_trial,
)
from armimpedance.numerics.regression import t_factor
from armimpedance.numerics.signals import Modes, delayed

# A planned motion in the modes of its window: the rows of the impedance equation before any data.
#
# The hand follows a command along u as ``sum_a u_a x^(a)``, x^(a) being its motion for a command
# along axis a of d. Over equally spaced directions ``sum_u u u^T = (directions / d) I``: the mean
# information of a trial is the d-th part of that of one trial along each axis.


@dataclass(frozen=True)
class PlannedMotion:
    """Predicted motion of the hand, and the weight of its noise.

    Attributes
    ----------
    setting : Setting
    profile : Profile
    """

    setting: Setting
    profile: Profile

    @cached_property
    def displacement(self) -> FloatArray:
        """Displacement of the hand for a command along each axis, (d, d, S)."""
        setting, profile = self.setting, self.profile
        course = profile.at(setting.lags(profile.duration_s))
        return follow(setting.servo, setting.arm.parameters, course, setting.sample_rate_hz)

    @cached_property
    def weight(self) -> FloatArray:
        """Inverse covariance of the noise in the equation's rows, (d n, d n)."""
        V = np.linalg.inv(self.setting.covariance(self.displacement, self.profile.duration_s))
        return np.asarray((V + V.T) / 2)

    def trials(self, directions: FloatArray) -> Window:
        """Noise-free windows (T, S, d) of trials along directions (T, d)."""
        setting, profile = self.setting, self.profile
        lag, rate = setting.lags(profile.duration_s), setting.sample_rate_hz
        # x_t = sum_a u_ta x^(a), (T, d, S)
        x = np.tensordot(directions, self.displacement, axes=1)
        v = np.gradient(x, 1 / rate, axis=2)
        M, B, K = setting.arm.parameters
        force = -(M @ np.gradient(v, 1 / rate, axis=2) + B @ v + K @ x)
        T, d = directions.shape
        return Window(
            sample_rate_hz=rate,
            lag_s=lag,
            position=x.transpose(0, 2, 1),
            force=force.transpose(0, 2, 1),
            duration_s=np.full(T, profile.duration_s),
            trial=np.arange(T),
            usable=np.ones(T, dtype=bool),
            position_at_onset=np.zeros((T, d)),
            force_at_onset=np.zeros((T, d)),
        )

    def rows(self, delays_s: Sequence[float] = ()) -> FloatArray:
        """Rows of the equation for a command along each axis, (d, d n, (3 + delays) d^2)."""
        modes = self.setting.modes(self.profile.duration_s)
        moved = modal_motion(self.displacement, modes, self.setting.sample_rate_hz, delays_s)
        return equation_rows(moved)


def modal_motion(
    displacement: FloatArray, modes: Modes, sample_rate_hz: float, delays_s: Sequence[float] = ()
) -> FloatArray:
    """x'', x', x, then x at each delay, in modes.

    `displacement` (..., S): at rest before the window.
    Returns: (3 + len(delays_s), ..., n).
    """
    derivatives = [displacement @ part.T for part in (modes.second, modes.first, modes.smooth)]
    late = [delayed(displacement, delay * sample_rate_hz) @ modes.smooth.T for delay in delays_s]
    return np.stack([*derivatives, *late])


def equation_rows(motion: FloatArray) -> FloatArray:
    """Rows of ``G theta``, theta = M, B, K, ... row by row.

    `motion` (r, ..., d, n).
    Returns: (..., d n, r d^2).
    """
    r, *others, d, n = motion.shape
    moved = np.moveaxis(motion, 0, -3)
    rows = np.zeros((*others, d, n, r, d, d))
    for i in range(d):
        # row (i, n), column (m, i, k)
        rows[..., i, :, :, i, :] = np.moveaxis(moved, -1, -3)
    return rows.reshape(*others, d * n, r * d * d)


def information(rows: FloatArray, weight: FloatArray) -> FloatArray:
    """Mean information of a trial (p, p) about p parameters.

    `rows` (d, d n, p): for a command along each axis.
    `weight` (d n, d n): inverse covariance of the noise.
    """
    # I (p, p) = 1/d sum_a G_a^T (p, dn) V (dn, dn) G_a (dn, p)
    total = (rows.transpose(0, 2, 1) @ weight @ rows).sum(axis=0) / len(rows)
    return np.asarray((total + total.T) / 2)


#: Standard errors of method `weighted` relative to the bound, for M, B and K: measured over the
#: designs of benchmarks/decided/plan_widths.py.
INEFFICIENCY: Final = (1.08, 1.03, 1.03)
#: Upper limit of the search for the number of trials.
MOST_SETS: Final = 10**6
#: Largest scaled condition of the information at which M, B and K are identifiable.
WORST_CONDITION: Final = 1e9


@dataclass(frozen=True, eq=False)
class Precision(FrozenRecord):
    """Predicted precision of M, B, K (and of a delayed response R) with a disturbance.

    `parameters` (3, d, d): expected M (with handle), B, K.
    `bound` (p, p): least covariance of the parameters of one trial, mean over the directions; p = 3
    d^2, or 4 d^2 with R.
    `knowledge`: information of a trial about departures, mean over the directions. None: intervals
    are those of noise alone.
    `conditions`: number of conditions with as many trials in a session; they share the departures.
    """

    parameters: Annotated[FloatArray, "3 d d"]
    bound: Annotated[FloatArray, "p p"]
    knowledge: Knowledge | None = None
    conditions: int = 1

    @property
    def axes(self) -> int:
        """Number of axes d."""
        return int(self.parameters.shape[1])

    @property
    def directions(self) -> int:
        """Number of trials in a set."""
        return len(unit_directions(self.axes))

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of one trial's estimate, (p, p): the bound times the inefficiency."""
        elements = self.axes**2
        factor = np.repeat(
            [*INEFFICIENCY, INEFFICIENCY[2]][: len(self.bound) // elements], elements
        )
        return self.bound * factor[:, None] * factor

    @cached_property
    def relative_sd(self) -> FloatArray:
        """Relative standard errors of M, B, K (and R, relative to K) for one trial, by the bound.

        Frobenius norm of the symmetric part, (r,).
        """
        d = self.axes
        parts = []
        for block in range(len(self.bound) // d**2):
            truth = self.parameters[min(block, 2)]
            part = self.bound[block * d * d : (block + 1) * d * d, block * d * d :][:, : d * d]
            C = part.reshape(d, d, d, d)
            # E |S|^2, S = (E + E^T)/2
            total = (np.einsum("ijij", C) + np.einsum("ijji", C)) / 2
            parts.append(np.sqrt(total) / np.linalg.norm((truth + truth.T) / 2))
        return np.array(parts)

    def covariance_of(self, trials: int) -> FloatArray:
        """Predicted covariance (p, p) of an estimate from so many trials."""
        if trials not in self._made:
            self._made[trials] = self.covariance / trials + self._allowance(trials)
        return self._made[trials]

    @cached_property
    def _made(self) -> dict[int, FloatArray]:
        return {}

    def _allowance(self, trials: int) -> FloatArray:
        """Part of it that allows for departures, (p, p)."""
        if self.knowledge is None:
            return np.zeros_like(self.bound)
        session = [self.knowledge.times(trials)] * self.conditions
        return foretold_allowance(session, [self.parameters.ravel()] * self.conditions)[0]

    def half_widths(self, trials: int, level: float = 0.95) -> FloatArray:
        """Expected half-widths of the intervals of all elements, (r, d, d)."""
        sd = np.sqrt(np.diag(self.covariance_of(trials)))
        return (_t(trials, level) * sd).reshape(-1, self.axes, self.axes)

    def diagonal_part(self, trials: int, matrix: int) -> float:
        """Largest relative half-width of the 95 % intervals of the diagonal elements.

        `matrix`: 0 to 3 for M, B, K, R; R is taken relative to K.
        """
        half = np.diag(self.half_widths(trials)[matrix])
        return float((half / np.diag(self.parameters[min(matrix, 2)])).max())

    def k_part(self, trials: int) -> float:
        """Largest relative half-width of the 95 % intervals of K's diagonal elements."""
        return self.diagonal_part(trials, 2)

    def ellipse(self, trials: int) -> Ellipse | Ellipsoid:
        """K's ellipse, or in space ellipsoid, with the predicted covariance."""
        d = self.axes
        block = slice(2 * d * d, 3 * d * d)
        C = self.covariance_of(trials)[block, block]
        build = ellipse if d == 2 else ellipsoid_of_matrix
        return build(self.parameters[2], covariance=C, dof=trials - 1)

    def size_part(self, trials: int) -> float:
        """Half-width of the 95 % interval of the ellipse's size, relative to the size."""
        expected = self.ellipse(trials)
        low, high = expected.interval()[0 if isinstance(expected, Ellipse) else 3]
        return float((high - low) / 2 / expected.size)

    def orientation(self, trials: int) -> float:
        """Half-width of the 95 % interval of the ellipse's orientation (rad).

        In space: angle by which the longest axis may turn.
        """
        expected = self.ellipse(trials)
        if isinstance(expected, Ellipsoid):
            return float(expected.turns_of(0).max())
        low, high = expected.interval()[1]
        return float((high - low) / 2)

    def trials_for_k(self, part: float) -> int | None:
        """Number of trials, in whole sets, for `k_part` at most this; None: millions."""
        return fewest_trials(lambda n: self.k_part(n) <= part, self.directions)

    def trials_for_orientation(self, angle_rad: float) -> int | None:
        """Number of trials, in whole sets, for `orientation` at most this; None: millions."""
        return fewest_trials(lambda n: self.orientation(n) <= angle_rad, self.directions)


def precision(
    motion: PlannedMotion, *, delay_s: float | None = None, conditions: int | None = None
) -> Precision:
    """Predict the precision with a planned motion.

    Parameters
    ----------
    motion : PlannedMotion
    delay_s : float, optional
        R, the response to the displacement of that much earlier, is a further unknown.
    conditions : int, optional
        Number of conditions in the session, whose intervals allow for departures. Default:
        intervals of noise alone.

    Returns
    -------
    Precision

    Raises
    ------
    NotIdentifiableError
        If the motion does not determine the parameters.
    """
    rows = motion.rows(() if delay_s is None else (delay_s,))
    total = information(rows, motion.weight)
    scale = 1 / np.sqrt(np.maximum(np.diag(total), 1e-300))
    condition = np.linalg.cond(total * scale[:, None] * scale)
    if not condition < WORST_CONDITION:
        profile = motion.profile
        raise NotIdentifiableError(
            f"{profile.shape.name} of {profile.duration_s:g} s does not tell M, B and K apart "
            f"(scaled condition {condition:.1e})"
        )
    result = Precision(motion.setting.arm.parameters, inverse_information(total))
    if conditions is None:
        return result
    return replace(result, knowledge=knowledge_of(motion), conditions=conditions)


def knowledge_of(motion: PlannedMotion) -> Knowledge:
    """Information of one trial, mean over the directions of a set."""
    directions = unit_directions(motion.setting.arm.axes)
    theta = motion.setting.arm.parameters.ravel()
    by_trial = knowledge_by_trial(motion.trials(directions), motion.weight, theta)
    return reduce(add, by_trial).times(1 / len(directions))


def reflex_bias(motion: PlannedMotion, delay_s: float, share: float = 0.25) -> FloatArray:
    """Relative error of M, B, K if a reflex is ignored, (3,).

    The least-squares projection of ``share K x(t - delay)`` on M, B and K, and its component along
    each true matrix: 0.1 is 10 % too large.
    """
    truth, V = motion.setting.arm.parameters, motion.weight
    rows = motion.rows((delay_s,))
    G, late = rows[..., : truth.size], rows[..., truth.size :]
    missed = late @ (share * truth[2]).ravel()
    # delta (3 d^2,) = (sum_a G^T V G)^-1 sum_a G^T V missed (d n,)
    right = np.einsum("anp,nm,am->p", G, V, missed) / len(G)
    delta = inverse_information(information(G, V)) @ right
    along = (delta.reshape(truth.shape) * truth).sum(axis=(1, 2))
    return np.asarray(along / (truth**2).sum(axis=(1, 2)))


def fewest_trials(enough: Callable[[int], bool], each: int) -> int | None:
    """Smallest number of trials, in sets of `each`, for which `enough` holds, or None.

    `enough` must stay true once it is. None: more than `MOST_SETS` sets.
    """
    low, high = 0, MOST_SETS
    if not enough(high * each):
        return None
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if enough(middle * each) else (middle, high)
    return high * each


def _t(trials: int, level: float) -> float:
    if trials < 2:
        raise InputError(f"{trials} trials", expected="2 or more")
    return t_factor(trials - 1, level)
