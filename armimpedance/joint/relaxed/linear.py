"""Least squares on a joint's equations, with the source's covariance and a robust one.

The robust covariance is for a few seconds of a swing with correlated residuals. It uses
equal-weighted cosines (E. Lazarus, D. J. Lewis, J. H. Stock, M. W. Watson, J. Bus. Econ. Stat. 36
(2018) 541-559; U. K. Mueller, J. Econometrics 141 (2007) 1331-1352). The long-run variance of the
scores is the mean of squares of their B slowest cosine sums, and t has B degrees of freedom. Noise
of an acceleration is strong just below the filter's cut-off and nearly absent at the frequency of
the swing. The Bartlett weights of a Newey-West estimator mix the two, which makes the interval of k
twice too wide; cosines do not.

Cosines assume that the noise is equally large everywhere. But after a release the whole swing is in
the first seconds, noise of the posture depends on the cosine of the swinging angle, and the fit
reduces residuals where few rows decide: k was covered in 86 %. If every column passed the same
filter, residuals are independent after a few of its periods, and a jackknife over pieces accounts
for all three effects.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError, InputError, NotIdentifiableError
from armimpedance.core.records import Recording
from armimpedance.joint.relaxed.equations import UNITS, Equations, Terms, parallel_equations
from armimpedance.joint.relaxed.samples import PassiveSamples
from armimpedance.numerics.regression import Fit, long_run_covariance
from armimpedance.numerics.signals import lowpass, refuse_degrees, smoothed_derivatives

#: Band about the swing's frequencies whose noise affects the parameters, Hz.
BAND_HZ: Final = 0.25

#: Length of a piece, in periods of the cut-off; residuals are correlated over two or three.
_PIECE_PERIODS: Final = 12.0
_FEWEST_PIECES: Final = 8

#: Limits of the number of cosines: fewer are imprecise, more would include other frequencies.
_FEWEST: Final = 6
_MOST: Final = 40


@dataclass(frozen=True)
class TwoFits:
    """One estimate with two covariances.

    `classical`: fit with the source's covariance (10), for independent residuals.
    `robust`: fit with a covariance for autocorrelated residuals, used for the intervals.
    """

    classical: Fit
    robust: Fit


def solver(
    equations: Callable[[PassiveSamples, Terms], Equations], *, filtered: bool = False
) -> Callable[[PassiveSamples, Terms], TwoFits]:
    """Return an estimator that solves these equations of a single joint by least squares.

    `filtered`: True if every column passed the filter of Y.
    """

    def solve(samples: PassiveSamples, terms: Terms) -> TwoFits:
        cutoff = samples.cutoff_hz if filtered else None
        return solve_linear(equations(samples, terms), samples.sample_rate_hz, cutoff)

    return solve


def solve_linear(
    equations: Equations, sample_rate_hz: float, cutoff_hz: float | None = None
) -> TwoFits:
    """Least squares with both covariances.

    `cutoff_hz`: of the low-pass that every column and Y passed; residuals are then independent over
    pieces of some periods.
    Raises NotIdentifiableError: W loses rank; names the parameters.
    Raises InputError: no more rows than parameters.
    """
    classical = equations.fit()
    E = [y - classical.predict(w) for w, y in zip(equations.W, equations.Y, strict=True)]
    if cutoff_hz is not None:
        try:
            rows = _PIECE_PERIODS * sample_rate_hz / cutoff_hz
            return TwoFits(classical, with_pieces(classical, equations, rows))
        except NotIdentifiableError:
            pass  # the motion is so short that it lies in one piece: use cosines
    return TwoFits(classical, with_long_run(classical, equations.W, E, sample_rate_hz))


def with_pieces(fit: Fit, equations: Equations, piece_rows: float) -> Fit:
    """Return the fit with the jackknife covariance (CR3) over pieces of its trials.

    `fit`: the fit of `equations`.
    `piece_rows`: longest piece; shorter if there were fewer than `_FEWEST_PIECES`.
    Raises NotIdentifiableError: a parameter depends on a single piece.
    """
    longest = min(piece_rows, equations.n_rows / _FEWEST_PIECES)
    pieces = [max(int(np.ceil(len(w) / longest)), 1) for w in equations.W]
    cut = replace(
        equations,
        W=tuple(p for w, n in zip(equations.W, pieces, strict=True) for p in np.array_split(w, n)),
        Y=tuple(p for y, n in zip(equations.Y, pieces, strict=True) for p in np.array_split(y, n)),
    ).fit("cr3")
    return fit.with_covariance(cut.covariance, f"cr3 of {sum(pieces)} pieces", cut.dof)


def with_long_run(
    fit: Fit, W: Sequence[FloatArray], E: Sequence[FloatArray], sample_rate_hz: float
) -> Fit:
    """Return the fit with a covariance for autocorrelated residuals.

    `W` sequence of (S_t, p).
    `fit`: a fit of one output.
    `E` sequence of (S_t, 1): residuals, trials one after another in time.
    """
    rows, residual = np.concatenate(W), np.concatenate(E)
    count = number_of_cosines(len(rows), sample_rate_hz)
    covariance = long_run_covariance(fit.triangle, rows, residual, count)
    return fit.with_covariance(covariance, f"long-run, {count} cosines", float(count))


def number_of_cosines(rows: int, sample_rate_hz: float) -> int:
    """Number B of cosines; cosine j has ``j / (2 T)`` Hz, T the seconds of all rows."""
    seconds = rows / sample_rate_hz
    within = round(2 * seconds * BAND_HZ)
    return int(np.clip(np.clip(within, _FEWEST, _MOST), 1, max(rows // 4, 1)))


# The rest angle that the data show, to test a stated one.

#: Confidence level of the interval that must exclude the stated angle.
_LEVEL: Final = 0.99
#: Distance from the interval beyond which the stated angle is contradicted, rad: about 4 % of k.
_CLEARLY_RAD: Final = 0.05
#: Least stiffness, in robust standard errors, that determines a rest angle.
_LEAST_STIFFNESS: Final = 5.0


@dataclass(frozen=True)
class FreeRestAngle:
    """The rest angle that the motion shows, and its 99 % interval, rad."""

    value: float
    low: float
    high: float

    def contradicts(self, stated: float) -> bool:
        """Return True if an angle lies clearly outside the interval."""
        return not self.low - _CLEARLY_RAD <= stated <= self.high + _CLEARLY_RAD


def free_rest_angle(
    equations: Equations, terms: Terms, sample_rate_hz: float
) -> FreeRestAngle | None:
    """Fit the rest angle as well, from equations with a stated one.

    `equations`: equations of a single joint, by these terms.
    `terms`: terms of the model, with a stated rest angle.
    Returns: None if the motion does not show it.
    """
    try:
        fits = solve_linear(_with_offset(equations), sample_rate_hz)
        fitted = replace(terms, rest_angle="free").parameters(fits.robust)
    except ArmImpedanceError:
        return None
    k, rest = fitted.names.index("k"), fitted.names.index("q_r")
    shown = abs(fitted.values[k]) > _LEAST_STIFFNESS * fitted.sd[k]
    low, high = fitted.interval(_LEVEL)[rest] + terms.reference
    if not (shown and np.isfinite([low, high]).all()):
        return None
    return FreeRestAngle(float(fitted.values[rest]) + terms.reference, float(low), float(high))


def rest_angle_note(equations: Equations, terms: Terms, sample_rate_hz: float) -> str | None:
    """Sentence if the data contradict the stated rest angle, else None."""
    if terms.free:
        return None
    fitted = free_rest_angle(equations, terms, sample_rate_hz)
    if fitted is None or not fitted.contradicts(terms.reference):
        return None
    return (
        f"the data put the rest angle at {fitted.value:.3f} ({fitted.low:.3f} to "
        f"{fitted.high:.3f}) rad, not at {terms.reference:g}, and k depends on it: is "
        f"{terms.reference:g} in radians, from the same zero?"
    )


def _with_offset(equations: Equations) -> Equations:
    """Add to the rows the column of ones that a free rest angle needs.

    Angles are relative to the stated one, so the fitted one is the difference from it.
    """

    def more(W: FloatArray) -> FloatArray:
        return np.insert(W, before, 1.0, axis=1)

    before = len(set(equations.columns) - {"K"})
    columns = (*equations.columns[:before], "offset", *equations.columns[before:])
    units = (*equations.column_units[:before], UNITS["f"], *equations.column_units[before:])
    return Equations(columns, units, tuple(more(w) for w in equations.W), equations.Y)


# Passive samples from a recording of joint angle and torque (kind "joint").

#: One-sided 95 % of the normal distribution.
_ONE_SIDED: Final = 1.645


def from_joint_recording(
    recording: Recording,
    *,
    cutoff_hz: float | None = 8.0,
    torque_sign: Literal[1, -1] | None = None,
) -> PassiveSamples:
    """Filter angle and torque of every trial alike; the torque column is the passive torque.

    The passive torque is ``k (q - q_r) + h qd + f sign(qd)``, with positive stiffness and viscosity
    for a passive joint. Some laboratories store the limb's torque on the device, which is the
    opposite. Without `torque_sign` the sign is kept, unless stiffness **and** the power that
    viscosity and friction absorb are both significantly negative (upper one-sided 95 % limits below
    zero). A passive joint cannot do that, so the sign is then reversed, and a note reports it.

    Parameters
    ----------
    recording : Recording
        A recording of kind "joint"; its joints have the names ``q1``, ``q2``, ... in messages and
        results.
    cutoff_hz : float or None
        Cut-off of the zero-phase low-pass on angle and torque.
    torque_sign : 1, -1 or None
        Factor of the torque column.

    Returns
    -------
    PassiveSamples

    Raises
    ------
    InputError
        Another kind of recording, too few samples, a cut-off beyond the Nyquist frequency,
        angles that cannot be radians, another sign.
    """
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", expected="kind 'joint'")
    if torque_sign not in (None, 1, -1):
        raise InputError(f"torque sign {torque_sign}", expected="1, -1, or none")
    joints = tuple(f"q{j + 1}" for j in range(recording.axes))
    refuse_degrees(recording.position, joints)
    rate = recording.sample_rate_hz
    trials = [recording.samples_of(t) for t in range(recording.n_trials)]
    smooth = [smoothed_derivatives(recording.position[s], rate, cutoff_hz) for s in trials]
    q, qd, qdd = (np.concatenate([trial[d] for trial in smooth]) for d in range(3))
    torque = (torque_sign or 1) * recording.force
    filtered = [lowpass(torque[s], cutoff_hz, rate, axis=0) for s in trials]
    samples = PassiveSamples(
        sample_rate_hz=rate,
        offsets=recording.offsets,
        joints=joints,
        q=q,
        qd=qd,
        torque=np.concatenate(filtered),
        measured_q=recording.position,
        cutoff_hz=cutoff_hz,
        qdd=qdd,
        measured_torque=torque,
        trials=tuple(str(t) for t in recording.trials["trial"]),
    )
    if torque_sign is not None or not _impossible(samples):
        return samples
    return samples.with_torque_turned(
        "as read, the torque would be that of a joint with negative stiffness that drives the "
        "motion: its sign was turned (a torque sign of 1 keeps it)"
    )


def _impossible(samples: PassiveSamples) -> bool:
    """Return True if every joint's stiffness and dissipation are significantly negative."""
    return all(_negative(samples.only(j)) for j in range(len(samples.joints)))


def _negative(samples: PassiveSamples) -> bool:
    equations = parallel_equations(samples, Terms("free"))
    try:
        fit = solve_linear(equations, samples.sample_rate_hz).robust
    except (NotIdentifiableError, InputError):
        return False
    W, _ = equations.stacked()
    # mean power of h qd + f sign(qd): h mean(qd^2) + f mean(|qd|), W's columns k, h, f, offset
    power = np.array([0.0, np.mean(W[:, 1] ** 2), np.mean(W[:, 1] * W[:, 2]), 0.0])
    stiffness = np.array([1.0, 0.0, 0.0, 0.0])
    return _upper(fit, stiffness) < 0 and _upper(fit, power) < 0


def _upper(fit: Fit, weights: FloatArray) -> float:
    """Upper one-sided 95 % limit of a weighted sum of the parameters."""
    spread = float(weights @ fit.covariance @ weights)
    return float(weights @ fit.parameters) + _ONE_SIDED * float(np.sqrt(spread))
