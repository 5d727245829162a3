"""Errors of an EMG amplitude in regressors that are its products with motion.

What a regression scheduled by EMG (K and B over time) needs of `elbow.emg_errors`: draws of the
amplitude's errors, the moments that columns made of them add, and the small-sample term.
"""

from __future__ import annotations

import numpy as np

from armimpedance.elbow.emg_errors import ErrorMoments, settled_term
from armimpedance.errors import InputError
from armimpedance.records import FloatArray, IntArray
from armimpedance.signals.emg_carrier import lowpass_overlap
from armimpedance.signals.filters import lowpass


def amplitude_noise(
    sd: FloatArray,
    offsets: IntArray,
    sample_rate_hz: float,
    *,
    cutoff_hz: float,
    order: int,
    draws: int,
    seed: int,
) -> FloatArray:
    """Draws of the errors of a low-passed EMG amplitude, (D, N, m).

    A carrier's noise is white far beyond the low-pass, so errors of the amplitude are white noise
    through the same zero-phase low-pass, with the standard errors that the amplitude states.

    Parameters
    ----------
    sd : (N, m) or (m,)
        `EmgAmplitude.sd`, or `EmgAmplitude.noise_sd`, at the rate of the samples.
    offsets : (T + 1,)
        Trials of the N samples.
    cutoff_hz, order : float, int
        Of the amplitude's low-pass.

    Raises
    ------
    InputError
        A cut-off beyond half of the rate.
    """
    N = int(offsets[-1])
    size = np.broadcast_to(np.asarray(sd, dtype=np.float64), (N, np.shape(sd)[-1]))
    white = np.random.default_rng(seed).standard_normal((draws, N, size.shape[1]))
    noise = np.empty_like(white)
    for first, last in zip(offsets[:-1], offsets[1:], strict=True):
        noise[:, first:last] = lowpass(
            white[:, first:last], cutoff_hz, sample_rate_hz, order=order, axis=1
        )
    gain = lowpass_overlap(cutoff_hz, sample_rate_hz, order, 1, causal=False)[0]
    return np.asarray(noise * size / np.sqrt(gain))


def moments_of_products(
    W: FloatArray,
    y: FloatArray,
    noise: FloatArray,
    clusters: IntArray,
    *,
    names: tuple[str, ...],
    units: tuple[str, ...],
) -> ErrorMoments:
    """Moments of a regression whose columns are products of amplitude and motion, s(t) theta(t).

    Errors of the amplitude are independent of the motion, and every column is linear in the
    amplitude. What they add to ``W^T W`` is therefore the mean of ``U^T U`` over columns U made, in
    the very way W was (derivatives, products, filter, decimation, whitening), from draws of the
    errors alone in place of the amplitude (`amplitude_noise`): no formula for the filter is needed.
    Columns without amplitude (I, k_0, b_0) are zero in U.

    Parameters
    ----------
    W : (n, p)
    y : (n,)
    noise : (D, n, p)
        Columns of D draws. The mean over rows and draws counts: some 20 serve 10 s at 100 Hz.
    clusters : (C + 1,)
        Rows of cluster c are ``clusters[c]:clusters[c + 1]``; stretches of 1 s or more, so that
        clusters are independent.

    Raises
    ------
    InputError
        Shapes that do not belong together.
    """
    n, p = W.shape
    if noise.ndim != 3 or noise.shape[1:] != (n, p) or y.shape != (n,) or clusters[-1] != n:
        raise InputError(
            f"W {W.shape}, y {y.shape}, noise {noise.shape}, clusters up to {clusters[-1]}",
            expected="(n, p), (n,), (D, n, p), up to n",
        )
    parts = [slice(a, b) for a, b in zip(clusters[:-1], clusters[1:], strict=True)]
    return ErrorMoments(
        gram=np.array([W[c].T @ W[c] for c in parts]),
        cross=np.array([W[c].T @ y[c] for c in parts]),
        # S_c (p, p) = mean over draws of U_c^T (p, rows) U_c
        error=np.array(
            [(np.swapaxes(noise[:, c], 1, 2) @ noise[:, c]).mean(axis=0) for c in parts]
        ),
        names=names,
        units=units,
    )


def small_sample_of_products(W: FloatArray, noise: FloatArray, moments: ErrorMoments) -> FloatArray:
    """`emg_errors.small_sample_term` where errors are related over time, (p, p), from their draws.

    With ``C_d = W^T U_d``, ``T = mean of (C_d + C_d^T) M^-1 C_d``: for independent rows its
    expectation is the four terms of `emg_errors.small_sample_term`, those of ``S M^-1 S`` by way of
    the errors that are in W.

    Parameters
    ----------
    W : (n, p)
    noise : (D, n, p)
    moments : ErrorMoments
        Of these.
    """
    # C_d (p, p) = W^T (p, n) U_d (n, p)
    C = W.T @ noise
    both = C + np.swapaxes(C, 1, 2)
    return settled_term(moments, lambda inverse: np.asarray((both @ inverse @ C).mean(axis=0)))
