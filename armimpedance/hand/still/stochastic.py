"""Stochastic perturbations: band-limited least squares over blocks of a long record."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.core.records import ImpedanceEstimate, Recording, Response
from armimpedance.hand.still.prepared import impedance_factors
from armimpedance.hand.still.result import ClusteredKind, Group, to_estimate
from armimpedance.numerics.regression import TrialFactors, t_factor
from armimpedance.numerics.signals import bandpass, multiple_coherence, spline_kernels

#: Above voluntary drift, below where encoder noise outweighs acceleration.
DEFAULT_BAND_HZ = (5.0, 45.0)
#: Residuals of joint perturbations are correlated over some 0.1 s; blocks are far longer.
BLOCK_S = 1.0
#: Below this mean coherence a linear second-order model leaves too much unexplained.
LOW_COHERENCE = 0.8
#: Support of the differentiating kernel, in periods of the band's upper edge.
KERNEL_PERIODS = 0.6
#: A half of the band must differ from the whole by this many standard errors: by chance one of
#: three numbers of a joint does so in one of 360 records.
BEYOND_CHANCE = 3.5
#: Smaller relative differences do not matter, even if significant.
SMALL = 0.02
METHOD = "band-limited"
#: A trial of more samples than this is filtered in stretches of this length ...
LONG = 1 << 19
#: ... with this many periods of the band's width, or of its lower edge, on either side.
RINGING = 20


def estimate_stochastic(
    recording: Recording,
    group: Group,
    band_hz: tuple[float, float] = DEFAULT_BAND_HZ,
    covariance: ClusteredKind = "cr3",
) -> ImpedanceEstimate:
    """Fit ``M x'' + B x' + K x = -f`` after the same band-pass on all columns and on the force.

    Intervals are clustered by blocks of one second, so that one long trial is enough.

    `band_hz` (low, high).
    `recording`: one group's trials, each at least 4 s and two periods of the band's lower edge
    long.
    Raises InputError: if the band does not fit the sample rate or a trial is too short.
    Raises NotIdentifiableError: if the motion does not determine all parameters.
    """
    factors, coherence = _factors(recording, group, band_hz), _coherence(recording, band_hz)
    result = to_estimate(factors, group, method=METHOD, covariance=covariance, coherence=coherence)
    low, high = band_hz
    result = _as_sure_as_the_band(result, recording, group, band_hz)
    warnings = list(result.warnings)
    if coherence < LOW_COHERENCE:
        warnings.append(
            f"low coherence: {coherence:.2f} on average between {low:g} and {high:g} Hz; "
            "noise, a non-linear limb or one that changed during the record"
        )
    return replace(
        result,
        quality=replace(result.quality, n_trials=recording.n_trials),
        position=recording.position.mean(axis=0),
        force=recording.force.mean(axis=0),
        warnings=tuple(warnings),
        provenance=(
            *result.provenance,
            f"band {low:g}-{high:g} Hz, {factors.n_clusters} blocks of {BLOCK_S:g} s",
        ),
    )


def _factors(recording: Recording, group: Group, band_hz: tuple[float, float]) -> TrialFactors:
    # only the factors of a stretch are kept: a record may last for hours
    return _joined(
        [
            impedance_factors(response, group.kind, nuisance_per_trial=0)
            for response in _responses(recording, band_hz)
        ]
    )


def _as_sure_as_the_band(
    full: ImpedanceEstimate, recording: Recording, group: Group, band_hz: tuple[float, float]
) -> ImpedanceEstimate:
    """Widen intervals by significant differences between halves of the band, and warn of them."""
    low, high = band_hz
    middle = float(np.sqrt(low * high))
    widening, notes = np.zeros(len(full.covariance)), []
    for half in ((low, middle), (middle, high)):
        try:
            factors = _factors(recording, group, half)
            other = to_estimate(factors, group, method=METHOD, covariance="cr3")
        except (InputError, NotIdentifiableError):
            continue
        off = np.abs(other.parameters - full.parameters)
        # Errors of the two are partly common: their sum is an upper limit.
        sd = np.sqrt(np.diag(full.covariance) + np.diag(other.covariance))
        off[off <= np.maximum(BEYOND_CHANCE * sd, SMALL * np.abs(full.parameters))] = 0.0
        widening = np.maximum(widening, off)
        if off.any():
            worst = int((off / sd).argmax())
            value, whole = other.parameters[worst], full.parameters[worst]
            notes.append(
                f"{full.parameter_names[worst]} is {value:.3g} from {half[0]:.3g} to {half[1]:.3g} "
                f"Hz, {whole:.3g} in all of it"
            )
    if not notes:
        return full
    sentence = (
        f"the band decides: {'; '.join(notes)}; a reflex, a limb of another kind or the subject's "
        "own force; the intervals hold the halves of the band"
    )
    # C + diag(d / t)^2 (3 k^2, 3 k^2), d the difference of the halves: it adds to the half-widths
    more = np.diag((widening / t_factor(full.dof)) ** 2)
    return replace(full, covariance=full.covariance + more, warnings=(*full.warnings, sentence))


def stochastic_response(
    recording: Recording, band_hz: tuple[float, float] = DEFAULT_BAND_HZ
) -> Response:
    """Blocks of one second of all trials, band-passed as for the fit.

    `recording`: trials of a stochastic perturbation, as for `estimate_stochastic`.
    `band_hz` (low, high): the fitted band.
    Returns: its trials are the blocks.
    Raises InputError: if the band does not fit the sample rate or a trial is too short.
    """
    parts = list(_responses(recording, band_hz))
    names = ("displacement", "velocity", "acceleration", "force", "trial", "usable")
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in names
    }
    return replace(parts[0], **{**joined, "trial": np.arange(len(joined["trial"]))})


def _responses(recording: Recording, band_hz: tuple[float, float]) -> Iterator[Response]:
    """Yield equal blocks of all trials, which the regression uses as trials, stretch by stretch."""
    if not 0 < band_hz[0] < band_hz[1]:
        raise InputError(f"band {band_hz[0]:g} to {band_hz[1]:g} Hz", expected="0 < low < high")
    rate = recording.sample_rate_hz
    # Four blocks, and the samples cut off at both ends where the filter rings.
    needed_s = 4 * BLOCK_S + 2 / band_hz[0]
    for row in range(recording.n_trials):
        samples = recording.samples_of(row)
        motion, force = recording.position[samples], recording.force[samples]
        if len(motion) < needed_s * rate:
            raise InputError(
                f"trial {recording.trials['trial'].iloc[row]} lasts {len(motion) / rate:.2f} s",
                expected=f"at least {needed_s:.1f} s from {band_hz[0]:g} Hz on",
            )
        means = motion.mean(axis=0), force.mean(axis=0)
        for near, kept in _stretches(len(motion), rate, band_hz):
            channels = motion[near] - means[0], force[near] - means[1]
            part = _band_limited(*channels, rate, band_hz)[kept]
            yield _in_blocks(part, rate, recording.axes)


def _stretches(
    samples: int, sample_rate_hz: float, band_hz: tuple[float, float]
) -> Iterator[tuple[slice, slice]]:
    """Samples that are filtered together, and the filtered samples that fill whole blocks.

    A trial of usual length is one stretch. In a longer one each stretch is filtered with a margin
    on either side, so that the ringing at the ends is below rounding.
    """
    kernel = 2 * spline_kernels(KERNEL_PERIODS / band_hz[1], sample_rate_hz).half
    # The band-pass rings for some periods of its lower edge at both ends.
    filtered, edge = samples - kernel, round(sample_rate_hz / band_hz[0])
    length = round(BLOCK_S * sample_rate_hz)
    count = (filtered - 2 * edge) // length
    together = count if samples <= LONG else max(LONG // length, 2)
    rings = RINGING / min(band_hz[0], band_hz[1] - band_hz[0])
    margin = filtered if together == count else round(rings * sample_rate_hz)
    firsts = list(range(0, count - 1, together))
    for first, last in zip(firsts, [*firsts[1:], count], strict=True):
        begin, end = edge + first * length, edge + last * length
        low, high = max(begin - margin, 0), min(end + margin, filtered)
        yield slice(low, high + kernel), slice(begin - low, end - low)


def _coherence(recording: Recording, band_hz: tuple[float, float]) -> float:
    """Mean coherence of motion and force in the band, over all trials."""
    means = []
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        coherence = multiple_coherence(
            recording.position[at], recording.force[at], recording.sample_rate_hz
        )
        means.append(coherence.mean(*band_hz))
    return float(np.mean(means))


def _joined(parts: Sequence[TrialFactors]) -> TrialFactors:
    """Join the factors of all stretches."""
    if len(parts) == 1:
        return parts[0]
    constant = {part.intercept for part in parts}
    return replace(
        parts[0],
        r=np.concatenate([part.r for part in parts]),
        rows=np.concatenate([part.rows for part in parts]),
        intercept=parts[0].intercept if len(constant) == 1 else None,
    )


def _band_limited(
    motion: FloatArray, force: FloatArray, sample_rate_hz: float, band_hz: tuple[float, float]
) -> FloatArray:
    """Displacement, velocity, acceleration and force, (S, 4 d), through one filter."""
    kernels = spline_kernels(KERNEL_PERIODS / band_hz[1], sample_rate_hz)

    def convolve(signal: FloatArray, weights: FloatArray) -> FloatArray:
        # Correlation with the kernel = convolution with it reversed.
        columns = [np.convolve(column, weights[::-1], mode="valid") for column in signal.T]
        return np.column_stack(columns)

    stacked = np.hstack(
        [
            convolve(motion, kernels.smooth),
            convolve(motion, kernels.first),
            convolve(motion, kernels.second),
            convolve(force, kernels.smooth),
        ]
    )
    return bandpass(stacked, *band_hz, sample_rate_hz, axis=0)


def _in_blocks(part: FloatArray, sample_rate_hz: float, d: int) -> Response:
    """Cut samples (S, 4 d) of whole blocks into the blocks."""
    length = round(BLOCK_S * sample_rate_hz)
    blocks = part.reshape(-1, length, part.shape[1])
    return Response(
        sample_rate_hz=sample_rate_hz,
        lag_s=np.arange(length) / sample_rate_hz,
        displacement=blocks[..., :d],
        velocity=blocks[..., d : 2 * d],
        acceleration=blocks[..., 2 * d : 3 * d],
        force=blocks[..., 3 * d :],
        trial=np.arange(len(blocks)),
        usable=np.ones(len(blocks), dtype=bool),
    )
