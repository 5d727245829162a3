"""Bias of base parameters from noise of the coordinates, and its removal.

The regressor contains second derivatives of the coordinates, and noise in a regressor biases least
squares towards zero, which the covariance of the residuals does not show. The remedy is simulation
and extrapolation (Cook and Stefanski 1994, J Am Stat Assoc 89:1314-1328): noise of the same kind is
added, the estimate is repeated, and the straight line from twice the noise to the actual noise is
extended to no noise, ``b = 2 b(1) - mean b(2)``.

The added noise is the content of the coordinates above the frequencies of motion, each sample times
a random number. It therefore has the correlation between the coordinates' errors at that moment,
which varies with the posture for markers, and it is white, as the actual noise is assumed to be.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MotionRecording
from armimpedance.core.progress import Progress
from armimpedance.core.skeleton import Skeleton
from armimpedance.joint.body.rows import RowChoice
from armimpedance.numerics.signals import lowpass, smoothed_derivatives

#: Multiple of the cut-off above which there is only noise.
_ABOVE: Final = 2.5
#: Least share of the band above that for an estimate of the noise level.
_LEAST_BAND: Final = 0.2
#: Share of noise in an acceleration's variance above which the extrapolation is too inaccurate.
LARGEST_SHARE: Final = 0.3
NAME: Final = "angle noise"
#: Share of the mass below which a coordinate has little effect on any wrench.
_HEAVY: Final = 0.04
_ORDER: Final = 2
_GRID: Final = 4096


@dataclass(frozen=True)
class NoiseShift(FrozenRecord):
    """Bias of an estimate from noise of the coordinates.

    `shift` (b,): to be subtracted.
    `covariance` (b, b): covariance of the shift, from a finite number of draws.
    `level`: median sd of the angles' noise, rad.
    `share`: share of noise in the variance of an acceleration, for the noisiest coordinate that
    carries some of the mass.
    `noisiest`: name of that coordinate.
    """

    shift: Annotated[FloatArray, "b"]
    covariance: Annotated[FloatArray, "b b"]
    level: float
    share: float
    noisiest: str

    @property
    def finding(self) -> Finding:
        """Finding on whether the noise is small enough for the extrapolation to remove the bias."""
        shown = f"{1e3 * self.level:.2g} mrad, {100 * self.share:.0f} % of the acceleration of "
        smallest = f"{100 * LARGEST_SHARE:.0f} % of an acceleration"
        if self.share <= LARGEST_SHARE:
            message = (
                f"{shown}{self.noisiest}, less of others that carry mass; its bias was taken off"
            )
            return Finding(NAME, "ok", message, smallest=smallest)
        return Finding(
            NAME,
            "warning",
            f"{shown}{self.noisiest}: too much for a straight line back to none, errors may exceed "
            "the intervals; lower the cut-off, or take motions that move it more",
            smallest=smallest,
        )

    def left(self, values: FloatArray) -> FloatArray:
        """Bias (b,) that may remain after the linear extrapolation.

        An estimate is biased as ``b / (1 + r)``, r being the power of the noise over that of the
        signal in its regressor. The line then removes ``b r / ((1 + r) (1 + 2 r))`` and leaves 2 r
        times that; r is about the relative correction of a parameter. For parameters near zero the
        remaining bias is at most the correction itself.
        """
        size = np.maximum(np.abs(values), 1e-300)
        return np.minimum(2 * np.abs(self.shift) / size, 1.0) * self.shift

    def uncertainty(self, values: FloatArray) -> FloatArray:
        """Covariance (b, b) of the corrected values: finite draws, and the bias that may remain."""
        remaining = self.left(values)
        return self.covariance + np.outer(remaining, remaining)


def no_noise_finding(recording: MotionRecording, choice: RowChoice) -> Finding:
    """Finding if no bias was removed."""
    why = "was not looked at"
    if choice.cutoff_hz is None:
        why = "cannot be seen without a filter"
    elif not can_tell_noise(recording, choice):
        rate = f"{recording.sample_rate_hz:g} samples/s"
        why = f"cannot be seen at {rate} beside a motion of up to {choice.cutoff_hz:g} Hz"
    message = f"it {why}: it biases towards zero what accelerations tell, inside any interval"
    return Finding(NAME, "cannot tell", message)


def can_tell_noise(recording: MotionRecording, choice: RowChoice) -> bool:
    """True if there is a band above any motion in which the noise is visible."""
    if choice.cutoff_hz is None:
        return False
    return _ABOVE * choice.cutoff_hz <= (1 - _LEAST_BAND) * recording.sample_rate_hz / 2


def coordinate_noise(recording: MotionRecording, cutoff_hz: float) -> FloatArray:
    """Noise (N, n) of every sample, scaled to the size of white noise over the whole band.

    `cutoff_hz`: cut-off of the filter of the motion; above `_ABOVE` times that there is only noise.
    """
    edge, rate = _ABOVE * cutoff_hz, recording.sample_rate_hz
    noise = np.empty_like(recording.coordinates)
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        q = recording.coordinates[at]
        noise[at] = q - lowpass(q, edge, rate, order=_ORDER, axis=0)
    return noise / np.sqrt(_passed(edge, rate))


def noise_shift(
    recording: MotionRecording,
    choice: RowChoice,
    estimate: Callable[[MotionRecording], FloatArray],
    once: FloatArray,
    *,
    draws: int,
    seed: int = 0,
    progress: Progress | None = None,
) -> NoiseShift:
    """Estimate the bias of a recording's estimate from its noise.

    `recording`: the fitted trials.
    `choice`: with a cut-off.
    `estimate`: function from a recording to base parameters (b,).
    `once` (b,): base parameters of the recording itself.
    `draws`: number of draws, two or more.
    `progress`: called with the number of draws that are done and their total.
    """
    parts = coordinate_noise(recording, float(choice.cutoff_hz or 0.0))
    twice = []
    for draw in range(draws):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(draw,)))
        more = rng.standard_normal((len(parts), 1)) * parts
        twice.append(estimate(replace(recording, coordinates=recording.coordinates + more)))
        if progress is not None:
            progress(draw + 1, draws)
    moved = np.array(twice)
    angles = slice(3, None) if recording.skeleton.floating else slice(None)
    heavy = _carried(recording.skeleton)[angles] >= _HEAVY
    share = np.where(heavy, _acceleration_share(recording, choice, more)[angles], 0.0)
    noisiest = int(share.argmax())
    return NoiseShift(
        shift=moved.mean(axis=0) - once,
        covariance=np.atleast_2d(np.cov(moved, rowvar=False)) / draws,
        level=float(np.median(parts[:, angles].std(axis=0))),
        share=float(share[noisiest]),
        noisiest=recording.skeleton.coordinates[angles][noisiest],
    )


def _carried(skeleton: Skeleton) -> FloatArray:
    """Share of the skeleton's mass beyond each coordinate (n,); 1 if masses are not known."""
    beyond = {segment.name: float(segment.mass_kg) for segment in skeleton.segments}
    for segment in reversed(skeleton.segments):
        if segment.parent is not None:
            beyond[segment.parent] += beyond[segment.name]
    moved = [s.name for s in skeleton.segments for _ in s.hinges]
    whole = [skeleton.segments[0].name] * len(skeleton.root_coordinates)
    total = beyond[skeleton.segments[0].name]
    parts = np.array([beyond[name] for name in (*whole, *moved)])
    return parts / total if total > 0 else np.ones(len(parts))


def _acceleration_share(
    recording: MotionRecording, choice: RowChoice, noise: FloatArray
) -> FloatArray:
    """Variance of accelerations (n,) due to noise (N, n), over that of the recording's
    accelerations.
    """
    squares = np.zeros((2, noise.shape[1]))
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        for i, signal in enumerate((noise, recording.coordinates)):
            motion = smoothed_derivatives(signal[at], recording.sample_rate_hz, choice.cutoff_hz)
            squares[i] += (
                motion[2][choice.kept(len(motion[2]), recording.sample_rate_hz)] ** 2
            ).sum(axis=0)
    return np.asarray(squares[0] / np.maximum(squares[1], 1e-300))


def _passed(edge_hz: float, rate_hz: float) -> float:
    """Share of white noise's variance above the edge of a zero-phase filter."""
    from scipy.signal import butter, sosfreqz

    sos = butter(_ORDER, edge_hz, fs=rate_hz, output="sos")
    _, response = sosfreqz(sos, worN=_GRID)
    return float(np.mean((1 - np.abs(response) ** 2) ** 2))
