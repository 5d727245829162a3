"""Diagnose an estimate: whiteness of residuals, other models, parameters that the record hardly
determines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.findings import Finding, warnings_of
from armimpedance.joint.elbow.doubts.doubt import doubt
from armimpedance.joint.elbow.elbow_result import NAMES, ElbowFit, Whiteness
from armimpedance.joint.elbow.samples import COMMANDED
from armimpedance.joint.elbow.stationary.band import Band, Bins, Complex, Source, explained, in_time
from armimpedance.joint.elbow.stationary.estimate import Estimate
from armimpedance.joint.elbow.stationary.methods import ElbowMethod
from armimpedance.joint.elbow.stationary.preparation import PreparedSamples
from armimpedance.numerics.regression import Parameters, t_factor

# Are the residuals white? They are tested in the band of the signal, not of the filter.
#
# The residual of a filtered fit at the filtered samples' rate is coloured by the filter, whatever
# the joint does. The test therefore uses the equation's residual as Fourier coefficients of the
# band, in units of the predicted sensor noise, as a series at twice the band's upper edge. With
# white sensor noise and a true model it is white for every method. The subject's own torque, a
# reflex or a joint that changed makes it coloured; the interval, from blocks, allows for that, but
# the values may be biased.

MOST_LAGS: Final = 20
#: A correlation below this does not matter, however significant.
SMALL: Final = 0.15
UNLIKELY: Final = 1e-3
#: A residual below this share of the angle's power does not matter either.
ENOUGH_RESIDUALS: Final = 1e-4


def residual_whiteness(
    floors: Band, values: FloatArray, unexplained: float, *, weighed: bool = False
) -> tuple[Whiteness, str | None]:
    """Ljung-Box test of the weighted residual at I, B, K (3,), and a warning if it is far from
    white.

    `values` (3,).
    `floors`: weighted by the sensors' noise only.
    `unexplained`: share of the angle's power that I, B and K do not explain.
    `weighed`: True if the fit's weights follow the residual's spectrum, which then gives no
    warning.
    """
    white = ljung_box([in_time(bins.residual(values)) for bins in floors.trials])
    return white, _warning(white, unexplained, weighed)


def ljung_box(series: list[FloatArray], lags: int | None = None) -> Whiteness:
    """Ljung-Box statistic ``Q = N (N + 2) sum_k r_k^2 / (N - k)``, chi-squared with `lags` degrees.

    `series` list of (S_t,): correlations are not taken across trials.
    `lags`: 20, or a fifth of the shortest series.
    """
    from scipy.stats import chi2

    shortest = min(len(e) for e in series)
    count = lags or max(min(MOST_LAGS, shortest // 5), 1)
    centred = [e - e.mean() for e in series]
    power = sum(float(e @ e) for e in centred)
    if power == 0:
        return Whiteness(0.0, 1.0, count, 0.0)
    k = np.arange(1, count + 1)
    r = np.array([sum(float(e[:-j] @ e[j:]) for e in centred) for j in k]) / power
    N = sum(len(e) for e in series)
    statistic = float(N * (N + 2) * (r**2 / (N - k)).sum())
    return Whiteness(
        statistic, float(chi2.sf(statistic, count)), count, float(r[np.abs(r).argmax()])
    )


def _warning(white: Whiteness, unexplained: float, weighed: bool) -> str | None:
    """Warning if the residuals are far from white and larger than rounding; else None."""
    if (
        weighed
        or unexplained < ENOUGH_RESIDUALS
        or white.p > UNLIKELY
        or abs(white.largest_correlation) < SMALL
    ):
        return None
    return (
        f"the residuals are not white (Ljung-Box {white.probability}, correlation up to "
        f"{white.largest_correlation:.2f}): more than I, B, K and sensors' noise is in the "
        "torque (the subject's own, a joint that changed); the intervals allow for it, the values "
        "may not"
    )


# Linear least squares in the band, for models other than the joint of second order.


@dataclass(frozen=True)
class LeastSquares:
    """Parameters (p,) of weighted columns, and the residual sum of squares."""

    parameters: FloatArray
    squares: float


def least_squares(
    band: Band, columns: Sequence[Complex], weights: Sequence[FloatArray]
) -> LeastSquares:
    """Fit all trials together, without the ends' polynomials.

    `weights`: one (n,) array per trial.
    `columns`: one (n, p + 1) array per trial; the last column is to be explained.
    """
    trials = zip(band.trials, columns, weights, strict=True)
    table = np.concatenate([bins.free(w, c) for bins, c, w in trials])
    X, y = table[:, :-1], table[:, -1]
    scale = np.linalg.norm(X, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    # X (n, p) parameters (p,) = y (n,)
    parameters = np.linalg.lstsq(X / scale, y, rcond=None)[0] / scale
    return LeastSquares(parameters, float(((y - X @ parameters) ** 2).sum()))


# Does a joint of second order suffice? Transfer functions of other orders, by AIC and BIC.
#
# ``A(s) Theta = B(s) exp(-s nk / rate) Tau`` with na the degree of A, nb the coefficients of B, on
# the band's Fourier coefficients. There the channels' noise is part of the weights, and does not
# favour higher orders as in one-step predictions of filtered samples. I, B, K are ``na = 2, nb = 1,
# nk = 0``.

JOINT: Final = (2, 1, 0)
GRID: Final = tuple(
    (na, nb, nk) for na in (1, 2, 3, 4) for nb in (1, 2) for nk in (0, 1, 2) if nb <= na
)
_ROUNDS: Final = 6
#: Limits of "clearly better": fall of the BIC, and of the residual squares.
BIC_GAIN: Final = 10.0
SQUARES_GAIN: Final = 0.1
#: A joint that explains all but this share of the angle's power suffices in any case.
ENOUGH: Final = 1e-3


@dataclass(frozen=True)
class OrderScore:
    """Score of one set of orders: weighted residual squares, AIC and BIC."""

    na: int
    nb: int
    nk: int
    squares: float
    aic: float
    bic: float

    @property
    def orders(self) -> tuple[int, int, int]:
        """na, nb, nk."""
        return self.na, self.nb, self.nk


def compare_orders(
    band: Band, rate_hz: float, unexplained: float, chance: float = 0.0
) -> tuple[tuple[OrderScore, ...], Finding]:
    """Scores of `GRID`, the best BIC first, and a finding on whether the joint is clearly worse.

    `rate_hz`: sample rate; nk is counted in its samples.
    `unexplained`: share of the angle's power that I, B and K do not explain.
    `chance`: probability that chance departs so far from I, B and K over frequency; if it is not
    small, another order only describes the colour of the noise.
    """
    rows, scores = band.rows, []
    for na, nb, nk in GRID:
        squares = _squares(band, na, nb, nk / rate_hz)
        per_row = max(squares / rows, np.finfo(float).tiny)
        fit, p = rows * float(np.log(per_row)), na + nb + (nk > 0)
        scores.append(OrderScore(na, nb, nk, squares, fit + 2 * p, fit + float(np.log(rows)) * p))
    ranked = tuple(sorted(scores, key=lambda s: s.bic))
    return ranked, _judged(ranked, unexplained, chance)


def _judged(scores: tuple[OrderScore, ...], unexplained: float, chance: float) -> Finding:
    joint = next(s for s in scores if s.orders == JOINT)
    best = scores[0]
    gain = 1 - best.squares / joint.squares if joint.squares else 0.0
    smallest = f"{100 * SQUARES_GAIN:g} % of what is left, {100 * ENOUGH:g} % of the motion"
    if chance > UNLIKELY:
        return Finding("order", "ok", "what I, B and K leave does not follow the motion", smallest)
    if unexplained < ENOUGH or joint.bic - best.bic < BIC_GAIN or gain < SQUARES_GAIN:
        return Finding("order", "ok", "no transfer function of low order does better", smallest)
    message = (
        f"a joint of second order does not hold the record: na = {best.na}, nb = {best.nb}, "
        f"nk = {best.nk} leaves {100 * gain:.0f} % less (BIC {joint.bic - best.bic:.0f} lower): "
        "a reflex, soft tissue or the device's own dynamics; look at the frequency response, "
        "measure the torque nearer to the limb"
    )
    return Finding("order", "warning", message, smallest)


def _squares(band: Band, na: int, nb: int, delay_s: float) -> float:
    """Weighted residual squares, by linear least squares weighted by the previous fit."""
    top = float(np.abs(band.trials[0].s[-1]))
    columns = [_columns(bins, na, nb, delay_s, top) for bins in band.trials]
    weights = [np.ones(len(b.s)) / np.maximum(np.abs(b.torque).mean(), 1e-300) for b in band.trials]
    squares = np.inf
    for _ in range(_ROUNDS):
        fit = least_squares(band, columns, weights)
        weights = [np.sqrt(2 / _power(b, fit.parameters, na, nb, top)) for b in band.trials]
        squares = fit.squares
    return squares


def _columns(bins: Bins, na: int, nb: int, delay_s: float, top: float) -> Complex:
    """Columns Theta s^0 ... s^na, -Tau s^1 ... s^(nb-1); last the torque, with coefficient one."""
    x = bins.s / top
    torque = bins.torque * np.exp(-bins.s * delay_s)
    of_angle = bins.angle[:, None] * x[:, None] ** np.arange(na + 1)
    of_torque = -torque[:, None] * x[:, None] ** np.arange(1, nb)
    return np.concatenate([of_angle, of_torque, torque[:, None]], axis=1)


def _power(bins: Bins, parameters: FloatArray, na: int, nb: int, top: float) -> FloatArray:
    """Noise power of ``A Theta - B Tau`` (n,)."""
    x = bins.s / top
    A = (x[:, None] ** np.arange(na + 1)) @ parameters[: na + 1]
    B = 1 + (x[:, None] ** np.arange(1, nb)) @ parameters[na + 1 :]
    return np.asarray(bins.angle_noise * np.abs(A) ** 2 + bins.torque_noise * np.abs(B) ** 2)


#: Sources of the instruments, as text.
_SOURCES: Final[dict[Source, str]] = {
    "perturbation": "the device's perturbation",
    "command": "the commanded angle, through what each frequency's neighbours answer to it",
    "torque": "the measured torque: what the subject adds to it in answer to the motion stays in",
    "angle": "the measured angle: the subject's own torque is noise of the torque",
}
#: Least relative sd of I, B and K, however quiet the sensors: for errors of converters, holds and
#: clocks between two samples, and since no limb is exactly of second order.
MODEL: Final = 5e-4
#: Relative half-width above which an interval is reported as hardly determined.
WIDE: Final = 0.5


def diagnosed(
    estimate: Estimate, method: ElbowMethod, prepared: PreparedSamples, floors: Band, band: Band
) -> ElbowFit:
    """Return the estimate as a fit, with all tests of its assumptions.

    `estimate`: by `method` with the weights of `band`.
    `floors`, `band`: weighted by the sensors' noise only, and as used in the fit.
    """
    samples, values = prepared.source, estimate.parameters.values
    r2 = explained(band, values)
    weighed = band is not floors
    white, coloured = residual_whiteness(floors, values, 1 - r2, weighed=weighed)
    doubts = doubt(estimate, prepared, band)
    scores, order = compare_orders(band, prepared.sample_rate_hz, 1 - r2, doubts.chance)
    # If a test has named the cause, the general warnings are not repeated.
    unnamed = () if doubts.seen else (*estimate.warnings, coloured)
    checks = doubts.checks if doubts.seen else (*doubts.checks, order)
    commanded = COMMANDED if samples.torque_is == "commanded" else None
    messages = (*warnings_of(checks), *unnamed, commanded, _hardly_told(doubts.parameters))
    notes = _notes(method, prepared, band, coloured=band is not floors)
    return ElbowFit(
        method=method.name,
        parameters=_no_surer_than_the_model(doubts.parameters),
        allowing=_no_surer_than_the_model(doubts.allowing),
        n=estimate.n,
        cond_raw=estimate.conditioning.cond_raw,
        cond_scaled=estimate.conditioning.cond_scaled,
        rank=estimate.conditioning.rank,
        r2=r2,
        snr=prepared.spectra.snr,
        whiteness=white,
        joint=samples.joint,
        preparation=(*samples.notes, *notes, *estimate.notes),
        warnings=tuple(t for t in messages if t is not None),
        checks=checks,
        details={
            **estimate.details,
            "orders": scores,
            **doubts.details,
            "band_hz": prepared.band_hz,
        },
    )


def _no_surer_than_the_model(parameters: Parameters) -> Parameters:
    # C + diag(MODEL p)^2 (3, 3)
    more = np.diag((MODEL * parameters.values) ** 2)
    return replace(parameters, covariance=parameters.covariance + more)


def _hardly_told(parameters: Parameters) -> str | None:
    half = t_factor(parameters.dof) * parameters.sd / parameters.values
    wide = [f"{n} +-{100 * h:.0f} %" for n, h in zip(NAMES, half, strict=True) if h > WIDE]
    return f"hardly told by this record: {', '.join(wide)}" if wide else None


def _notes(
    method: ElbowMethod, prepared: PreparedSamples, band: Band, *, coloured: bool
) -> tuple[str, ...]:
    if method.name == "arx":
        return prepared.notes
    count = sum(len(b.s) for b in band.trials)
    lowest = min(float(b.frequency_hz[0]) for b in band.trials)
    notes = [
        "offset and slope taken off each trial",
        f"{count} frequencies, {lowest:.3g} to {prepared.band_hz:.3g} Hz, of all samples, neither "
        f"filtered nor decimated: {prepared.band_why}",
    ]
    if coloured:
        notes.append(
            "weighed by the residual torque's spectrum: more than the sensors' noise is in it"
        )
    if method.name != "output-error":
        notes.append(f"instruments from {_SOURCES[band.source]}")
    return tuple(notes)
