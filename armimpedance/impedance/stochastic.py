"""Stochastic perturbations: band-limited least squares over blocks of a long record."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.impedance.regressors import impedance_factors
from armimpedance.impedance.result import ClusteredKind, Group, to_estimate
from armimpedance.records import ImpedanceEstimate, Recording, Response
from armimpedance.signals import bandpass, multiple_coherence, spline_kernels

#: Above voluntary drift, below where encoder noise outweighs acceleration.
DEFAULT_BAND_HZ = (5.0, 45.0)
#: Residuals of joint perturbations are correlated over some 0.1 s; blocks are far longer.
BLOCK_S = 1.0
#: Below this mean coherence a linear second-order model leaves too much unexplained.
LOW_COHERENCE = 0.8
#: Support of the differentiating kernel, in periods of the band's upper edge.
KERNEL_PERIODS = 0.6
METHOD = "band-limited"


@dataclass(frozen=True)
class _Blocks:
    """Equal blocks of all trials: what the regression takes for trials."""

    response: Response
    coherence: float


def estimate_stochastic(
    recording: Recording,
    group: Group,
    band_hz: tuple[float, float] = DEFAULT_BAND_HZ,
    covariance: ClusteredKind = "cr3",
) -> ImpedanceEstimate:
    """``M x'' + B x' + K x = -f`` after the same band-pass on all columns and on the force.

    Intervals are clustered by blocks of one second, so that one long trial is enough.

    Parameters
    ----------
    recording : Recording
        One group's trials, each at least 4 s and two periods of the band's lower edge long.
    group : Group
    band_hz : (low, high)
    covariance : {"cr3", "cr1"}

    Raises
    ------
    InputError
        If the band does not fit the sample rate or a trial is too short.
    NotIdentifiableError
        If the motion does not determine all parameters.
    """
    blocks = _blocks(recording, band_hz)
    factors = impedance_factors(blocks.response, group.kind, nuisance_per_trial=0)
    made = to_estimate(
        factors, group, method=METHOD, covariance=covariance, coherence=blocks.coherence
    )
    low, high = band_hz
    warnings = list(made.warnings)
    if blocks.coherence < LOW_COHERENCE:
        warnings.append(
            f"low coherence: {blocks.coherence:.2f} on average between {low:g} and {high:g} Hz; "
            "noise, a non-linear limb or one that changed during the record"
        )
    return replace(
        made,
        quality=replace(made.quality, n_trials=recording.n_trials),
        position=recording.position.mean(axis=0),
        force=recording.force.mean(axis=0),
        warnings=tuple(warnings),
        provenance=(
            *made.provenance,
            f"band {low:g}-{high:g} Hz, {len(blocks.response.trial)} blocks of {BLOCK_S:g} s",
        ),
    )


def stochastic_response(
    recording: Recording, band_hz: tuple[float, float] = DEFAULT_BAND_HZ
) -> Response:
    """Blocks of one second of all trials, band-passed as the fit takes them.

    Parameters
    ----------
    recording : Recording
        Trials of a stochastic perturbation, as `estimate_stochastic` takes them.
    band_hz : (low, high)
        The fitted band.

    Returns
    -------
    Response
        Its trials are the blocks.

    Raises
    ------
    InputError
        If the band does not fit the sample rate or a trial is too short.
    """
    return _blocks(recording, band_hz).response


def _blocks(recording: Recording, band_hz: tuple[float, float]) -> _Blocks:
    if not 0 < band_hz[0] < band_hz[1]:
        raise InputError(f"band {band_hz[0]:g} to {band_hz[1]:g} Hz", expected="0 < low < high")
    # Four blocks, and what is cut off at both ends where the filter rings.
    needed_s = 4 * BLOCK_S + 2 / band_hz[0]
    parts, coherence = [], []
    for row in range(recording.n_trials):
        samples = recording.samples_of(row)
        motion, force = recording.position[samples], recording.force[samples]
        trial = recording.trials["trial"].iloc[row]
        if len(motion) < needed_s * recording.sample_rate_hz:
            raise InputError(
                f"trial {trial} lasts {len(motion) / recording.sample_rate_hz:.2f} s",
                expected=f"at least {needed_s:.1f} s from {band_hz[0]:g} Hz on",
            )
        parts.append(_band_limited(motion, force, recording.sample_rate_hz, band_hz))
        found = multiple_coherence(motion, force, recording.sample_rate_hz)
        coherence.append(found.mean(*band_hz))
    blocks = np.concatenate([_cut(part, recording.sample_rate_hz) for part in parts])
    d = recording.axes
    response = Response(
        sample_rate_hz=recording.sample_rate_hz,
        lag_s=np.arange(blocks.shape[1]) / recording.sample_rate_hz,
        displacement=blocks[..., :d],
        velocity=blocks[..., d : 2 * d],
        acceleration=blocks[..., 2 * d : 3 * d],
        force=blocks[..., 3 * d :],
        trial=np.arange(len(blocks)),
        usable=np.ones(len(blocks), dtype=bool),
    )
    return _Blocks(response, float(np.mean(coherence)))


def _band_limited(
    motion: FloatArray, force: FloatArray, sample_rate_hz: float, band_hz: tuple[float, float]
) -> FloatArray:
    """Displacement, velocity, acceleration and force, (S, 4 d), all through one filter."""
    kernels = spline_kernels(KERNEL_PERIODS / band_hz[1], sample_rate_hz)
    motion = motion - motion.mean(axis=0)

    def convolve(signal: FloatArray, weights: FloatArray) -> FloatArray:
        # Correlation with the kernel = convolution with it reversed.
        columns = [np.convolve(column, weights[::-1], mode="valid") for column in signal.T]
        return np.column_stack(columns)

    stacked = np.hstack(
        [
            convolve(motion, kernels.smooth),
            convolve(motion, kernels.first),
            convolve(motion, kernels.second),
            convolve(force - force.mean(axis=0), kernels.smooth),
        ]
    )
    filtered = bandpass(stacked, *band_hz, sample_rate_hz, axis=0)
    # The band-pass rings for some periods of its lower edge at both ends.
    edge = round(sample_rate_hz / band_hz[0])
    return filtered[edge:-edge]


def _cut(part: FloatArray, sample_rate_hz: float) -> FloatArray:
    length = round(BLOCK_S * sample_rate_hz)
    count = len(part) // length
    return part[: count * length].reshape(count, length, part.shape[1])
