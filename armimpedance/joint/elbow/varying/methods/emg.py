"""B(t) and K(t) scheduled by EMG amplitudes, eq. (4), in one regression, with tests of the law.

    K(t) = k0 + sum_j k_j a_j(t),   B(t) = b0 + sum_j b_j a_j(t)

The products of amplitude and motion are regressors of the weighted equation: no window, no filter
after the product. The law is assumed to be linear and without lag. Terms that would be needed
otherwise are tested, one kind at a time.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from scipy.optimize import nnls

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError, InputError
from armimpedance.joint.elbow.emg.roles import Directions, directions_of
from armimpedance.joint.elbow.varying.basis import BasisFit, fit_basis
from armimpedance.joint.elbow.varying.beginning import Beginning, own_torque, residual_of
from armimpedance.joint.elbow.varying.data import VaryingData
from armimpedance.joint.elbow.varying.departures import departures
from armimpedance.joint.elbow.varying.equation import Course
from armimpedance.joint.elbow.varying.method import (
    EstimatedCourse,
    VaryingMethod,
    VaryingOptions,
    grid,
)
from armimpedance.numerics.signals import lowpass

ERROR_DRAWS: Final = 32
#: Frequency above which an amplitude is only error; this shows when the error is large, Hz.
SLOW_HZ: Final = 2.5
#: Number of times that the weights are estimated from the law's residuals.
WEIGHT_ROUNDS: Final = 2
#: Rounds of a fit with preliminary weights.
FEW_ROUNDS: Final = 5
#: Least standard deviation of an amplitude for a law.
LEAST_CHANGE: Final = 1e-3


def scheduled(begun: Beginning, options: VaryingOptions) -> EstimatedCourse:
    """Fit K and B linear in the amplitudes; known errors are removed from the moments.

    Raises InputError: an amplitude that does not change.
    Raises NotIdentifiableError: every combination of the amplitudes is mostly error.
    """
    amplitude, amplitude_sd = options.amplitude, options.amplitude_sd
    data, names = begun.data, _names(amplitude.shape[1])
    _refuse_still(amplitude, names)
    directions = directions_of(amplitude, amplitude_sd, tuple(_word(n) for n in names))
    W = directions.weights
    law = np.column_stack([np.ones(len(amplitude)), amplitude @ W])
    # covariance (c, c) of the errors of the law's amplitudes at a sample
    error, spread = None, np.zeros((W.shape[1],) * 2)
    if amplitude_sd is not None:
        error = _errors(data, amplitude, amplitude_sd, W, options.amplitude_cutoff_hz)
        spread = W.T @ (amplitude_sd[:, None] ** 2 * W)
    course = begun.course
    for _ in range(WEIGHT_ROUNDS):
        course = fit_basis(data, course, law, law, error, strict=False, rounds=FEW_ROUNDS).course
        # the law's residual, including errors of the amplitudes, is the error of its rows
        data = replace(data, own=own_torque(residual_of(data, course)))
    fit, once = _law_fit(data, begun.course, course, law, error)
    at, m = grid(data, options.every_s), law.shape[1]
    details = {"residual_over_noise": fit.excess, **_details(fit, names, directions)}
    return EstimatedCourse(
        at=at,
        B=fit.course.B[at],
        K=fit.course.K[at],
        sd_B=_sd(law[at], fit.coefficients[:m], fit.covariance[:m, :m], spread),
        sd_K=_sd(law[at], fit.coefficients[m:], fit.covariance[m:, m:], spread),
        inertia=fit.course.inertia,
        sd_inertia=fit.sd_inertia,
        notes=(_note(details, directions),),
        warnings=(*directions.warnings, *once, *departures(data, fit, law, error)),
        details=details,
    )


def _refuse_still(amplitude: FloatArray, names: tuple[str, ...]) -> None:
    for name, size in zip(names, amplitude.std(axis=0), strict=True):
        if size < LEAST_CHANGE:
            raise InputError(
                f"the amplitude of the {_word(name)} changes by {size:.1g} only",
                expected=f"more than {LEAST_CHANGE:g}: a contraction that varies",
            )


def _law_fit(
    data: VaryingData, free: Course, near: Course, law: FloatArray, error: FloatArray | None
) -> tuple[BasisFit, tuple[str, ...]]:
    """Converged fit; or one step from the free course, which is consistent itself, with a
    warning."""
    try:
        return fit_basis(data, near, law, law, error), ()
    except EstimationError:
        if error is None:
            raise
    warning = "the law's rounds do not settle: solved once about a free course; K is hardly told"
    return fit_basis(data, free, law, law, error, strict=False, rounds=1), (warning,)


def _names(count: int) -> tuple[str, ...]:
    return ("F", "E")[:count] if count <= 2 else tuple(str(j + 1) for j in range(count))


def _word(name: str) -> str:
    return {"F": "flexor", "E": "extensor"}.get(name, f"muscle {name}")


def _details(fit: BasisFit, names: tuple[str, ...], apart: Directions) -> dict[str, Any]:
    """Coefficients with standard errors; only the combination if muscles cannot be separated."""
    if not apart.complete:
        return {"combination": apart.told}
    labels = [f"{s}{n}" for s in "bk" for n in ("0", *names)]
    sd = np.sqrt(np.diag(fit.covariance))
    values = zip(labels, fit.coefficients, sd, strict=True)
    return {"coefficients": {label: (float(v), float(e)) for label, v, e in values}}


def _note(details: dict[str, Any], apart: Directions) -> str:
    if not apart.complete:
        return f"linear in {apart.told}"
    coefficients = details["coefficients"].items()
    return "linear in the amplitudes: " + ", ".join(
        f"{k} {v:.4g} +- {sd:.2g}" for k, (v, sd) in coefficients
    )


def _errors(
    data: VaryingData, amplitude: FloatArray, sd: FloatArray, weights: FloatArray, band_hz: float
) -> FloatArray:
    """Draws (M, N, 2 (1 + m)) of the amplitudes' errors in the functions of B, then of K.

    Errors of an amplitude lie in the band of its low-pass.
    """
    rng = np.random.default_rng(0)
    white = rng.standard_normal((ERROR_DRAWS, len(data.angle), len(sd)))
    smooth = lowpass(white, min(band_hz, 0.45 * data.rate_hz), data.rate_hz, order=5, axis=1)
    smooth *= _profile(data, amplitude, sd) / smooth.std(axis=(0, 1))
    zero = np.zeros((*smooth.shape[:2], 1))
    functions = np.concatenate([zero, smooth @ weights], axis=2)
    return np.concatenate([functions, functions], axis=2)


def _profile(data: VaryingData, amplitude: FloatArray, sd: FloatArray) -> FloatArray:
    """Standard errors over time (N, m) whose mean squares are sd^2.

    The error of an EMG amplitude has a part proportional to the amplitude, and the electrodes'
    noise. Their shares follow from the fast part of the amplitude, which is error, as a function of
    its slow part.
    """
    out = np.empty_like(amplitude)
    for j, own in enumerate(sd):
        slow = np.concatenate(
            [
                lowpass(amplitude[a:b, j], SLOW_HZ, data.rate_hz, order=2, axis=0)
                for a, b in zip(data.offsets[:-1], data.offsets[1:], strict=True)
            ]
        )
        fast = amplitude[:, j] - slow
        both = np.stack([np.ones(len(slow)), slow**2], axis=1)
        # share (2,): fast^2 (N,) = both (N, 2) share
        share, _ = nnls(both, fast**2)
        square = both @ share
        out[:, j] = own * np.sqrt(square / square.mean()) if square.mean() > 0 else own
    return out


def _sd(law: FloatArray, coefficients: FloatArray, C: FloatArray, spread: FloatArray) -> FloatArray:
    """Standard error of ``law (L, 1 + c) p`` from the coefficients and the amplitudes."""
    own = float(coefficients[1:] @ spread @ coefficients[1:])
    return np.asarray(np.sqrt(((law @ C) * law).sum(axis=1) + own))


METHOD = VaryingMethod(
    "emg",
    "linear in the EMG amplitudes of flexor and extensor",
    "amplitude",
    "Ruiz (2011), eq. (4)",
    scheduled,
)
