"""Motion-capture C3D files: markers and EMG, one file per trial."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError
from armimpedance.motion import EmgSignals, MarkerRecording
from armimpedance.recordings.c3d_file import C3DFile, muscles_of, read_c3d
from armimpedance.recordings.motion.lab_axes import Z_UP, lab_rotation, metres_per
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M

#: Units of voltage in such files, in V.
_VOLTS: Final = {"v": 1.0, "mv": 1e-3, "uv": 1e-6, "µv": 1e-6, "μv": 1e-6}


@dataclass(frozen=True)
class _Trial:
    names: tuple[str, ...]
    positions: FloatArray
    rate_hz: float
    emg: FloatArray
    emg_rate_hz: float
    unlabelled: int


def read_marker_c3d(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    prefix: str | None = None,
    emg_channels: Mapping[str, str] | None = None,
    axes: Sequence[str] = Z_UP,
) -> MarkerRecording:
    """Read markers, and EMG where it is asked for, from one C3D file per trial.

    A point whose residual is negative, or that lies in the origin to the last digit, was not seen.
    Points without a name (``*12``) are left out. Names of subjects are not read; labels may bear
    them as a prefix (``name:marker``), which is cut off where one prefix alone is used.

    Parameters
    ----------
    path : path or sequence of paths
        Trials are numbered from 1; a trial's condition is its file's name without suffix.
    prefix : str, optional
        The subject whose markers are read, of several; ``""`` keeps the labels as they are.
    emg_channels : mapping, optional
        Analog channel -> muscle, such as ``{"Biceps.EMG4": "biceps"}``.
    axes : sequence of three str
        The file's axes that point forward, left and up.

    Raises
    ------
    InputError
        A file cannot be read, has no markers, another rate or other markers than the first, or no
        such channel; or its unit is not known.
    """
    given = [path] if isinstance(path, str | os.PathLike) else list(path)
    if not given:
        raise InputError("no file", expected="one C3D file per trial")
    muscles = muscles_of(emg_channels)
    rotation = lab_rotation(axes)
    trials = [_trial(read_c3d(p), prefix, tuple(muscles), rotation) for p in given]
    first = trials[0]
    for trial, p in zip(trials[1:], given[1:], strict=True):
        _check_same(trial, first, p)
    lengths = [len(t.positions) for t in trials]
    offsets = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
    conditions = [Path(p).stem for p in given]
    return MarkerRecording(
        sample_rate_hz=first.rate_hz,
        trials=pd.DataFrame({"trial": np.arange(1, len(given) + 1), "condition": conditions}),
        offsets=offsets,
        time_s=np.concatenate([np.arange(n) / first.rate_hz for n in lengths]),
        positions=np.concatenate([t.positions for t in trials]),
        names=first.names,
        emg=_emg(trials, tuple(muscles.values())) if muscles else None,
        provenance=_remarks(trials, axes),
    )


def _trial(
    c3d: C3DFile, prefix: str | None, channels: tuple[str, ...], rotation: FloatArray
) -> _Trial:
    if not c3d.frames or not len(c3d.point_labels):
        raise InputError("no markers", file=c3d.name, expected="points in a C3D file")
    labels = [*c3d.point_labels]
    chosen = [i for i, label in enumerate(labels) if label and not label.startswith("*")]
    names = _without_prefix([labels[i] for i in chosen], prefix)
    kept = [(i, name) for i, name in zip(chosen, names, strict=True) if name is not None]
    if not kept:
        prefixes = sorted({label.partition(":")[0] for label in labels if ":" in label})
        expected = "one of " + (", ".join(prefixes) or "no prefix")
        raise InputError(f"no marker of {prefix!r}", file=c3d.name, expected=expected)
    twice = [name for _, name in kept if [n for _, n in kept].count(name) > 1]
    if twice:
        raise InputError(f"two markers {twice[0]}", file=c3d.name, expected="different labels")
    index = [i for i, _ in kept]
    return _Trial(
        names=tuple(str(name) for _, name in kept),
        positions=_positions(c3d, index, rotation),
        rate_hz=c3d.rate_hz,
        emg=_analog(c3d, channels),
        emg_rate_hz=c3d.rate_hz * max(c3d.samples_per_frame, 1),
        unlabelled=len(labels) - len(chosen),
    )


def _without_prefix(labels: list[str], prefix: str | None) -> list[str | None]:
    """Markers' names; None for another subject's."""
    if prefix:
        start = prefix.removesuffix(":") + ":"
        return [n.removeprefix(start) if n.startswith(start) else None for n in labels]
    prefixes = {label.partition(":")[0] if ":" in label else None for label in labels}
    if prefix is None and len(prefixes) == 1 and None not in prefixes:
        return [label.partition(":")[2] for label in labels]
    return list(labels)


def _positions(c3d: C3DFile, index: list[int], rotation: FloatArray) -> FloatArray:
    """Places (F, P, 3) in m in the world's frame, NaN where a point was not seen."""
    unit = c3d.text("POINT", "UNITS") or "mm"
    points = c3d.points[:, index].astype(np.float64)
    lost = (c3d.residual[:, index] < 0) | ~np.isfinite(points).all(axis=2) | ~points.any(axis=2)
    places = points * metres_per(unit, c3d.name) @ rotation.T
    places[lost] = np.nan
    far = np.nanmax(np.abs(places), initial=0.0)
    if far > LARGEST_PLACE_M:
        expected = "another unit in the file"
        raise InputError(f"a marker {far:.4g} m away in {unit}", file=c3d.name, expected=expected)
    return places


def _analog(c3d: C3DFile, channels: tuple[str, ...]) -> FloatArray:
    """These analog channels (samples, m) in V."""
    units = c3d.texts("ANALOG", "UNITS")
    columns = []
    for channel in channels:
        if channel not in c3d.analog_labels:
            there = ", ".join(c3d.analog_labels) or "no analog channels"
            raise InputError(f"no channel {channel!r}", file=c3d.name, expected=f"one of {there}")
        i = c3d.analog_labels.index(channel)
        unit = units[i] if i < len(units) and units[i] else "V"
        scale = _VOLTS.get(unit.lower())
        if scale is None:
            problem = f"channel {channel} is in {unit!r}"
            raise InputError(problem, file=c3d.name, expected="V, mV or uV")
        columns.append(c3d.analog[:, i] * scale)
    return np.stack(columns, axis=1) if columns else np.zeros((len(c3d.analog), 0))


def _emg(trials: list[_Trial], muscles: tuple[str, ...]) -> EmgSignals:
    offsets = np.concatenate([[0], np.cumsum([len(t.emg) for t in trials])]).astype(np.int64)
    signals = np.concatenate([t.emg for t in trials])
    return EmgSignals(trials[0].emg_rate_hz, offsets, signals, muscles, "V")


def _check_same(trial: _Trial, first: _Trial, file: object) -> None:
    if trial.names != first.names:
        odd = sorted(set(trial.names) ^ set(first.names)) or ["their order"]
        raise InputError(
            f"other markers than in the first file ({', '.join(odd[:3])})",
            file=file,
            expected="the same markers in every trial",
        )
    if trial.rate_hz != first.rate_hz or trial.emg_rate_hz != first.emg_rate_hz:
        problem = f"{trial.rate_hz:g} frames/s"
        raise InputError(problem, file=file, expected=f"{first.rate_hz:g} as in the first file")


def _remarks(trials: list[_Trial], axes: Sequence[str]) -> tuple[str, ...]:
    lost = np.concatenate([np.isnan(t.positions[..., 0]) for t in trials]).mean()
    remarks = [
        f"Read from C3D; forward, left and up are the file's {', '.join(axes)}.",
        f"Markers not seen: {100 * lost:.1f} % of the samples.",
    ]
    unlabelled = max(t.unlabelled for t in trials)
    if unlabelled:
        remarks.append(f"{unlabelled} points without a name were left out.")
    return tuple(remarks)
