"""Motion-capture C3D files: markers, EMG, force plates and events, one file per trial."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import EmgSignals, MarkerRecording
from armimpedance.recordings.c3d.c3d_file import C3dFile, muscles_of, read_c3d
from armimpedance.recordings.c3d.events import (
    Event,
    LeftOut,
    beside,
    event_columns,
    events_of,
    model_outputs,
    sentences,
)
from armimpedance.recordings.c3d.forces import PlateForces, plates_taken
from armimpedance.recordings.motion.moving_metadata import (
    LARGEST_PLACE_M,
    Y_UP,
    Z_UP,
    lab_rotation,
    metres_per,
)

#: Units of voltage in such files, in V.
_VOLTS: Final = {"v": 1.0, "mv": 1e-3, "uv": 1e-6, "µv": 1e-6, "μv": 1e-6}
#: Two files have the same plates where their origins differ by less, m.
_SAME_PLACE_M: Final = 1e-3


@dataclass(frozen=True)
class _Choices:
    """The user's choices for all files."""

    prefix: str | None
    channels: tuple[str, ...]
    force_by: Literal["limb", "device"] | None


@dataclass(frozen=True)
class _Trial:
    names: tuple[str, ...]
    positions: FloatArray
    rate_hz: float
    emg: FloatArray
    emg_rate_hz: float
    plates: PlateForces | None
    events: tuple[Event, ...]
    remarks: tuple[str, ...]
    left_out: LeftOut


def read_marker_c3d(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    prefix: str | None = None,
    emg_channels: Mapping[str, str] | None = None,
    axes: Sequence[str] | None = None,
    force_by: Literal["limb", "device"] | None = None,
) -> MarkerRecording:
    """Read markers, force plates, events and, if requested, EMG from one C3D file per trial.

    A point whose residual is negative, or that lies exactly in the origin, was not seen. Points
    without a name (``*12``), a model's outputs (angles, moments, …) and all else that has no place
    in a recording are left out and listed in the provenance. Names of subjects are not read; labels
    may have them as a prefix (``name:marker``), which is removed where there is only one prefix.
    Events are columns of the trial table, ``event_<context>_<label>_s``.

    `path`: trials are numbered from 1; a trial's condition is its file's name without suffix.
    `prefix`: of several subjects, the one whose markers are read; ``""`` keeps labels unchanged.
    `emg_channels`: analog channel -> muscle, such as ``{"Biceps.EMG4": "biceps"}``.
    `axes`: the file's axes that point forward, left and up. If not stated, the axis that the first
    file shows upright on its screen (``POINT:Y_SCREEN``) points up, else z, and force plates must
    not contradict it.
    `force_by`: the one that exerts the force in the plates' channels; None: judged by their load.
    Raises InputError: a file cannot be read, has no markers, another rate, other markers or plates
    than the first, or no such channel; its unit is not known; or its plates lie on another axis.
    """
    paths = [path] if isinstance(path, str | os.PathLike) else list(path)
    if not paths:
        raise InputError("no file", expected="one C3D file per trial")
    muscles = muscles_of(emg_channels)
    captures = [read_c3d(p) for p in paths]
    trials, stated = _in_axes(captures, _Choices(prefix, tuple(muscles), force_by), axes)
    for trial, p in zip(trials[1:], paths[1:], strict=True):
        _check_same(trial, trials[0], p)
    lengths = [len(t.positions) for t in trials]
    plates = [t.plates for t in trials if t.plates is not None]
    table = {"trial": np.arange(1, len(paths) + 1), "condition": [Path(p).stem for p in paths]}
    return MarkerRecording(
        sample_rate_hz=trials[0].rate_hz,
        trials=pd.concat([pd.DataFrame(table), _event_table(trials)], axis=1),
        offsets=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        time_s=np.concatenate([np.arange(n) / trials[0].rate_hz for n in lengths]),
        positions=np.concatenate([t.positions for t in trials]),
        names=trials[0].names,
        wrenches=np.concatenate([p.wrenches for p in plates]) if plates else None,
        plate_origins_m=plates[0].origins_m if plates else None,
        emg=_emg(trials, tuple(muscles.values())) if muscles else None,
        provenance=_remarks(trials, stated),
    )


#: The mark between a marker's label and the number of a further trajectory.
_AGAIN: Final = "~"

#: The axis that points up -> the axes that point forward, left and up.
_WITH_UP: Final = {"z": Z_UP, "y": Y_UP, "x": ("y", "z", "x")}


def axes_shown(capture: C3dFile) -> tuple[str, ...] | None:
    """The axes forward, left and up by the file's screen parameters; None if it has none.

    ``POINT:Y_SCREEN`` names the axis that a program shows upright (C3D user guide, POINT group).
    """
    word = capture.parameters.text("POINT", "Y_SCREEN").strip().lower().removeprefix("+")
    return _WITH_UP.get(word)


def _in_axes(
    captures: Sequence[C3dFile], choices: _Choices, axes: Sequence[str] | None
) -> tuple[list[_Trial], Sequence[str]]:
    """The trials in the laboratory's axes, and the files' axes: stated, shown, or z up."""
    shown = axes or axes_shown(captures[0]) or Z_UP
    try:
        return [
            _trial(c, choices, lab_rotation(shown), stated=axes is not None) for c in captures
        ], shown
    except InputError:
        # Some programs write the axes of another view: z up is right if the plates then fit.
        if axes is not None or shown == Z_UP:
            raise
        return [_trial(c, choices, lab_rotation(Z_UP), stated=False) for c in captures], Z_UP


def _trial(capture: C3dFile, choices: _Choices, rotation: FloatArray, *, stated: bool) -> _Trial:
    if not capture.layout.frames or not capture.point_labels:
        rotations = len(capture.parameters.texts("ROTATION", "LABELS"))
        hint = f", only rotations of {rotations} segments" if rotations else ""
        raise InputError(f"no markers{hint}", file=capture.name, expected="points in a C3D file")
    names, index, left_out = _markers(capture, choices.prefix)
    metres = metres_per(capture.length_unit, capture.name)
    positions = _positions(capture, index, metres, rotation)
    plates = plates_taken(
        capture, metres, positions, rotation=rotation, stated=stated, force_by=choices.force_by
    )
    events, foreign = _events(capture, choices.prefix)
    return _Trial(
        names=names,
        positions=positions,
        rate_hz=capture.rate_hz,
        emg=_analog(capture, choices.channels),
        emg_rate_hz=capture.analog_rate_hz,
        plates=plates.forces,
        events=events,
        remarks=(
            *capture.layout.remarks,
            *_numbered_remarks(names),
            *(plates.forces.remarks if plates.forces else ()),
        ),
        left_out={
            **plates.left_out,
            **beside(capture, {*choices.channels, *plates.channels}),
            **foreign,
            **left_out,
        },
    )


def _markers(
    capture: C3dFile, prefix: str | None
) -> tuple[tuple[str, ...], list[int], dict[str, tuple[str, ...]]]:
    """Names of the markers, the indices of their points, and the points that were left out."""
    labels, outputs = capture.point_labels, model_outputs(capture)
    named = _named_points(labels)
    chosen = [i for i in named if labels[i] not in outputs]
    if not chosen:
        problem = f"none of its {len(labels)} points is a marker"
        raise InputError(problem, file=capture.name, expected="labelled places, no model's outputs")
    names = _without_prefix([labels[i] for i in chosen], prefix)
    kept = [(i, name) for i, name in zip(chosen, names, strict=True) if name is not None]
    if not kept:
        prefixes = sorted({label.partition(":")[0] for label in labels if ":" in label})
        expected = "one of " + (", ".join(prefixes) or "no prefix")
        raise InputError(f"no marker of {prefix!r}", file=capture.name, expected=expected)
    unique = tuple(str(name) for _, name in kept)
    unique = tuple(_numbered(unique))
    # The prefix is removed because it is a person's name.
    others = [labels[i].rpartition(":")[2] for i, n in zip(chosen, names, strict=True) if n is None]
    left_out = {"markers of another subject": tuple(others)}
    left_out |= _no_markers([labels[i] for i in named], outputs, len(labels) - len(named))
    return unique, [i for i, _ in kept], left_out


def _numbered(names: Sequence[str]) -> Iterator[str]:
    """Make names unique: a further trajectory with the same label is numbered."""
    used: set[str] = set()
    for name in names:
        new = next(n for i in range(1, len(names) + 2) if (n := _nth(name, i)) not in used)
        used.add(new)
        yield new


def _nth(name: str, number: int) -> str:
    return name if number == 1 else f"{name}{_AGAIN}{number}"


def _named_points(labels: Sequence[str]) -> list[int]:
    return [i for i, label in enumerate(labels) if label and not label.startswith("*")]


def _no_markers(
    named: list[str], outputs: Mapping[str, str], unlabelled: int
) -> dict[str, tuple[str, ...]]:
    """Points that are not markers, by reason."""
    reasons = {
        f"{kind} that a model made, no markers": tuple(
            label for label in named if outputs.get(label) == kind
        )
        for kind in dict.fromkeys(outputs.values())
    }
    unnamed = (f"{unlabelled} points without a name",) if unlabelled else ()
    return reasons | {"nothing says what they are": unnamed}


def _without_prefix(labels: list[str], prefix: str | None) -> list[str | None]:
    """Markers' names without the prefix; None for another subject's markers."""
    if prefix:
        start = prefix.removesuffix(":") + ":"
        return [n.removeprefix(start) if n.startswith(start) else None for n in labels]
    prefixes = {label.partition(":")[0] if ":" in label else None for label in labels}
    if prefix is None and len(prefixes) == 1 and None not in prefixes:
        return [label.partition(":")[2] for label in labels]
    return list(labels)


def _positions(
    capture: C3dFile, index: list[int], metres: float, rotation: FloatArray
) -> FloatArray:
    """Positions (F, P, 3) in m in the world's frame, NaN where a point was not seen."""
    points = capture.places(index)
    lost = capture.unseen(index) | ~np.isfinite(points).all(axis=2) | ~points.any(axis=2)
    points[lost] = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        places = points * metres @ rotation.T
    far = np.abs(places).max(initial=0.0)
    places[lost] = np.nan
    if not far <= LARGEST_PLACE_M:
        problem = f"a marker {far:.4g} m away in {capture.length_unit}"
        raise InputError(problem, file=capture.name, expected="another unit in the file")
    return places


def _events(
    capture: C3dFile, prefix: str | None
) -> tuple[tuple[Event, ...], dict[str, tuple[str, ...]]]:
    """The subject's events within the trial, and the other events by reason."""
    length = (capture.layout.frames - 0.5) / capture.rate_hz
    mine, outside, foreign = [], [], []
    for event in events_of(capture):
        shown = f"{event.name} at {event.time_s:.3f} s"
        if prefix and event.subject and event.subject != prefix.removesuffix(":"):
            foreign.append(shown)
        elif not -0.5 / capture.rate_hz <= event.time_s <= length:
            outside.append(shown)
        else:
            mine.append(event)
    return tuple(mine), {
        "events outside of the trial": tuple(outside),
        "events of another subject": tuple(foreign),
    }


def _event_table(trials: list[_Trial]) -> pd.DataFrame:
    """One row per trial and one column per event; empty where a trial lacks an event."""
    rows = [event_columns(trial.events) for trial in trials]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return pd.DataFrame([{n: row.get(n, np.nan) for n in columns} for row in rows], columns=columns)


def _analog(capture: C3dFile, channels: tuple[str, ...]) -> FloatArray:
    """These analog channels (samples, channels) in V."""
    units = capture.parameters.texts("ANALOG", "UNITS")
    scales, index = [], []
    for channel in channels:
        count = capture.analog_labels.count(channel)
        if count != 1:
            available = ", ".join(capture.analog_labels) or "no analog channels"
            problem = f"no channel {channel!r}" if not count else f"{count} channels {channel!r}"
            raise InputError(problem, file=capture.name, expected=f"one of {available}")
        i = capture.analog_labels.index(channel)
        unit = units[i] if i < len(units) and units[i] else "V"
        scale = _VOLTS.get(unit.lower())
        if scale is None:
            problem = f"channel {channel} is in {unit!r}"
            raise InputError(problem, file=capture.name, expected="V, mV or uV")
        scales.append(scale)
        index.append(i)
    values = capture.analog(index) * np.array(scales)
    lost = ~np.isfinite(values).all(axis=0)
    if lost.any():
        problem = f"channel {channels[int(np.argmax(lost))]} holds a value that is not finite"
        raise InputError(problem, file=capture.name, expected="numbers")
    return values


def _emg(trials: list[_Trial], muscles: tuple[str, ...]) -> EmgSignals:
    offsets = np.concatenate([[0], np.cumsum([len(t.emg) for t in trials])]).astype(np.int64)
    signals = np.concatenate([t.emg for t in trials])
    return EmgSignals(trials[0].emg_rate_hz, offsets, signals, muscles, "V")


def _check_same(trial: _Trial, first: _Trial, file: object) -> None:
    if trial.names != first.names:
        differing = sorted(set(trial.names) ^ set(first.names)) or ["their order"]
        raise InputError(
            f"other markers than in the first file ({', '.join(differing[:3])})",
            file=file,
            expected="the same markers in every trial",
        )
    if trial.rate_hz != first.rate_hz or trial.emg_rate_hz != first.emg_rate_hz:
        problem = f"{trial.rate_hz:g} frames/s"
        raise InputError(problem, file=file, expected=f"{first.rate_hz:g} as in the first file")
    origins, first_origins = (
        t.plates.origins_m if t.plates else np.zeros((0, 3)) for t in (trial, first)
    )
    if (
        origins.shape != first_origins.shape
        or np.abs(origins - first_origins).max(initial=0.0) > _SAME_PLACE_M
    ):
        problem = (
            f"other force plates than in the first file ({len(origins)}, not {len(first_origins)})"
        )
        if len(origins) == len(first_origins):
            problem = "force plates in other places than in the first file"
        raise InputError(problem, file=file, expected="the same plates in every trial")


def _numbered_remarks(names: Sequence[str]) -> Iterator[str]:
    again = [name for name in names if _AGAIN in name and name.partition(_AGAIN)[0] in names]
    if again:
        yield (
            f"Several trajectories of one label, numbered in the file's order: {', '.join(again)}; "
            "join or rename them in the program that wrote the file."
        )


def _remarks(trials: list[_Trial], axes: Sequence[str]) -> tuple[str, ...]:
    lost = np.concatenate([np.isnan(t.positions[..., 0]) for t in trials]).mean()
    trial_remarks = list(dict.fromkeys(remark for trial in trials for remark in trial.remarks))
    return (
        f"Read from C3D; forward, left and up are the file's {', '.join(axes)}.",
        f"Markers not seen: {100 * lost:.1f} % of the samples.",
        *trial_remarks,
        *sentences(trial.left_out for trial in trials),
    )
