"""Trials that a recording holds twice: intervals would be too narrow by sqrt 2."""

from __future__ import annotations

from functools import reduce
from typing import Final

import numpy as np
from scipy.special import betainc

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording, Window

#: Averaging time: it leaves frequencies below about 100 Hz, which resampling hardly changes, s.
AVERAGED_S: Final = 0.004
#: Noise of two trials with this correlation or more is the same noise.
ALIKE: Final = 0.9
#: In addition, its distance from correlation 1 must be this many times less than that of others.
APART: Final = 10.0
#: In addition, the probability of such a pair by chance in the recording must be below this.
CHANCE: Final = 1e-3
#: Fewest means per trial for a comparison.
FEWEST: Final = 12
#: Least effective number of independent values in a trial's noise.
FEWEST_INDEPENDENT: Final = 2.0
#: Most trials that are compared with one another.
MOST_TRIALS: Final = 3000
#: Most samples of a trial that are compared.
MOST_SAMPLES: Final = 1 << 18
#: Noise below this share of the signal's range counts as none, as in a simulation without noise.
LEAST_NOISE: Final = 1e-6
#: Mains frequencies and first harmonics, Hz: two trials may begin at the same phase of them.
MAINS_HZ: Final = (50.0, 60.0, 100.0, 120.0)
#: Least rest before the onset to compare noise in, s; with less, whole trials are compared.
REST_S: Final = 0.05


def check_copies(recording: Recording, window: Window | None = None) -> Finding:
    """Check that no two trials hold the same noise, sample by sample.

    Third differences of means over 4 ms remove nearly all of a limb's movement and keep most of the
    sensors' noise. Two measured trials have different noise; trials that were copied, or resampled
    to another clock, share it.

    Parameters
    ----------
    recording : Recording
    window : Window, optional
        Its trials around their onsets: the rest before the onsets is compared, so that a robot
        that repeats its motion in every trial is not taken for a copy, and copies shifted in time
        are detected too. Default: trials from their first samples on.

    Returns
    -------
    Finding
        "copies"; unusable if there are any.

    Examples
    --------
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> from armimpedance.numerics.criticism import check_copies
    >>> check_copies(recording).verdict
    'ok'
    """
    if recording.n_trials < 2:
        return Finding("copies", "ok", "no noise by which trials could be told apart")
    signals, numbers = _aligned(recording, window)
    step = max(1, round(AVERAGED_S * recording.sample_rate_hz))
    least = [
        LEAST_NOISE * max(float(np.ptp(axis)) for axis in signal.T)
        for signal in (recording.force, recording.position)
    ]
    rate = recording.sample_rate_hz
    by_signal = [
        _noise(signal, step, rate, size) for signal, size in zip(signals, least, strict=True)
    ]
    noise = [signal for signal in by_signal if signal is not None]
    if len(numbers) < 2 or not noise:
        return Finding("copies", "ok", "no noise by which trials could be told apart")
    largest, partner, copied = _partners(noise, _repeats(window))
    if not copied.any():
        text = f"the most alike trials share {max(100 * largest, 0):.0f} % of their noise"
        seen = f"{100 * ALIKE:.0f} %"
        if largest > ALIKE:
            text += ", which chance does in records that were filtered as much"
            seen = "the same samples twice"
        return Finding("copies", "ok", text, smallest=seen)
    pairs = [(min(a, b), max(a, b)) for a, b in enumerate(partner) if copied[a]]
    shown = [f"{numbers[a]} = {numbers[b]}" for a, b in sorted(set(pairs))]
    more = f" and {len(shown) - 4} more" if len(shown) > 4 else ""
    text = (
        f"trials hold the same noise: {', '.join(shown[:4])}{more}; copies pretend to more data "
        "than there are: remove them"
    )
    return Finding("copies", "unusable", text)


def _partners(
    noise: list[FloatArray], repeats: BoolArray | None
) -> tuple[float, IntArray, BoolArray]:
    """Largest correlation of two trials' noise, partner of each trial, and the copies (T,)."""
    shared = [noise_of @ noise_of.T for noise_of in noise]
    similarity = reduce(np.minimum, shared)
    np.fill_diagonal(similarity, -1.0)
    best = similarity.max(axis=1)
    partner = similarity.argmax(axis=1)
    copied = best > ALIKE
    usual = np.median(similarity[copied], axis=1)
    copied[copied] = APART * (1 - best[copied]) < 1 - usual
    if copied.any():
        pairs = len(similarity) * (len(similarity) - 1) / 2
        likely = np.max([_chance(noise_of, partner, repeats) for noise_of in shared], axis=0)
        copied &= likely < np.log(CHANCE / pairs)
    return float(best.max()), partner, copied


def _repeats(window: Window | None) -> BoolArray | None:
    """Pairs of trials with the same disturbance, (T, T) bool; None if that is not known."""
    if window is None or window.disturbance is None:
        return None
    labels = window.disturbance[np.flatnonzero(window.usable)[:MOST_TRIALS]]
    return np.asarray(labels[:, None] == labels)


def _chance(shared: FloatArray, partner: IntArray, repeats: BoolArray | None) -> FloatArray:
    """Logarithm of the probability of such a correlation with the partner by chance, (T,).

    A filter leaves few independent values in a trial's noise, and smears the response into the rest
    before it; repeats of a disturbance have this in common. Two vectors of n independent values
    have a correlation r with ``r^2 ~ Beta(1/2, (n - 1)/2)``, whose mean ``1/n`` gives n.
    """
    every = np.arange(len(shared))
    others = ~np.eye(len(shared), dtype=bool)
    # a trial's copy is not one of the others
    others[every, np.where(others, shared, -2.0).argmax(axis=1)] = False
    kinds = [others] if repeats is None else [others, others & repeats]
    means = [float((shared[mask] ** 2).mean()) for mask in kinds if mask.any()]
    independent = max(1 / max(means, default=1 / FEWEST), FEWEST_INDEPENDENT)
    # P(r^2 > x) = I_(1-x)((n - 1)/2, 1/2), of positive r half of it
    rest = np.clip(1 - np.clip(shared[every, partner], 0.0, 1.0) ** 2, 0.0, 1.0)
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(betainc((independent - 1) / 2, 0.5, rest) / 2))


def _aligned(
    recording: Recording, window: Window | None
) -> tuple[tuple[FloatArray, FloatArray], IntArray]:
    """Force and position (T, S, d) of trials over the same time, and the trials' numbers."""
    if window is not None:
        used = np.flatnonzero(window.usable)[:MOST_TRIALS]
        rest = window.lag_s <= (0 if -window.lag_s[0] >= REST_S else np.inf)
        return (window.force[used][:, rest], window.position[used][:, rest]), window.trial[used]
    numbers = recording.trials["trial"].to_numpy(dtype=np.int64)[:MOST_TRIALS]
    length = min(int(np.diff(recording.offsets)[: len(numbers)].min()), MOST_SAMPLES)
    index = recording.offsets[: len(numbers), None] + np.arange(length)
    return (recording.force[index], recording.position[index]), numbers


def _noise(signal: FloatArray, step: int, rate_hz: float, least: float) -> FloatArray | None:
    """Changes of every trial that no limb can make, (T, n), of length 1; None if there are none."""
    trials, samples, d = signal.shape
    means = signal[:, : samples // step * step].reshape(trials, -1, step, d).mean(axis=2)
    if means.shape[1] < FEWEST:
        return None
    changes = _without_mains(np.diff(means, n=3, axis=1), rate_hz / step).reshape(trials, -1)
    size = np.linalg.norm(changes, axis=1, keepdims=True)
    if np.median(size) <= least:
        return None
    return np.where(size > least, changes / np.maximum(size, least), 0.0)


def _without_mains(changes: FloatArray, rate_hz: float) -> FloatArray:
    """Changes (T, n, d) without the mains hum of each trial and axis."""
    phase = 2 * np.pi * np.outer(np.arange(changes.shape[1]) / rate_hz, MAINS_HZ)
    hum = np.column_stack([np.cos(phase), np.sin(phase)])
    if 2 * hum.shape[1] > len(hum):
        return changes
    Q = np.linalg.qr(hum)[0]
    # (1 - Q Q^T) (n, n) times each trial (n, d)
    return np.asarray(changes - Q @ (Q.T @ changes))
