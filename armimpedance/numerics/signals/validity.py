"""Checks of a recording before any fit, each with a verdict and its evidence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray, lengths
from armimpedance.core.conventions import FORCE_UNIT, POSITION_UNIT
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding, Verdict
from armimpedance.core.records import Recording, Window
from armimpedance.numerics.signals.sample_faults import check_held
from armimpedance.numerics.signals.windows import Timing, cut_windows, disturbance_times, flawed

LOWEST_RATE_HZ = 200.0
#: Samples that are processed together.
SAMPLES_TOGETHER: Final = 1 << 18
#: Residual displacement at the end, as a share of the peak, above which the error of the source's
#: one-sided drift correction exceeds its standard error.
RETURN_FRACTION = 0.02
#: Displacements below this are rounding errors (m, rad).
NO_WAY = 1e-9
#: Smallest over largest singular value of the peak displacements: 1 = all directions alike.
COVERAGE = 0.2
#: A force that stays exactly at its extreme for longer than this is clipped (s).
CLIPPED_S = 0.01
#: In addition, the extreme must be this share of the range away from rest, and this many times as
#: frequent as the value next to it.
FAR_FROM_REST = 0.1
HEAPED = 8.0
#: A quantisation step above this share of the peak-to-peak signal leaves too few levels.
STEP_FRACTION = 0.1
#: Fewest samples before the onset for a check of the rest.
FEWEST_AT_REST: Final = 10
#: A disturbance that leaves the limb further away than this is a movement (m, rad).
LONG_WAY: Final = {"hand": 0.03, "joint": 0.3}
#: Up to this share of the trials may be movements and are left out.
FEW_TRIALS = 0.1
#: Noise at rest above this share of the force's response is a warning.
NOISE_FRACTION = 0.5


def check_recording(recording: Recording, window: Window | None = None) -> tuple[Finding, ...]:
    """Run all checks that apply to a recording; a fault is a finding, not an exception.

    Parameters
    ----------
    recording : Recording
    window : Window, optional
        Its trials around their onsets, if the caller has cut them already.

    Returns
    -------
    tuple of Finding
        In a fixed order; `unusable` means that an estimate would be refused or meaningless.
    """
    checks = [_rate(recording), _gaps(recording), check_held(recording), _clipping(recording)]
    checks += [_step("force", recording.force, FORCE_UNIT[recording.kind])]
    checks += [_step("position", recording.position, POSITION_UNIT[recording.kind])]
    if recording.perturbation == "returning":
        checks += _disturbance_checks(recording, window)
    return tuple(checks)


def _needs(error: InputError) -> str:
    """Text of a finding from a refusal: the problem and what is needed."""
    return error.problem if error.expected is None else f"{error.problem}; needs {error.expected}"


def _disturbance_checks(recording: Recording, window: Window | None) -> Iterator[Finding]:
    unit = POSITION_UNIT[recording.kind]
    try:
        timing = disturbance_times(recording)
        if reaches := _reaches(recording, timing, unit):
            yield Finding("disturbance", "unusable", reaches)
            return
        window = window or cut_windows(recording, timing=timing)
    except InputError as error:
        yield Finding("disturbance", "unusable", _needs(error))
        return
    peak = _peak_displacement(window)
    size = np.linalg.norm(peak, axis=1)
    used = f"{int(window.usable.sum())} of {len(window.usable)} trials"
    source = "; ".join(window.notes) or "onset and end as stated in the trial table"
    verdict: Verdict = "ok" if window.usable.all() else "warning"
    text = f"{used}, median peak {_milli(float(np.median(size)), unit)}; {source}"
    yield Finding("disturbance", verdict, text)
    yield _returns(window, size, unit)
    groups = recording.trials.groupby("condition", sort=False).indices.items()
    uneven = [
        check
        for name, rows in groups
        for check in _coverage(str(name), peak[np.sort(rows)][window.usable[np.sort(rows)]])
    ]
    yield from uneven or [Finding("directions", "ok", "every condition covers its axes")]
    yield _rest_noise(window, FORCE_UNIT[recording.kind])
    yield _dissipation(window)


def _reaches(recording: Recording, timing: Timing, unit: str) -> str:
    """Problem if more than a few trials move far and do not return; "" if not.

    Windows leave out single trials of this kind and name them.
    """
    start, stop = recording.offsets[:-1], recording.offsets[1:] - 1
    rate, clock = recording.sample_rate_hz, recording.time_s[start]
    onset = start + np.round((timing.onset_s - clock) * rate).astype(np.int64)
    end = start + np.round((timing.end_s - clock) * rate).astype(np.int64)
    position = recording.position[np.clip([onset, end], start, stop)]
    distance = np.linalg.norm(position[1] - position[0], axis=1)
    judged = ~flawed(recording)
    far = judged & (distance > LONG_WAY[recording.kind])
    if far.sum() <= FEW_TRIALS * judged.sum():
        return ""
    moving = "the hand" if recording.kind == "hand" else "the joint"
    numbers = recording.trials["trial"].to_numpy()[far]
    first = ", ".join(map(str, numbers[:5])) + (", ..." if len(numbers) > 5 else "")
    return (
        f"{moving} moves {_milli(float(np.median(distance[far])), unit)} and does not return in "
        f"{len(numbers)} of {judged.sum()} trials ({first}): a movement, not a disturbance; leave "
        "these trials out, or mark them in the column is_error"
    )


def _milli(value: float, unit: str) -> str:
    return f"{value * 1e3:.2f} m{unit}" if unit == "m" else f"{value * 1e3:.1f} m{unit}"


def _peak_displacement(window: Window) -> FloatArray:
    """Largest displacement from the onset, (T, d); zeros for trials that are not used."""
    peaks = np.zeros_like(window.position_at_onset)
    for rows in _together(np.flatnonzero(window.usable), len(window.lag_s)):
        displacement = window.position[rows] - window.position_at_onset[rows][:, None]
        farthest = lengths(displacement).argmax(axis=1)
        peaks[rows] = displacement[np.arange(len(rows)), farthest]
    return peaks


def _together(rows: IntArray, samples: int) -> Iterator[IntArray]:
    """Yield rows of trials in pieces that are small enough for little memory."""
    count = max(1, SAMPLES_TOGETHER // samples)
    for first in range(0, len(rows), count):
        yield rows[first : first + count]


def _rate(recording: Recording) -> Finding:
    rate = recording.sample_rate_hz
    verdict: Verdict = "ok" if rate >= LOWEST_RATE_HZ else "warning"
    hint = "" if verdict == "ok" else f"; inertia needs at least {LOWEST_RATE_HZ:g} Hz"
    return Finding("rate", verdict, f"{rate:g} Hz{hint}")


def _gaps(recording: Recording) -> Finding:
    steps = np.diff(recording.time_s)
    inside = np.ones(len(steps), dtype=bool)
    inside[recording.offsets[1:-1] - 1] = False
    gaps = int((steps[inside] > 1.5 / recording.sample_rate_hz).sum())
    if gaps:
        return Finding("gaps", "unusable", f"{gaps} gaps in the samples")
    return Finding("gaps", "ok", "none")


def _runs(equal: BoolArray) -> IntArray:
    """Lengths of the runs of True; there must be at least one."""
    at = np.flatnonzero(equal)
    last = np.flatnonzero(np.diff(at, append=at[-1] + 2) > 1)
    return np.diff(last, prepend=-1)


def _clipping(recording: Recording) -> Finding:
    limit = max(3, round(CLIPPED_S * recording.sample_rate_hz))
    for axis, force in enumerate(recording.force.T):
        if np.ptp(force) == 0:
            continue
        for extreme in (force.max(), force.min()):
            runs = _runs(force == extreme)
            # the top of one smooth swing may stay on a step of the sensor for this long
            long = (runs > limit).sum() > 1 or runs.max() > 4 * limit
            if long and _heaped(force, extreme, recording.offsets):
                text = f"force axis {axis + 1} stays at {extreme:g} for {runs.max()} samples"
                return Finding("clipping", "warning", text)
    return Finding("clipping", "ok", "force never stays at its extreme")


def _heaped(force: FloatArray, extreme: float, offsets: IntArray) -> bool:
    """True if a force far from rest has its extreme far more often than the values next to it.

    A sensor at rest repeats its value, and a trial begins at rest. A quantised swing stays at its
    top about 2.4 times as long as at the step below.
    """
    far = abs(extreme - np.median(force[offsets[:-1]])) > FAR_FROM_REST * np.ptp(force)
    others = force[force != extreme]
    next_to_it = others[np.abs(others - extreme).argmin()]
    return bool(far and (force == extreme).sum() > HEAPED * (force == next_to_it).sum())


def _step(name: str, values: FloatArray, unit: str) -> Finding:
    worst, step_text = 0.0, "none seen"
    for axis in values.T:
        levels = np.unique(axis)
        span = float(levels[-1] - levels[0]) if len(levels) else 0.0
        if span == 0.0:
            text = f"{name} never changes on one axis"
            return Finding(f"{name} steps", "warning", text)
        step = _quantum(levels)
        if step / span > worst:
            worst, step_text = step / span, f"{step:.3g} {unit}"
    verdict: Verdict = "warning" if worst > STEP_FRACTION else "ok"
    return Finding(f"{name} steps", verdict, f"{step_text}, {100 * worst:.2g} % of the range")


def _quantum(levels: FloatArray) -> float:
    """Step of which all differences between levels are multiples; 0 if there is no such step."""
    differences = np.diff(levels)
    differences = differences[differences > 1e-9 * (levels[-1] - levels[0])]
    step = float(np.median(differences[differences < 1.5 * differences.min()]))
    multiples = differences / step
    off_grid = np.abs(multiples - np.round(multiples)) > 0.05 * np.maximum(1.0, multiples / 20)
    return 0.0 if off_grid.mean() > 0.01 else step


def _returns(window: Window, size: FloatArray, unit: str) -> Finding:
    end = np.searchsorted(window.lag_s, window.duration_s)
    end = np.minimum(end, len(window.lag_s) - 1)
    offset = window.position[np.arange(len(end)), end] - window.position_at_onset
    residual = np.linalg.norm(offset, axis=1)[window.usable]
    share = residual / np.maximum(size[window.usable], np.finfo(float).tiny)
    text = (
        f"residual at the end {_milli(float(np.median(residual)), unit)} (median), "
        f"{100 * float(np.median(share)):.1f} % of the peak"
    )
    if np.median(share) <= RETURN_FRACTION:
        return Finding("returns to start", "ok", text)
    return Finding("returns to start", "warning", f"{text}; do not use method 'paper' here")


def _coverage(condition: str, peak: FloatArray) -> Iterator[Finding]:
    """Check that the displacements of a condition (T, d) cover all axes."""
    if not len(peak) or not np.abs(peak).max() > NO_WAY:
        yield Finding("directions", "unusable", f"condition {condition}: no movement")
        return
    values, vectors = np.linalg.svd(peak, full_matrices=False)[1:]
    ratio = float(values[-1] / values[0]) if len(values) == peak.shape[1] else 0.0
    if ratio < 0.02:
        axis = ", ".join(f"{v:.2f}" for v in vectors[0])
        text = f"condition {condition}: one direction only ({axis}), others cannot be identified"
        yield Finding("directions", "unusable", text)
    elif ratio < COVERAGE:
        text = f"condition {condition}: uneven, smallest to largest {ratio:.2f}"
        yield Finding("directions", "warning", text)


def _rest_noise(window: Window, unit: str) -> Finding:
    if (window.lag_s <= 0).sum() < FEWEST_AT_REST:
        return Finding("noise at rest", "warning", "no rest recorded before the onset")
    noise, response = rms_at_rest(window)
    part = noise / response if response > 0 else np.inf
    verdict: Verdict = "ok" if part < NOISE_FRACTION else "warning"
    text = f"force sd {noise:.3g} {unit}, {100 * part:.0f} % of the response's rms"
    return Finding("noise at rest", verdict, text)


def rms_at_rest(window: Window) -> tuple[float, float]:
    """Rms of the force less its mean at rest: over the rest, and during the disturbance.

    Parameters
    ----------
    window : Window

    Returns
    -------
    tuple of float
    """
    rest = window.lag_s <= 0
    during = (window.lag_s > 0) & (window.lag_s <= window.duration_s[window.usable].max())
    used = np.flatnonzero(window.usable)
    squares = np.zeros(2)
    for rows in _together(used, len(window.lag_s)):
        force = window.force[rows]
        force -= force[:, rest].mean(axis=1, keepdims=True)
        np.square(force, out=force)
        squares += force[:, rest].sum(), force[:, during].sum()
    counts = len(used) * window.axes * np.array([rest.sum(), during.sum()])
    noise, response = np.sqrt(squares / counts)
    return float(noise), float(response)


def _dissipation(window: Window) -> Finding:
    """Check the sign of the force: over a returning disturbance a limb absorbs energy.

    ``W = integral F . X' dt < 0`` for a force by the limb, for any inertia and stiffness.
    """
    end = int(np.searchsorted(window.lag_s, window.duration_s[window.usable].max()))
    start = int(np.searchsorted(window.lag_s, 0.0))
    end = min(end, len(window.lag_s) - 1)
    pieces = _together(np.flatnonzero(window.usable), len(window.lag_s))
    work = np.concatenate([_work(window, rows, start, end) for rows in pieces])
    mean = float(work.mean())
    error = float(work.std(ddof=1) / np.sqrt(len(work))) if len(work) > 1 else abs(mean)
    text = f"work by the limb {mean * 1e3:.3g} mJ per disturbance"
    if mean > 3 * error:
        text += ": a limb cannot give energy; is the force that of the device (force_by)?"
        return Finding("force sign", "unusable", text)
    if mean > -2 * error:
        return Finding("force sign", "warning", text + ": too small to tell the sign")
    return Finding("force sign", "ok", text)


def _work(window: Window, rows: IntArray, start: int, end: int) -> FloatArray:
    """Work (T,) of the force from sample `start` to `end`, both signals less their ramps."""
    r = (window.lag_s - window.lag_s[start]) / (window.lag_s[end] - window.lag_s[start])

    def ended(signal: FloatArray, part: slice) -> FloatArray:
        # P s = s - s(t0) - r (s(tf) - s(t0)), see `numerics.signals.response`
        first, last = signal[:, start, None], signal[:, end, None]
        return np.asarray(signal[:, part] - first - r[part, None] * (last - first))

    # one more sample on either side, if there is one, for the velocity
    wider = slice(max(start - 1, 0), end + 2)
    velocity = np.gradient(ended(window.position[rows], wider), 1.0 / window.sample_rate_hz, axis=1)
    power = ended(window.force[rows], slice(start, end + 1))
    power *= velocity[:, start - wider.start :][:, : power.shape[1]]
    return np.asarray(power.sum(axis=(1, 2)) / window.sample_rate_hz)
