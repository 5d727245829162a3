"""B(t) and K(t) scheduled by EMG amplitudes, eq. (4), in one regression; and whether that holds.

    K(t) = k0 + sum_j k_j a_j(t),   B(t) = b0 + sum_j b_j a_j(t)

The products of amplitude and motion are regressors of the weighted equation: no window, no filter
after the product. A law that is linear and without lag is an assumption: terms that would be needed
if it were wrong are tested one kind at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.special import chdtrc, fdtrc

from armimpedance.elbow.emg_errors import ErrorMoments, refuse_unreliable
from armimpedance.elbow.varying_basis import (
    BasisFit,
    basis_columns,
    clustered,
    error_moments,
    fit_basis,
    low_excess,
)
from armimpedance.elbow.varying_beginning import Beginning
from armimpedance.elbow.varying_data import VaryingData
from armimpedance.elbow.varying_found import Found, grid
from armimpedance.elbow.varying_spline import spline_basis
from armimpedance.errors import InputError
from armimpedance.records import FloatArray
from armimpedance.signals.filters import lowpass

#: A term that is missing is told below this probability, if it moves K or B by more than
#: `MATTERS` of their mean (rms).
UNLIKELY: Final = 1e-3
MATTERS: Final = 0.02
#: Knots of the free course that the law is tested against, per second.
FREE_PER_SECOND: Final = 1.0
#: Band of the amplitudes' errors, Hz: of the envelope.
ERROR_BAND_HZ: Final = 10.0
ERROR_DRAWS: Final = 32
#: Amplitudes that change by less than this say nothing of a law.
LEAST_CHANGE: Final = 1e-3


@dataclass(frozen=True)
class Departure:
    """Terms beside the linear law: their probability, and how far they move B and K.

    Attributes
    ----------
    p : float
        Of a Wald statistic as large if the law holds.
    moves : (2,)
        rms of the change of B and K over their means.
    lag_s : float or None
        By which K and B seem to follow the amplitudes.
    """

    p: float
    moves: FloatArray
    lag_s: float | None = None

    @property
    def matters(self) -> bool:
        """Whether it is both unlikely by chance and large."""
        return bool(self.p < UNLIKELY and self.moves.max() > MATTERS)


def scheduled(
    begun: Beginning,
    *,
    amplitude: FloatArray,
    amplitude_sd: FloatArray | None = None,
    every_s: float | None = None,
) -> Found:
    """K and B linear in the amplitudes.

    Parameters
    ----------
    begun : Beginning
    amplitude : (N, m)
        At the rate of `data`.
    amplitude_sd : (m,) or None
        Standard errors: taken off the moments, so that coefficients are not drawn towards zero.

    Raises
    ------
    InputError
        An amplitude that does not change.
    NotIdentifiableError
        Amplitudes that move together, or whose errors explain most of what is seen of them.
    """
    data = begun.data
    names = _names(amplitude.shape[1])
    change = amplitude.std(axis=0)
    for name, size in zip(names, change, strict=True):
        if size < LEAST_CHANGE:
            raise InputError(
                f"the amplitude of the {_word(name)} changes by {size:.1g} only",
                expected=f"more than {LEAST_CHANGE:g}: a contraction that varies",
            )
    law = np.column_stack([np.ones(len(amplitude)), amplitude])
    error = None if amplitude_sd is None else _errors(data, amplitude_sd)
    _refuse_alike(law, names, amplitude_sd)
    fit = fit_basis(data, begun.course, law, law, error)
    at, m = grid(data, every_s), law.shape[1]
    C = fit.covariance
    coefficients = _coefficients(fit, names)
    return Found(
        trial=data.trial_of[at],
        time_s=data.time_s[at],
        B=fit.course.B[at],
        K=fit.course.K[at],
        sd_B=_sd(law[at], fit.coefficients[:m], C[:m, :m], amplitude_sd),
        sd_K=_sd(law[at], fit.coefficients[m:], C[m:, m:], amplitude_sd),
        inertia=fit.course.inertia,
        sd_inertia=fit.sd_inertia,
        notes=(
            "linear in the amplitudes: "
            + ", ".join(f"{k} {v:.4g} +- {sd:.2g}" for k, (v, sd) in coefficients.items()),
        ),
        warnings=_warnings(data, fit, law, error),
        details={"coefficients": coefficients, "residual_over_noise": fit.excess},
    )


def _names(count: int) -> tuple[str, ...]:
    return ("F", "E")[:count] if count <= 2 else tuple(str(j + 1) for j in range(count))


def _word(name: str) -> str:
    return {"F": "flexor", "E": "extensor"}.get(name, f"muscle {name}")


def _coefficients(fit: BasisFit, names: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    labels = [f"{s}{n}" for s in "bk" for n in ("0", *names)]
    sd = np.sqrt(np.diag(fit.covariance))
    return {
        label: (float(v), float(e))
        for label, v, e in zip(labels, fit.coefficients, sd, strict=True)
    }


def _refuse_alike(law: FloatArray, names: tuple[str, ...], sd: FloatArray | None) -> None:
    """Amplitudes about their means must be told apart, beyond their errors."""
    about = law[:, 1:] - law[:, 1:].mean(axis=0)
    gram = (about.T @ about)[None]
    errors = np.zeros(len(names)) if sd is None else len(law) * sd**2
    words = tuple(f"the {_word(n)}'s amplitude" for n in names)
    refuse_unreliable(
        ErrorMoments(
            gram, np.zeros((1, len(names))), np.diag(errors)[None], words, ("",) * len(names)
        )
    )


def _errors(data: VaryingData, sd: FloatArray) -> FloatArray:
    """Draws (M, N, 2 (1 + m)) of the amplitudes' errors in the functions of B, then of K."""
    rng = np.random.default_rng(0)
    white = rng.standard_normal((ERROR_DRAWS, len(data.angle), len(sd)))
    band = min(ERROR_BAND_HZ, 0.45 * data.rate_hz)
    smooth = lowpass(white, band, data.rate_hz, order=5, axis=1)
    smooth *= sd / smooth.std(axis=(0, 1))
    none = np.zeros((*smooth.shape[:2], 1))
    one = np.concatenate([none, smooth], axis=2)
    return np.concatenate([one, one], axis=2)


def _sd(
    law: FloatArray, coefficients: FloatArray, C: FloatArray, sd: FloatArray | None
) -> FloatArray:
    """Standard error of ``law (L, 1 + m) c``: of the coefficients, and of the amplitudes."""
    variance = ((law @ C) * law).sum(axis=1)
    if sd is not None:
        variance = variance + float((coefficients[1:] ** 2) @ sd**2)
    return np.asarray(np.sqrt(variance))


def _warnings(
    data: VaryingData, fit: BasisFit, law: FloatArray, error: FloatArray | None
) -> tuple[str, ...]:
    told = []
    amplitude = law[:, 1:]
    m = amplitude.shape[1]
    pairs = [amplitude[:, i] * amplitude[:, j] for i in range(m) for j in range(i, m)]
    curved = departure(data, fit, law, np.column_stack(pairs), error)
    rate = _derivative(data, amplitude)
    late = departure(data, fit, law, rate, error, lagging=True)
    free = departure(data, fit, law, _free(data), error)
    if late.matters and late.lag_s is not None:
        told.append(
            f"K and B do not follow the amplitudes at once (p = {late.p:.1g}): a lag of about "
            f"{1e3 * late.lag_s:.0f} ms; the linear law does not hold"
        )
    if curved.matters:
        told.append(
            f"squares of the amplitudes are needed (p = {curved.p:.1g}; they move K by "
            f"{100 * curved.moves[1]:.0f} %, B by {100 * curved.moves[0]:.0f} %): the linear law "
            "does not hold"
        )
    if free.matters:
        told.append(
            f"K or B changes beside the amplitudes (p = {free.p:.1g}; by "
            f"{100 * free.moves[1]:.0f} % of K, {100 * free.moves[0]:.0f} % of B): the law does "
            "not hold"
        )
    return tuple(told)


def _free(data: VaryingData) -> FloatArray:
    """A free slow course: splines without their sum, which is the law's constant."""
    return spline_basis(data, FREE_PER_SECOND)[:, :-1]


def _derivative(data: VaryingData, amplitude: FloatArray) -> FloatArray:
    """Rates of the amplitudes, 1/s, within trials."""
    parts = [
        np.gradient(amplitude[a:b], 1 / data.rate_hz, axis=0)
        for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True)
    ]
    return np.concatenate(parts)


def departure(
    data: VaryingData,
    fit: BasisFit,
    law: FloatArray,
    further: FloatArray,
    error: FloatArray | None = None,
    *,
    lagging: bool = False,
) -> Departure:
    """Wald test of further functions (N, f) of B and K, made free of the law by projection.

    Parameters
    ----------
    lagging : bool
        The functions are the amplitudes' rates: a lag is read from their coefficients.
    """
    # what the law can itself say of the further functions is no departure: (N, f)
    fitted = np.linalg.lstsq(law, further, rcond=None)[0]
    away = np.zeros(fitted.shape) if lagging else np.asarray(fitted, dtype=np.float64)
    beside = further - law @ away
    eq, m, f = fit.eq, law.shape[1], beside.shape[1]
    columns = basis_columns(eq, np.column_stack([law, beside]), np.column_stack([law, beside]))
    q = columns.shape[1]
    extra = np.r_[1 + m : 1 + m + f, 1 + 2 * m + f : 1 + 2 * (m + f)]
    own = np.setdiff1d(np.arange(q), extra)
    white = eq.whitened(np.column_stack([columns, eq.y]))
    gram = white.T @ white
    A, b = gram[:-1, :-1], gram[:-1, -1]
    last = np.arange(q - len(eq.prior_sd), q)
    A[last, last] += eq.prior_sd**-2
    if error is not None:
        lost = _lost(data, law, f, error, lagging=lagging)[:, eq.centre]
        S = error_moments(eq, q, _all_errors(error[:, eq.centre], m, away, lost), m + f)
        A = A - S.sum(axis=0)
    # extra terms z (2 f,) with the own parameters eliminated: (A_zz - A_zo A_oo^-1 A_oz) z = r
    mixed = np.linalg.solve(A[np.ix_(own, own)], A[np.ix_(own, extra)])
    information = A[np.ix_(extra, extra)] - A[np.ix_(extra, own)] @ mixed
    right = b[extra] - mixed.T @ b[own]
    z = np.linalg.lstsq(information, right, rcond=1e-10)[0]
    full = np.zeros(q)
    full[extra] = z
    full[own] = np.linalg.solve(A[np.ix_(own, own)], b[own] - A[np.ix_(own, extra)] @ z)
    if error is None:
        noise = low_excess(white @ np.append(-full, 1.0))
        p = float(chdtrc(2 * f, max(float(z @ right), 0.0) / noise))
    else:
        spread = clustered(white, full, np.asarray(np.linalg.pinv(A, hermitian=True)), S)
        wald = float(z @ np.linalg.pinv(spread[np.ix_(extra, extra)], hermitian=True) @ z)
        rest = max(len(S) - q - 2 * f, 1)
        p = float(fdtrc(2 * f, rest, wald / (2 * f)))
    moved = np.stack([beside @ z[:f], beside @ z[f:]])
    means = np.array([np.abs(fit.course.B).mean(), np.abs(fit.course.K).mean()])
    moves = np.sqrt((moved**2).mean(axis=1)) / means
    return Departure(p, moves, _lag(fit, z, information, m) if lagging else None)


def _all_errors(error: FloatArray, m: int, away: FloatArray, lost: FloatArray) -> FloatArray:
    """Draws (M, R, 2 (m + f)) of the errors of law and further functions, of B, then of K."""
    own = error[:, :, :m]
    one = np.concatenate([own, lost - own @ away], axis=2)
    return np.concatenate([one, one], axis=2)


def _lost(
    data: VaryingData, law: FloatArray, f: int, error: FloatArray, *, lagging: bool
) -> FloatArray:
    """Draws (M, N, f) of what the further functions carry of the amplitudes' errors."""
    m = law.shape[1]
    n = error[:, :, 1:m]
    if lagging:
        return np.stack([_derivative(data, draw) for draw in n])
    pairs = [(i, j) for i in range(m - 1) for j in range(i, m - 1)]
    if f != len(pairs):
        return np.zeros((*n.shape[:2], f))
    a = law[:, 1:]
    return np.stack([a[:, i] * n[:, :, j] + a[:, j] * n[:, :, i] for i, j in pairs], axis=2)


def _lag(fit: BasisFit, z: FloatArray, information: FloatArray, m: int) -> float:
    """``a(t - lag) = a - lag a'``: the lag by which all coefficients of rates agree best."""
    c = np.concatenate([fit.coefficients[1:m], fit.coefficients[m + 1 :]])
    # z (2 (m - 1),) = -lag c, weighted by the information of z
    return float(-(c @ information @ z) / (c @ information @ c))
