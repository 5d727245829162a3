"""`columns.toml` for a dataset of BIDS that holds a recording of the hand or of joints."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.records import Recording
from armimpedance.show.files.sharing.columns import arm_angle_names, sample_columns


def mapping_text(recording: Recording) -> str:
    """The mapping with which the dataset becomes the recording that it was written from.

    Parameters
    ----------
    recording : Recording
    """
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
