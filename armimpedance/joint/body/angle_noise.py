"""What noise of the coordinates does to base parameters, and taking it off.

Coordinates are differentiated twice into the regressor, and noise in a regressor biases least
squares towards zero: no covariance of the residuals sees that. Simulation and extrapolation (Cook
and Stefanski 1994, J Am Stat Assoc 89:1314-1328): noise of the same kind is added once more, the
estimate made again, and the line from twice the noise to once followed to none,
``b = 2 b(1) - mean b(2)``.

The noise is what the coordinates hold above any motion, each sample's times a random number: it
keeps how the coordinates' errors hang together at that moment, which markers change with the
posture, and is white as the first is taken to be.
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

#: Above this many times the cut-off there is noise only.
_ABOVE: Final = 2.5
#: Less of the band than this cannot tell the noise's level.
_LEAST_BAND: Final = 0.2
#: Part of an acceleration's variance beyond which the extrapolation leaves too much.
LARGEST_SHARE: Final = 0.3
NAME: Final = "angle noise"
#: A coordinate that carries less of the mass than this hardly shows in any wrench.
_HEAVY: Final = 0.04
_ORDER: Final = 2
_GRID: Final = 4096


@dataclass(frozen=True)
class NoiseShift(FrozenRecord):
    """What noise of the coordinates has done to an estimate.

    `shift` (b,): to be taken off.
    `covariance` (b, b): covariance of the shift, from a finite number of draws.
    `level`: median sd of the angles' noise, rad.
    `share`: part of the variance of an acceleration that is noise, of the noisiest coordinate that
    carries some of the mass.
    `noisiest`: that coordinate.
    """

    shift: Annotated[FloatArray, "b"]
    covariance: Annotated[FloatArray, "b b"]
    level: float
    share: float
    noisiest: str

    @property
    def finding(self) -> Finding:
        """Whether the angles are quiet enough for what was taken off to be all but all."""
        shown = f"{1e3 * self.level:.2g} mrad, {100 * self.share:.0f} % of the acceleration of "
        smallest = f"{100 * LARGEST_SHARE:.0f} % of an acceleration"
        if self.share <= LARGEST_SHARE:
            said = f"{shown}{self.noisiest}, less of others that carry mass; its bias was taken off"
            return Finding(NAME, "ok", said, smallest=smallest)
        return Finding(
            NAME,
            "warning",
            f"{shown}{self.noisiest}: too much for a straight line back to none, errors may exceed "
            "the intervals; lower the cut-off, or take motions that move it more",
            smallest=smallest,
        )

    def left(self, values: FloatArray) -> FloatArray:
        """What a straight line back to no noise may leave of the bias, (b,).

        An estimate falls as ``b / (1 + r)`` with the noise's share r of what it stands on. The line
        then takes off ``b r / ((1 + r) (1 + 2 r))`` and leaves 2 r times that, and r is about the
        part of a parameter that was taken off; of parameters near zero never more than that itself.
        """
        size = np.maximum(np.abs(values), 1e-300)
        return np.minimum(2 * np.abs(self.shift) / size, 1.0) * self.shift

    def uncertainty(self, values: FloatArray) -> FloatArray:
        """Covariance (b, b) of values less the shift: finite draws, and what may be left of it."""
        left = self.left(values)
        return self.covariance + np.outer(left, left)


def no_noise_finding(recording: MotionRecording, choice: RowChoice) -> Finding:
    """What is said where no noise was taken off."""
    why = "was not looked at"
    if choice.cutoff_hz is None:
        why = "cannot be seen without a filter"
    elif not can_tell_noise(recording, choice):
        rate = f"{recording.sample_rate_hz:g} samples/s"
        why = f"cannot be seen at {rate} beside a motion of up to {choice.cutoff_hz:g} Hz"
    said = f"it {why}: it biases towards zero what accelerations tell, inside any interval"
    return Finding(NAME, "cannot tell", said)


def can_tell_noise(recording: MotionRecording, choice: RowChoice) -> bool:
    """Whether a band above any motion is left in which the noise shows."""
    if choice.cutoff_hz is None:
        return False
    return _ABOVE * choice.cutoff_hz <= (1 - _LEAST_BAND) * recording.sample_rate_hz / 2


def coordinate_noise(recording: MotionRecording, cutoff_hz: float) -> FloatArray:
    """Noise (N, n) of every sample, of the size that white noise has over the whole band.

    `cutoff_hz`: cut-off of the filter that the motion goes through; above `_ABOVE` times that is
    noise.
    """
    edge, rate = _ABOVE * cutoff_hz, recording.sample_rate_hz
    left = np.empty_like(recording.coordinates)
    for row in range(recording.n_trials):
        at = recording.samples_of(row)
        q = recording.coordinates[at]
        left[at] = q - lowpass(q, edge, rate, order=_ORDER, axis=0)
    return left / np.sqrt(_passed(edge, rate))


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
    """How far the noise that is in a recording has moved its estimate.

    `recording`: the trials that were fitted.
    `choice`: with a cut-off.
    `estimate`: from a recording to base parameters (b,).
    `once` (b,): the recording's own.
    `draws`: two or more.
    `progress`: called with how many draws are done, of how many.
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
    """Part of the skeleton's mass beyond each coordinate (n,); 1 where masses are not known."""
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
    """Variance of the accelerations (n,) of noise (N, n) as a part of that of the recording's."""
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
    """Share of white noise's variance that lies above the edge of a zero-phase filter."""
    from scipy.signal import butter, sosfreqz

    sos = butter(_ORDER, edge_hz, fs=rate_hz, output="sos")
    _, response = sosfreqz(sos, worN=_GRID)
    return float(np.mean((1 - np.abs(response) ** 2) ** 2))
