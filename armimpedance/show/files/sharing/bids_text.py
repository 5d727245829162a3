"""Texts of a BIDS dataset, EMG as BDF, and the mapping beside a recording."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text
from armimpedance.core.motion import EmgSignals
from armimpedance.core.records import Recording
from armimpedance.show.files.sharing.columns import arm_angle_names, sample_columns
from armimpedance.show.files.sharing.form import Shared

VERSION: Final = "1.10.0"
MISSING: Final = "n/a"
_BREAKS: Final = re.compile(r"[\t\r\n\x00]+")
_ROWS: Final = 100_000


def label(text: str, instead: str) -> str:
    """Letters and digits of a text, as a label of BIDS must be."""
    return re.sub(r"[^0-9A-Za-z]", "", text.encode("ascii", "ignore").decode()) or instead


def checked_label(text: str, option: str) -> str:
    """A label that was given.

    Raises InputError: it holds something else than letters and digits.
    """
    if not re.fullmatch(r"[0-9A-Za-z]+", text):
        raise InputError(f"{option} {text!r:.60}", expected="letters and digits")
    return text


def cell(value: Any) -> str:
    """A cell of a table: numbers so that every bit comes back, n/a where there is none."""
    if value is None:
        return MISSING
    if isinstance(value, str):
        return _BREAKS.sub(" ", value).strip() or MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    number = float(value)
    return repr(number) if np.isfinite(number) else MISSING


def write_table(file: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table with a header."""
    lines = ["\t".join(cell(name) for name in columns)]
    lines += ["\t".join(cell(row.get(name)) for name in columns) for row in rows]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_numbers(file: Path, columns: Sequence[FloatArray]) -> None:
    """Write a table of numbers without a header; NaN becomes n/a."""
    options = pyarrow.csv.WriteOptions(
        include_header=False, delimiter="\t", quoting_style="none", batch_size=_ROWS
    )
    names = [str(i) for i in range(len(columns))]
    gaps = [bool(np.isnan(values).any()) for values in columns]
    with file.open("wb") as stream:
        for first in range(0, len(columns[0]), _ROWS):
            part = [
                _with_gaps(values[first : first + _ROWS]) if gap else values[first : first + _ROWS]
                for values, gap in zip(columns, gaps, strict=True)
            ]
            pyarrow.csv.write_csv(pa.table(dict(zip(names, part, strict=True))), stream, options)


def _with_gaps(values: FloatArray) -> pa.Array:
    return pc.fill_null(pa.array(values, from_pandas=True).cast(pa.string()), MISSING)


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file."""
    file.write_text(json_text(content), encoding="utf-8")


def dataset_name(shared: Shared) -> str:
    """The name that was given, or that of the first file."""
    return shared.statement.name or shared.paths[0].resolve().stem


def write_description(
    folder: Path, shared: Shared, kind: str, sources: Sequence[Mapping[str, str]] = ()
) -> tuple[str, ...]:
    """Write `dataset_description.json`; returns the fields that nobody told.

    `sources`: the datasets that a derivative was made from.
    """
    statement = shared.statement
    made_by = {"Name": "armimpedance", "Version": shared.version}
    content: dict[str, Any] = {
        "Name": dataset_name(shared),
        "BIDSVersion": VERSION,
        "DatasetType": kind,
        "GeneratedBy": [made_by],
    }
    description: dict[str, Any] = {
        "License": statement.licence,
        "Authors": list(statement.creators),
        "Keywords": list(statement.keywords),
        "Funding": list(statement.funding),
        "DatasetDOI": statement.identifier,
        "SourceDatasets": list(sources),
    }
    content |= {key: value for key, value in description.items() if value}
    write_json(folder / "dataset_description.json", content)
    return tuple(key for key in ("License", "Authors") if key not in content)


# EMG of one trial as EMG-BIDS: a BDF file (24 bits) with its descriptions.

_RECORD_S = (1.0, 2.0, 0.5, 0.1, 4.0, 5.0, 10.0)
_MICROVOLTS = 1e6


def write_bdf(stem: Path, task: str, emg: EmgSignals, trial: int) -> tuple[str, ...]:
    """Write the EMG of one trial; returns what a reader must know.

    `stem`: with the name up to `_emg`.
    `trial`: row of the trial table.
    Raises InputError: edfio is not installed, or the rate fits no whole record.
    """
    if emg.unit != "V":
        return ("Left out: normalised EMG, which is no voltage (EMG-BIDS holds voltages).",)
    values = emg.signals[int(emg.offsets[trial]) : int(emg.offsets[trial + 1])]
    if not len(values):
        return ()
    edfio = _edfio(stem)
    rate = float(emg.sample_rate_hz)
    record = next((s for s in _RECORD_S if (s * rate).is_integer()), None)
    if record is None:
        raise InputError(f"EMG of {rate:g} Hz", expected="a rate with whole samples in 10 s")
    per = int(record * rate)
    padded = np.zeros((-(-len(values) // per) * per, values.shape[1]))
    padded[: len(values)] = values * _MICROVOLTS
    signals = [_signal(edfio, padded[:, i], rate, m) for i, m in enumerate(emg.muscles)]
    edfio.Bdf(signals, data_record_duration=record).write(stem.with_name(stem.name + ".bdf"))
    _write_beside(stem, task, emg, len(values) / rate)
    return (
        "EMG is written in 24 bits (BDF); zeros fill its last record.",
        "Not known, and written as n/a: EMGReference, PowerLineFrequency, SoftwareFilters of EMG.",
    )


def _edfio(stem: Path) -> Any:
    try:
        import edfio
    except ImportError:
        raise InputError(
            "the package edfio is not installed",
            file=stem,
            expected="it: pip install 'armimpedance[bids]'",
        ) from None
    return edfio


def _signal(edfio: Any, values: Any, rate: float, muscle: str) -> Any:
    largest = _rounded_up(max(float(np.abs(values).max()), 1e-3))
    return edfio.BdfSignal(
        values,
        rate,
        label=muscle.encode("ascii", "replace").decode()[:16],
        physical_dimension="uV",
        physical_range=(-largest, largest),
    )


def _rounded_up(value: float) -> float:
    """The next number of three digits: a file has eight characters for a limit."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / step) * step:.3g}")


def _write_beside(stem: Path, task: str, emg: EmgSignals, duration_s: float) -> None:
    write_json(
        stem.with_name(stem.name + ".json"),
        {
            "TaskName": task,
            "SamplingFrequency": float(emg.sample_rate_hz),
            "EMGChannelCount": len(emg.muscles),
            "EMGPlacementScheme": "Other",
            "EMGPlacementSchemeDescription": "n/a",
            "EMGReference": "n/a",
            "PowerLineFrequency": "n/a",
            "SoftwareFilters": "n/a",
            "RecordingType": "continuous",
            "RecordingDuration": duration_s,
        },
    )
    rows = [{"name": m, "type": "EMG", "units": "uV", "target_muscle": m} for m in emg.muscles]
    names = ["name", "type", "units", "target_muscle"]
    channels = stem.name.removesuffix("_emg") + "_channels.tsv"
    write_table(stem.with_name(channels), names, rows)


# `columns.toml` for a dataset of BIDS that holds a recording of the hand or of joints.


def mapping_text(recording: Recording) -> str:
    """The mapping with which the dataset becomes the recording that it was written from."""
    hand, d = recording.kind == "hand", recording.axes
    top: dict[str, Any] = {
        "kind": recording.kind,
        "sample_rate_hz": float(recording.sample_rate_hz),
        "perturbation": recording.perturbation,
        "torque": recording.torque,
        "imposed": recording.imposed,
        "handle_mass_kg": float(recording.handle_mass_kg),
        "shoulder_m": _numbers(recording.shoulder_m),
        "gravity": _numbers(recording.gravity_m_s2) if hand else None,
        "keep": list(recording.extra) or None,
    }
    lines = ["# Which channel is what, for `armimpedance convert DATASET FOLDER`."]
    lines += _pairs(top)
    lines += ["", "[subject]", *_pairs(vars(recording.subject))]
    lines += ["", "[time]", *_pairs({"column": "trial_time", "unit": "s"})]
    place, push = ("m", "N") if hand else ("rad", "N m")
    lines += _section("position", position_columns(recording.kind, d), place)
    lines += [*_section("force", force_columns(recording.kind, d), push), 'by = "limb"']
    if recording.joint_angles is not None:
        names = arm_angle_names(recording.joint_angles.shape[1])
        lines += _section("joint_angles", names, "rad")
    if recording.emg is not None:
        muscles = ", ".join(f"{_value(m)} = {_value(f'emg_{m}')}" for m in recording.muscles)
        lines += ["", "[emg]", f"muscles = {{ {muscles} }}", f"unit = {_value(recording.emg_unit)}"]
    lines += ["", "[trials]", 'by = "run"', "", "[trials.columns]"]
    channels = {column.name for column in sample_columns(recording)}
    for name in map(str, recording.trials.columns):
        fact = f"event/{name}" if name in channels else name
        lines.append(f"{_value(name)} = {_value(fact)}")
    return "\n".join(lines) + "\n"


def _section(name: str, columns: Sequence[str], unit: str) -> list[str]:
    return ["", f"[{name}]", *_pairs({"columns": list(columns), "unit": unit})]


def _numbers(values: Any) -> list[float] | None:
    return None if values is None else [float(v) for v in values]


def _pairs(values: dict[str, Any]) -> list[str]:
    return [f"{key} = {_value(value)}" for key, value in values.items() if value is not None]


def _value(value: Any) -> str:
    """A value of TOML; its texts are written as JSON's are."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
