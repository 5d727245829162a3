"""A recording as a dataset of Motion-BIDS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text
from armimpedance.core.records import Recording
from armimpedance.recordings import AnyRecording
from armimpedance.show.files.sharing.bids_text import (
    checked_label,
    label,
    mapping_text,
    write_bdf,
    write_description,
    write_json,
    write_numbers,
    write_table,
)
from armimpedance.show.files.sharing.columns import DescribedColumn, sample_columns, trial_column
from armimpedance.show.files.sharing.form import Shared

_SIZES: Final = {"mass_kg": ("weight", "kg", 1.0), "height_m": ("height", "m", 1.0)}
#: The head of a skeleton's file.
_SKELETON: Final = {"format": "armimpedance-skeleton", "version": 1}
_NO_DATE: Final = "1900-01-01T00:00:00"
_TYPES: Final = ("POS", "JNTANG", "MISC")
#: Directions of the axes: the hand's frame (x right, y forward), the world's (x forward, y left).
_HAND_AXES: Final = "RAS"
_WORLD_AXES: Final = "ALS"

README: Final = """\
# {name}

{description}

Written by armimpedance {version} in the layout of Motion-BIDS. Numbers stand in the
tables with all their digits; units are in `_channels.tsv`.

{trials}

`trial_time` is each trial's own clock. {reading}
"""


@dataclass(frozen=True)
class _Stretch:
    """Trials that stand in one file."""

    run: int | None
    rows: slice
    trials: range


def write_motion_dataset(shared: Shared, folder: Path) -> tuple[str, ...]:
    """Write a dataset of one person's recording.

    `folder`: empty.
    Returns: what was left out or is not known.
    Raises InputError: more than one recording, or a label that is none.
    """
    if len(shared.recordings) != 1 or shared.results:
        raise InputError("a dataset of BIDS", expected="one recording")
    path, recording = shared.recordings[0]
    person, task = _labels(shared, path, recording)
    notes = list(_not_told(write_description(folder, shared, "raw")))
    _write_people(folder, person, recording)
    own = folder / f"sub-{person}" / "motion"
    own.mkdir(parents=True)
    (folder / "code").mkdir()
    columns = sample_columns(recording)
    for stretch in _stretches(recording):
        notes += _write_run(own, f"sub-{person}_task-{task}", task, recording, columns, stretch)
    if not isinstance(recording, Recording) and recording.emg is not None:
        _write_scans(own.parent)
    reading = _write_code(folder / "code", recording)
    text = README.format(
        name=shared.statement.name or path.resolve().stem,
        description=shared.statement.description or "(No description was given.)",
        version=shared.version,
        trials=_TRIALS["one" if isinstance(recording, Recording) else "each"],
        reading=reading,
    )
    (folder / "README.md").write_text(text, encoding="utf-8")
    return tuple(dict.fromkeys(notes))


_TRIALS: Final = {
    "one": "All trials stand one after another in one file, without the pauses between them: the\n"
    "rows of `_events.tsv` with trial_type `trial` say where each begins, and hold its condition.",
    "each": "Each trial is a run; the row of its `_events.tsv` holds its condition.",
}


def _not_told(fields: Sequence[str]) -> tuple[str, ...]:
    names = {"License": "--licence", "Authors": "--creator"}
    return tuple(f"Not told, and left out: {name} ({names[name]})." for name in fields)


def _labels(shared: Shared, path: Path, recording: AnyRecording) -> tuple[str, str]:
    own = recording.subject.id
    person, task = shared.person, shared.task
    return (
        checked_label(person, "--subject")
        if person
        else label("" if own == "unknown" else own, "01"),
        checked_label(task, "--task") if task else label(path.resolve().stem, "task"),
    )


def _write_people(folder: Path, person: str, recording: AnyRecording) -> None:
    sizes = {k: getattr(recording.subject, k) for k in _SIZES}
    sizes_of_person = {_SIZES[k][0]: v for k, v in sizes.items() if v is not None}
    row = {"participant_id": f"sub-{person}", **sizes_of_person}
    write_table(folder / "participants.tsv", list(row), [row])
    described = {
        name: {"Description": f"{'mass' if unit == 'kg' else name} of the body", "Units": unit}
        for name, unit, _ in _SIZES.values()
        if name in sizes_of_person
    }
    if described:
        write_json(folder / "participants.json", described)


def _stretches(recording: AnyRecording) -> list[_Stretch]:
    """All trials in one file; of motion capture each trial in its own."""
    count = len(recording.trials)
    offsets = recording.offsets
    if isinstance(recording, Recording):
        return [_Stretch(None, slice(0, int(offsets[-1])), range(count))]
    if count == 1:
        return [_Stretch(None, slice(0, int(offsets[-1])), range(1))]
    return [
        _Stretch(t + 1, slice(int(offsets[t]), int(offsets[t + 1])), range(t, t + 1))
        for t in range(count)
    ]


def _write_run(
    folder: Path,
    beginning: str,
    task: str,
    recording: AnyRecording,
    columns: Sequence[DescribedColumn],
    stretch: _Stretch,
) -> tuple[str, ...]:
    system = "device" if isinstance(recording, Recording) else "mocap"
    run = "" if stretch.run is None else f"_run-{stretch.run}"
    stem = f"{beginning}_tracksys-{system}{run}"
    write_numbers(folder / f"{stem}_motion.tsv", [c.values[stretch.rows] for c in columns])
    rows = stretch.rows.stop - stretch.rows.start
    write_json(folder / f"{stem}_motion.json", _motion_json(task, recording, columns, rows))
    _write_channels(folder / f"{stem}_channels", recording, columns)
    emg = None if isinstance(recording, Recording) else recording.emg
    lengths = None if emg is None else np.diff(emg.offsets) / emg.sample_rate_hz
    _write_events(folder / f"{stem}_events", recording, stretch, lengths)
    if emg is None:
        return ()
    own = folder.parent / "emg"
    own.mkdir(exist_ok=True)
    return write_bdf(own / f"{beginning}{run}_emg", task, emg, stretch.trials[0])


def _write_scans(person: Path) -> None:
    """Say that the systems of each run began together, by a date that is plainly none."""
    files = sorted(p for p in person.rglob("*") if p.name.endswith(("_motion.tsv", ".bdf")))
    rows = [{"filename": p.relative_to(person).as_posix(), "acq_time": _NO_DATE} for p in files]
    write_table(person / f"{person.name}_scans.tsv", ["filename", "acq_time"], rows)
    note = "Not when it was recorded: equal dates mean that systems began together."
    write_json(person / f"{person.name}_scans.json", {"acq_time": {"Description": note}})


def _motion_json(
    task: str, recording: AnyRecording, columns: Sequence[DescribedColumn], rows: int
) -> dict[str, Any]:
    counts = {kind: sum(c.kind == kind for c in columns) for kind in _TYPES}
    several = isinstance(recording, Recording) and len(recording.trials) > 1
    return {
        "TaskName": task,
        "SamplingFrequency": float(recording.sample_rate_hz),
        "MotionChannelCount": len(columns),
        "POSChannelCount": counts["POS"],
        "JNTANGChannelCount": counts["JNTANG"],
        "MiscChannelCount": counts["MISC"],
        "TrackedPointsCount": len({c.point for c in columns if c.kind == "POS"}),
        "RecordingDuration": rows / float(recording.sample_rate_hz),
        "RecordingType": "discontinuous" if several else "continuous",
        "MissingValues": "n/a",
    }


def _write_channels(
    stem: Path, recording: AnyRecording, columns: Sequence[DescribedColumn]
) -> None:
    names = ["name", "component", "type", "tracked_point", "units", "reference_frame"]
    rows = [
        {
            "name": c.name,
            "component": c.component,
            "type": c.kind,
            "tracked_point": c.point,
            "units": c.unit,
            "reference_frame": c.frame,
            "description": c.words,
        }
        for c in columns
    ]
    write_table(stem.with_name(stem.name + ".tsv"), [*names, "description"], rows)
    hand = isinstance(recording, Recording)
    where = "x to the right, y forward; a left arm is mirrored" if hand else "fixed in the room"
    frame = {
        "Description": f"Right-handed, {where}.",
        "SpatialAxes": _HAND_AXES if hand else _WORLD_AXES,
        "RotationRule": "right-hand",
    }
    content = {"reference_frame": {"Description": "frame of a position", "Levels": {"lab": frame}}}
    write_json(stem.with_name(stem.name + ".json"), content)


def _write_events(
    stem: Path, recording: AnyRecording, stretch: _Stretch, emg_s: FloatArray | None
) -> None:
    """One event a trial, with its row of the trial table."""
    rate = float(recording.sample_rate_hz)
    first = int(recording.offsets[stretch.trials[0]])
    own = [str(name) for name in recording.trials.columns]
    rows = []
    for t in stretch.trials:
        start, stop = (int(v) for v in recording.offsets[t : t + 2])
        duration = (stop - start) / rate
        # what was recorded beside may go on for a sample of its own
        longest = duration if emg_s is None else max(duration, math.nextafter(emg_s[t], math.inf))
        cells = {name: _plain(recording.trials[name].iloc[t]) for name in own}
        at = {"onset": (start - first) / rate, "duration": longest, "trial_type": "trial"}
        rows.append({**cells, **at})
    names = ["onset", "duration", "trial_type", *own]
    write_table(stem.with_name(stem.name + ".tsv"), names, rows)
    described: dict[str, Any] = {
        "trial_type": {"Description": "what the event is", "Levels": {"trial": "one trial"}}
    }
    for name in own:
        words, unit = trial_column(name)
        described[name] = {"Description": words, **({} if unit == "n/a" else {"Units": unit})}
    write_json(stem.with_name(stem.name + ".json"), described)


def _plain(value: Any) -> Any:
    return None if pd.api.types.is_scalar(value) and pd.isna(value) else value


def _write_code(folder: Path, recording: AnyRecording) -> str:
    """Write the mapping or skeleton by which the toolkit reads the dataset again, into `code/`."""
    if isinstance(recording, Recording):
        text = mapping_text(recording)
        (folder / "columns.toml").write_text(text, encoding="utf-8")
        return "`code/columns.toml` says which channel is what to `armimpedance convert`."
    if recording.skeleton is not None:
        text = json_text({**_SKELETON, **to_plain(recording.skeleton)})
        (folder / "skeleton.json").write_text(text, encoding="utf-8")
        return "`code/skeleton.json` is the skeleton of the person."
    (folder / "README").write_text("Nothing is needed to read this dataset.\n", encoding="utf-8")
    return ""
