"""Damage to a record: what loose cables, wrong tables and hasty conversions do to real files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from broken.cell import Made

Record = Any
Damage = Callable[[Record, np.random.Generator], Record]


def channel(name: str, change: Callable[..., np.ndarray]) -> Damage:
    """Change a channel as a whole: ``change(values, rng, record)``."""
    return lambda record, rng: replace(
        record, **{name: change(np.array(getattr(record, name)), rng, record)}
    )


def gain(name: str, factor: float | tuple[float, ...]) -> Damage:
    """Another unit, a turned sign, or one axis with another gain."""
    return channel(name, lambda x, _r, _rec: x * np.asarray(factor))


def swapped_axes(name: str) -> Damage:
    """The first two axes change places."""
    return channel(name, lambda x, _r, _rec: x[:, [1, 0, *range(2, x.shape[1])]])


def turned(name: str, degrees: float) -> Damage:
    """The sensor is turned in the plane."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return channel(name, lambda x, _r, _rec: x @ np.array([[c, s], [-s, c]]))


def late(name: str, delay_s: float) -> Damage:
    """A channel that comes late by any time; each trial for itself."""

    def change(x: np.ndarray, _rng: Any, record: Record) -> np.ndarray:
        for first, last in zip(record.offsets, record.offsets[1:], strict=False):
            clock = np.arange(last - first) / record.sample_rate_hz
            for axis in range(x.shape[1]):
                x[first:last, axis] = np.interp(clock - delay_s, clock, x[first:last, axis])
        return x

    return channel(name, change)


def clipped(name: str, part: float) -> Damage:
    """A sensor whose range ends at this part of its largest departure from the median."""

    def change(x: np.ndarray, _rng: Any, _record: Record) -> np.ndarray:
        middle = np.median(x, axis=0)
        limit = part * np.abs(x - middle).max(axis=0)
        return np.clip(x, middle - limit, middle + limit)

    return channel(name, change)


def quantised(name: str, step: float) -> Damage:
    """A converter with steps as coarse as this."""
    return channel(name, lambda x, _r, _rec: np.round(x / step) * step)


def held(name: str, share: float, length_s: float) -> Damage:
    """Lost samples: the last one is repeated for a while, again and again."""

    def change(x: np.ndarray, rng: np.random.Generator, record: Record) -> np.ndarray:
        length = max(1, round(length_s * record.sample_rate_hz))
        count = max(1, round(share * len(x) / length))
        for start in rng.integers(1, len(x) - length, count):
            x[start : start + length] = x[start - 1]
        return x

    return channel(name, change)


def drifting(name: str, per_s: float) -> Damage:
    """A sensor that warms up: a ramp over each trial."""

    def change(x: np.ndarray, rng: np.random.Generator, record: Record) -> np.ndarray:
        sign = rng.choice([-1.0, 1.0], x.shape[1])
        return x + per_s * np.asarray(record.time_s)[:, None] * sign

    return channel(name, change)


def growing_gain(name: str, part: float) -> Damage:
    """A gain that goes from 1 to ``1 + part`` over the session."""
    return channel(name, lambda x, _r, _rec: x * (1 + part * np.linspace(0, 1, len(x)))[:, None])


def gain_from(name: str, factor: float | tuple[float, ...], part: float) -> Damage:
    """A gain that holds in the trials after this part of the session."""

    def change(x: np.ndarray, _rng: Any, record: Record) -> np.ndarray:
        x[record.offsets[round(part * record.n_trials)] :] *= np.asarray(factor)
        return x

    return channel(name, change)


def gain_from_the_middle(name: str, factor: float | tuple[float, ...]) -> Damage:
    """A gain that holds in the second half of the samples, of one long trial too."""

    def change(x: np.ndarray, _rng: Any, _record: Record) -> np.ndarray:
        x[len(x) // 2 :] *= np.asarray(factor)
        return x

    return channel(name, change)


def labels_exchanged(number: int) -> Damage:
    """The two conditions' names change places in one set."""

    def change(record: Record, _rng: np.random.Generator) -> Record:
        names = record.trials["condition"].to_numpy().astype(object)
        first, second = dict.fromkeys(names)
        inside = (record.trials["set"] == number).to_numpy()
        names[inside] = np.where(names[inside] == first, second, first)
        return replace(record, trials=record.trials.assign(condition=names))

    return change


def filtered(hertz: float, order: int, names: tuple[str, ...], zero_phase: bool) -> Damage:
    """Channels through a Butterworth low-pass before they are saved; each trial for itself."""
    from scipy.signal import butter, sosfilt, sosfilt_zi, sosfiltfilt

    def change(record: Record, _rng: np.random.Generator) -> Record:
        sos = butter(order, hertz, fs=record.sample_rate_hz, output="sos")
        for name in names:
            x = np.array(getattr(record, name))
            for first, last in zip(record.offsets, record.offsets[1:], strict=False):
                if zero_phase:
                    x[first:last] = sosfiltfilt(sos, x[first:last], axis=0)
                else:
                    start = sosfilt_zi(sos)[:, :, None] * x[first]
                    x[first:last] = sosfilt(sos, x[first:last], axis=0, zi=start)[0]
            record = replace(record, **{name: x})
        return record

    return change


def hum(name: str, amplitude: float, hertz: float = 50.0) -> Damage:
    """The mains in a channel; each trial begins at another instant of it."""

    def change(x: np.ndarray, rng: np.random.Generator, record: Record) -> np.ndarray:
        for first, last in zip(record.offsets, record.offsets[1:], strict=False):
            phase = rng.uniform(0, 2 * np.pi) + rng.uniform(-0.5, 0.5, x.shape[1])
            clock = 2 * np.pi * hertz * np.arange(last - first) / record.sample_rate_hz
            x[first:last] += amplitude * np.sin(clock[:, None] + phase)
        return x

    return channel(name, change)


def mixed(name: str, part: float) -> Damage:
    """Crosstalk: each of two channels holds a part of the other."""
    return channel(name, lambda x, _r, _rec: x @ np.array([[1.0, part], [part, 1.0]]))


def copied(record: Record, _rng: np.random.Generator) -> Record:
    """Every trial twice, the second time under another number."""
    n = record.n_trials
    table = pd.concat([record.trials, record.trials], ignore_index=True)
    table["trial"] = np.arange(1, 2 * n + 1)
    length = int(record.offsets[-1])
    twice = {
        name: np.concatenate([getattr(record, name)] * 2)
        for name in ("time_s", "position", "force", "joint_angles", "emg")
        if getattr(record, name, None) is not None
    }
    extra = {name: np.concatenate([value] * 2) for name, value in record.extra.items()}
    offsets = np.concatenate([record.offsets, length + np.asarray(record.offsets[1:])])
    return replace(record, trials=table, offsets=offsets, extra=extra, **twice)


def untimed(record: Record, _rng: np.random.Generator) -> Record:
    """The table without onsets and ends."""
    return replace(record, trials=record.trials.drop(columns=["onset_s", "end_s"], errors="ignore"))


def table(**columns: Any) -> Damage:
    """Other values in the trial table: of a function of its rows, or one for all."""

    def change(record: Record, _rng: np.random.Generator) -> Record:
        values = {k: v(record.trials) if callable(v) else v for k, v in columns.items()}
        return replace(record, trials=record.trials.assign(**values))

    return change


def both(*damages: Damage) -> Damage:
    """One after the other."""

    def change(record: Record, rng: np.random.Generator) -> Record:
        for damage in damages:
            record = damage(record, rng)
        return record

    return change


def told(**fields: Any) -> Damage:
    """Another word in `recording.json`."""
    return lambda record, _rng: replace(record, **fields)


def subject(**fields: float) -> Damage:
    """Numbers of the person multiplied."""

    def change(record: Record, _rng: np.random.Generator) -> Record:
        who = record.subject
        new = {k: getattr(who, k) * factor for k, factor in fields.items()}
        return replace(record, subject=replace(who, **new))

    return change


def with_truth(**truth: float) -> Callable[[Made, np.random.Generator], Made]:
    """The same record with another truth."""
    return lambda made, _rng: Made(made.record, {**made.truth, **truth}, made.beside)
