"""Result of a live update: the hand's stiffness with its error and warnings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.ellipses import Ellipse, ellipse
from armimpedance.muscles.models import elements
from armimpedance.numerics.regression import t_factor


@dataclass(frozen=True, slots=True)
class LiveStiffness:
    """Stiffness of the hand at one sample; every number is finite.

    `time_s`: time of the sample; what it says of the muscles is `delay_s` older.
    `delay_s`: what the filters add.
    `q` (n,): joint angles, rad.
    `activation` (m,): of each muscle, 0..1; the last good one where a channel is lost.
    `joint_stiffness` (r, r): of the joints that move, with the terms of hand force and weight, N
    m/rad.
    `stiffness` (d, d): of the hand, positive definite, N/m.
    `commanded` (d, d): `stiffness` behind the limit of its rate of change; the same where there is
    no limit.
    `covariance` (E, E): of the elements on and above the diagonal of `stiffness`, row by row: the
    model's parameters and the activations.
    `dof`: degrees of freedom of the t distribution for intervals.
    `share` (m,): part of each muscle in the trace of `stiffness`; what is missing to 1 are the
    passive joints, the hand's force and the arm's weight.
    `reach` (d, m): u_i in its columns: a muscle that is stiffer by dk adds ``dk u_i u_i^T``.
    `extrapolating`: posture or activation outside of what the model was fitted to.
    `definite`: False where the joint stiffness was not positive definite and was moved to the
    nearest that is.
    `flags`: what else is wrong, such as a lost channel; empty where all is well.
    `growth_W_m2`: power per squared metre of displacement that the growing `commanded` adds to the
    spring at the most: half the largest eigenvalue of its rate, 0 where it falls.
    `added_J`: energy that the changes of `commanded` have added to the spring so far; counts where
    the samples hold a displacement.
    `direction_rad`: direction of the line shoulder -> hand (in the plane of the first two axes).

    Examples
    --------
    >>> from armimpedance import Live, fit_muscles, estimate, to_joint
    >>> from manipulandum_sim.hand import simulate
    >>> session, _ = simulate("cocontraction", seed=1, sets=1)
    >>> model = fit_muscles(to_joint(estimate(session), recording=session), order=0)
    >>> now = Live(model, session).update([0.1] * 6, q=[1.04, 1.57])
    >>> now.stiffness.shape, now.definite
    ((2, 2), True)
    """

    time_s: float
    delay_s: float
    q: FloatArray
    activation: FloatArray
    joint_stiffness: FloatArray
    stiffness: FloatArray
    commanded: FloatArray
    covariance: FloatArray
    dof: float
    share: FloatArray
    reach: FloatArray
    extrapolating: bool
    definite: bool
    flags: tuple[str, ...]
    growth_W_m2: float
    added_J: float
    direction_rad: float

    @property
    def sd(self) -> FloatArray:
        """Standard errors (E,) of the elements on and above the diagonal, N/m."""
        return np.asarray(np.sqrt(np.maximum(self.covariance.diagonal(), 0.0)))

    def half_width(self, level: float = 0.95) -> FloatArray:
        """Half the length (E,) of the elements' confidence intervals, N/m."""
        return np.asarray(t_factor(self.dof, level) * self.sd)

    def axes(self, level: float = 0.95) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Half-axes of `stiffness`, the longest first, their half-widths, and their directions.

        Returns: `lengths`, `half_widths` (d,), (d,): N/m; ``dl = v^T dK v`` for the eigenvector v
        of l.
        `directions` (d, d): rows.
        """
        lengths, vectors = np.linalg.eigh(self.stiffness)
        rows = vectors.T[::-1]
        i, j = elements(len(rows))
        # v^T dK v on packed elements, those beside the diagonal twice: (d, E)
        weights = rows[:, i] * rows[:, j] * np.where(i == j, 1.0, 2.0)
        variance = np.einsum("de,ef,df->d", weights, self.covariance, weights)
        half = t_factor(self.dof, level) * np.sqrt(np.maximum(variance, 0.0))
        return lengths[::-1], half, rows

    @property
    def ellipse(self) -> Ellipse | None:
        """The ellipse with its intervals; None where the hand has other than two axes."""
        if len(self.stiffness) != 2:
            return None
        unfold = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
        return ellipse(
            self.stiffness,
            reference_angle_rad=self.direction_rad,
            covariance=unfold @ self.covariance @ unfold.T,
            dof=self.dof,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, as the streams write them."""
        lengths, half, directions = self.axes()
        return {
            "time_s": self.time_s,
            "delay_s": self.delay_s,
            "K_N_m": self.stiffness.tolist(),
            "ci95_half_N_m": self.half_width().tolist(),
            "commanded_N_m": self.commanded.tolist(),
            "axes_N_m": lengths.tolist(),
            "axes_ci95_half_N_m": half.tolist(),
            "directions": directions.tolist(),
            "share": self.share.tolist(),
            "extrapolating": self.extrapolating,
            "definite": self.definite,
            "flags": list(self.flags),
            "growth_W_m2": self.growth_W_m2,
            "added_J": self.added_J,
        }


# A varying stiffness as a robot may follow it: how fast it changes, what energy that adds.
#
# A spring ``e^T K e / 2`` whose K changes gains ``e^T dK e / 2`` at a displacement e that nobody
# moved: a growing stiffness is no passive spring.


class VaryingSpring:
    """Follows a stiffness no faster than told and sums up the energy that its changes add.

    `limit_N_m_s`: largest rate of change of any stiffness, N/m per s; None: no limit.
    `step_s`: nominal time between samples: after a gap the spring moves on as if twice as much had
    passed, and of stamps that nearly coincide no rate is told.
    Raises InputError: a limit that is not positive.
    """

    def __init__(self, limit_N_m_s: float | None, step_s: float) -> None:
        if limit_N_m_s is not None and not limit_N_m_s > 0:
            raise InputError(f"a limit of {limit_N_m_s:g} N/m/s", expected="more than 0")
        self._limit, self._nominal = limit_N_m_s, step_s
        self._K: FloatArray | None = None
        self.growth_W_m2 = 0.0
        self.added_J = 0.0

    def follow(self, K: FloatArray, step_s: float, displacement: FloatArray | None) -> FloatArray:
        """The stiffness (d, d) to command where `K` is asked for.

        It lies between the last one and K, both positive definite, and so is positive definite.
        """
        if self._K is None:
            self._K = K
            return K
        step = min(step_s, 2 * self._nominal)
        change = K - self._K
        rates = np.linalg.eigvalsh(change)
        fastest = max(-rates[0], rates[-1])
        part = 1.0
        if self._limit is not None and fastest > self._limit * step:
            part = self._limit * step / fastest
            change = part * change
        shown = max(step, 0.1 * self._nominal)
        self.growth_W_m2 = max(float(part * rates[-1]) / (2 * shown), 0.0)
        if displacement is not None:
            self.added_J += float(displacement @ change @ displacement) / 2
        self._K = K if part == 1.0 else self._K + change
        return self._K
