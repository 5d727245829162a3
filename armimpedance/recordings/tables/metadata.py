"""`recording.json`: the metadata of a whole recording."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal, cast

from armimpedance.core.conventions import IMPOSED, Imposed, Kind
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, is_number, json_text, read_json
from armimpedance.core.records import Recording, Subject, wrong_lowpass

FORMAT: Final = "armimpedance-recording"
VERSION: Final = 1

#: The largest measures of a person; a larger one was given in mm or cm.
LARGEST_LENGTH_M: Final = {
    "height_m": 3.0,
    "upper_arm_m": 1.0,
    "forearm_hand_m": 1.0,
    "length_sd_m": 0.1,
}

#: The largest gravity in the plane of a robot, m/s^2; a larger value has another unit.
LARGEST_GRAVITY_M_S2: Final = 9.9

#: The largest coordinate, as the origin of a lab's frame lies in the same room.
LARGEST_COORDINATE_M: Final = 10.0


@dataclass(frozen=True)
class Metadata:
    """The content of `recording.json`, checked.

    `muscles` is None if the file has no such key; `ignored` are the unknown keys.
    """

    kind: Kind
    sample_rate_hz: float
    force_by: Literal["limb", "device"] = "limb"
    perturbation: Literal["returning", "stochastic", "moving"] = "returning"
    torque: Literal["interaction", "commanded"] | None = None
    imposed: Imposed | None = None
    handle_mass_kg: float = 0.0
    force_lowpass_hz: float | None = None
    force_lowpass_order: int = 2
    shoulder_m: tuple[float, ...] | None = None
    gravity_m_s2: tuple[float, ...] | None = None
    subject: Subject = Subject()
    muscles: tuple[str, ...] | None = None
    emg_unit: Literal["V", "normalised"] = "V"
    provenance: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()


#: Kinds for other readers, and the commands that accept such a recording.
OTHER_KINDS: Final = {
    "markers": "a recording of markers: `armimpedance passive` or `body` take it",
    "motion": "a recording of joint motion: `armimpedance passive` or `body` take it",
}

#: Keys that are read; others are left out and listed in the recording.
_NOT_KEYS: Final = {"ignored", "gravity_m_s2"}
KNOWN_KEYS: Final = {
    *("format", "version", "gravity"),
    *({f.name for f in fields(Metadata)} - _NOT_KEYS),
}


def read_metadata(file: Path) -> Metadata:
    """Read and check `recording.json`.

    Raises InputError: the file is missing or not JSON, or a field is invalid.
    """
    content = recording_fields(file)
    if content.values.get("kind") in tuple(OTHER_KINDS):
        description = OTHER_KINDS[content.values["kind"]]
        raise InputError(description, file=file, column="kind", expected='"hand" or "joint"')
    return metadata_of(content)


def metadata_of(content: Fields) -> Metadata:
    """The checked metadata of a recording of the hand or of joints."""
    kind = content.choice("kind", ("hand", "joint"), required=True)
    rate = content.number("sample_rate_hz", required=True)
    if rate is None or not 1e-6 <= rate <= 1e9:
        raise content.wrong("sample_rate_hz", "0.000001 to 1e9")
    handle_mass = content.number("handle_mass_kg") or 0.0
    if handle_mass < 0:
        raise content.wrong("handle_mass_kg", "0 or a positive number")
    return Metadata(
        kind=cast(Kind, kind),
        sample_rate_hz=rate,
        force_by=cast(Any, content.choice("force_by", ("limb", "device")) or "limb"),
        perturbation=cast(
            Any,
            content.choice("perturbation", ("returning", "stochastic", "moving")) or "returning",
        ),
        torque=cast(Any, content.choice("torque", ("interaction", "commanded"))),
        imposed=cast(Any, content.choice("imposed", IMPOSED)),
        handle_mass_kg=handle_mass,
        **_lowpass(content, rate),
        shoulder_m=_shoulder(content),
        gravity_m_s2=_gravity(content),
        subject=subject_of(content),
        muscles=_muscles(content),
        emg_unit=cast(Any, content.choice("emg_unit", ("V", "normalised")) or "V"),
        provenance=content.texts("provenance") or (),
        ignored=tuple(key for key in content.values if key not in KNOWN_KEYS),
    )


def recording_fields(file: Path) -> Fields:
    """The fields of a `recording.json` of any kind, with checked format and version."""
    content = Fields(file, read_json(file))
    content.choice("format", (FORMAT,), required=True)
    if content.number("version", required=True) != VERSION:
        raise content.wrong("version", str(VERSION))
    return content


def metadata_text(recording: Recording) -> str:
    """The text of `recording.json`; the force in a `Recording` is always exerted by the limb."""
    content: dict[str, object] = {
        "format": FORMAT,
        "version": VERSION,
        "kind": recording.kind,
        "sample_rate_hz": float(recording.sample_rate_hz),
        "force_by": "limb",
        "perturbation": recording.perturbation,
        "handle_mass_kg": float(recording.handle_mass_kg),
        "subject": {k: v for k, v in vars(recording.subject).items() if v is not None},
        "muscles": list(recording.muscles),
        "emg_unit": recording.emg_unit,
        "provenance": list(recording.provenance),
    }
    if recording.force_lowpass_hz is not None:
        content["force_lowpass_hz"] = float(recording.force_lowpass_hz)
        content["force_lowpass_order"] = recording.force_lowpass_order
    if recording.torque is not None:
        content["torque"] = recording.torque
    if recording.imposed is not None:
        content["imposed"] = recording.imposed
    if recording.shoulder_m is not None:
        content["shoulder_m"] = recording.shoulder_m.tolist()
    if recording.gravity_m_s2 is not None:
        content["gravity"] = list(recording.gravity_m_s2)
    return json_text(content)


def _lowpass(fields: Fields, rate_hz: float) -> dict[str, Any]:
    """The low-pass filter applied to the force, if stated."""
    hz, order = fields.number("force_lowpass_hz"), fields.number("force_lowpass_order")
    if hz is None:
        if order is not None:
            raise fields.wrong("force_lowpass_order", "force_lowpass_hz beside it")
        return {}
    order = Metadata.force_lowpass_order if order is None else order
    wrong = wrong_lowpass(hz, order, rate_hz)
    if wrong is not None:
        raise fields.wrong(*wrong)
    return {"force_lowpass_hz": hz, "force_lowpass_order": int(order)}


def _shoulder(fields: Fields) -> tuple[float, ...] | None:
    position = _vector(fields, "shoulder_m", "m")
    if position is not None and max(map(abs, position)) > LARGEST_COORDINATE_M:
        raise fields.wrong("shoulder_m", "metres: this looks like millimetres")
    return position


def _gravity(fields: Fields) -> tuple[float, ...] | None:
    gravity = _vector(fields, "gravity", "m/s^2")
    if gravity is not None and math.hypot(*gravity) > LARGEST_GRAVITY_M_S2:
        raise fields.wrong("gravity", "m/s^2 along the axes, such as [0, -9.81]")
    return gravity


def _vector(fields: Fields, key: str, unit: str) -> tuple[float, ...] | None:
    value = fields.values.get(key)
    if value is None:
        return None
    if not isinstance(value, list) or not value or not all(is_number(v) for v in value):
        raise fields.wrong(key, f"a list of one number per axis, in {unit}")
    return tuple(float(v) for v in value)


def subject_of(fields: Fields) -> Subject:
    """The checked subject of a recording."""
    value = fields.values.get("subject")
    if value is None:
        return Subject()
    if not isinstance(value, dict):
        raise fields.wrong("subject", 'an object such as {"id": "A"}')
    inner = Fields(fields.file, value, prefix="subject.")
    name = value.get("id", Subject.id)
    if isinstance(name, bool) or not isinstance(name, str | int):
        raise inner.wrong("id", "a text")
    measures = {key: inner.number(key) for key in vars(Subject()) if key != "id"}
    for key, measure in measures.items():
        if measure is not None and measure <= 0:
            raise inner.wrong(key, "a positive number")
        if measure is not None and measure > LARGEST_LENGTH_M.get(key, math.inf):
            raise inner.wrong(key, "metres: this looks like millimetres or centimetres")
    return Subject(id=str(name), **measures)


def _muscles(fields: Fields) -> tuple[str, ...] | None:
    muscles = fields.texts("muscles")
    if muscles is not None and (len(set(muscles)) < len(muscles) or "" in muscles):
        raise fields.wrong("muscles", "different names")
    return muscles
