"""`recording.json`: what holds for a whole recording."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Final, Literal, cast

from armimpedance.conventions import Kind
from armimpedance.errors import InputError
from armimpedance.records import Recording, Subject

FORMAT: Final = "armimpedance-recording"
VERSION: Final = 1

#: The longest that a person's measures can be; a larger one was given in mm or cm.
LARGEST_LENGTH_M: Final = {"height_m": 3.0, "upper_arm_m": 1.0, "forearm_hand_m": 1.0}

#: The origin of a lab's frame lies in the same room.
LARGEST_COORDINATE_M: Final = 10.0


@dataclass(frozen=True)
class Metadata:
    """The content of `recording.json`, checked.

    `muscles` is None where the file has no such key; `ignored` are the keys that nothing reads.
    """

    kind: Kind
    sample_rate_hz: float
    force_by: Literal["limb", "device"] = "limb"
    perturbation: Literal["returning", "stochastic"] = "returning"
    torque: Literal["interaction", "commanded"] | None = None
    handle_mass_kg: float = 0.0
    shoulder_m: tuple[float, ...] | None = None
    subject: Subject = Subject()
    muscles: tuple[str, ...] | None = None
    emg_unit: Literal["V", "normalised"] = "V"
    provenance: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()


#: Kinds that other readers take, and the commands that take such a recording.
OTHER_KINDS: Final = {
    "markers": "a recording of markers: `armimpedance passive` or `body` take it",
    "motion": "a recording of joint motion: `armimpedance passive` or `body` take it",
}

#: Keys that are read; others are left out, and the recording says so.
KNOWN_KEYS: Final = {"format", "version", *(f.name for f in fields(Metadata))} - {"ignored"}


def read_metadata(file: Path) -> Metadata:
    """Read and check `recording.json`.

    Raises
    ------
    InputError
        The file is missing, is not JSON, or a field is not what it must be.
    """
    given = recording_fields(file)
    if given.values.get("kind") in tuple(OTHER_KINDS):
        told = OTHER_KINDS[given.values["kind"]]
        raise InputError(told, file=file, column="kind", expected='"hand" or "joint"')
    kind = given.choice("kind", ("hand", "joint"), required=True)
    rate = given.number("sample_rate_hz", required=True)
    if rate is None or rate <= 0:
        raise given.wrong("sample_rate_hz", "a positive number")
    handle_mass = given.number("handle_mass_kg") or 0.0
    if handle_mass < 0:
        raise given.wrong("handle_mass_kg", "0 or a positive number")
    return Metadata(
        kind=cast(Kind, kind),
        sample_rate_hz=rate,
        force_by=cast(Any, given.choice("force_by", ("limb", "device")) or "limb"),
        perturbation=cast(
            Any, given.choice("perturbation", ("returning", "stochastic")) or "returning"
        ),
        torque=cast(Any, given.choice("torque", ("interaction", "commanded"))),
        handle_mass_kg=handle_mass,
        shoulder_m=_shoulder(given),
        subject=subject_of(given),
        muscles=_muscles(given),
        emg_unit=cast(Any, given.choice("emg_unit", ("V", "normalised")) or "V"),
        provenance=given.texts("provenance") or (),
        ignored=tuple(key for key in given.values if key not in KNOWN_KEYS),
    )


def recording_fields(file: Path) -> Fields:
    """The fields of a `recording.json` of any kind, its format and version checked.

    Raises
    ------
    InputError
    """
    given = Fields(file, load_json(file))
    given.choice("format", (FORMAT,), required=True)
    if given.number("version", required=True) != VERSION:
        raise given.wrong("version", str(VERSION))
    return given


def metadata_text(recording: Recording) -> str:
    """The text of `recording.json`; the force in a `Recording` is always by the limb."""
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
    if recording.torque is not None:
        content["torque"] = recording.torque
    if recording.shoulder_m is not None:
        content["shoulder_m"] = recording.shoulder_m.tolist()
    return json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


class Fields:
    """The fields of one JSON object, each taken with a check that names file and field."""

    def __init__(self, file: Path, values: Mapping[str, Any], prefix: str = "") -> None:
        self.file, self.values, self.prefix = file, values, prefix

    def wrong(self, key: str, expected: str) -> InputError:
        shown = json.dumps(self.values.get(key))
        problem = f"is {shown}" if len(shown) <= 40 else f"is {shown[:37]}…"
        if key not in self.values:
            problem = "is missing"
        return InputError(problem, file=self.file, column=self.prefix + key, expected=expected)

    def _get(self, key: str, required: bool, expected: str) -> Any:
        value = self.values.get(key)
        if value is None and required:
            raise self.wrong(key, expected)
        return value

    def choice(self, key: str, choices: Iterable[str], required: bool = False) -> str | None:
        expected = " or ".join(f'"{c}"' for c in choices)
        value = self._get(key, required, expected)
        if value is not None and value not in tuple(choices):
            raise self.wrong(key, expected)
        return value

    def number(self, key: str, required: bool = False) -> float | None:
        value = self._get(key, required, "a number")
        if value is not None and not is_number(value):
            raise self.wrong(key, "a number")
        return None if value is None else float(value)

    def texts(self, key: str) -> tuple[str, ...] | None:
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise self.wrong(key, "a list of texts")
        return tuple(value)


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _shoulder(fields: Fields) -> tuple[float, ...] | None:
    value = fields.values.get("shoulder_m")
    if value is None:
        return None
    expected = "a list of one number per axis, in m"
    if not isinstance(value, list) or not value or not all(is_number(v) for v in value):
        raise fields.wrong("shoulder_m", expected)
    if max(abs(v) for v in value) > LARGEST_COORDINATE_M:
        raise fields.wrong("shoulder_m", "metres: this looks like millimetres")
    return tuple(float(v) for v in value)


def subject_of(fields: Fields) -> Subject:
    """The subject of a recording, checked.

    Raises
    ------
    InputError
    """
    value = fields.values.get("subject")
    if value is None:
        return Subject()
    if not isinstance(value, dict):
        raise fields.wrong("subject", 'an object such as {"id": "A"}')
    inner = Fields(fields.file, value, prefix="subject.")
    name = value.get("id", Subject.id)
    if isinstance(name, bool) or not isinstance(name, str | int):
        raise inner.wrong("id", "a text")
    measures = {
        key: inner.number(key) for key in ("mass_kg", "height_m", "upper_arm_m", "forearm_hand_m")
    }
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


def load_json(file: Path) -> dict[str, Any]:
    """The object in a JSON file, its numbers finite and its names different.

    Raises
    ------
    InputError
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, expected="JSON") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    if not text.strip():
        raise InputError("is empty", file=file, expected="a JSON object")

    def no_constant(name: str) -> float:
        raise InputError(f"holds {name}", file=file, expected="finite numbers")

    def no_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        names = [name for name, _ in pairs]
        for name in names:
            if names.count(name) > 1:
                problem = f"{json.dumps(name)} stands twice"
                raise InputError(problem, file=file, expected="one value")
        return dict(pairs)

    try:
        content = json.loads(text, parse_constant=no_constant, object_pairs_hook=no_repeats)
    except json.JSONDecodeError as error:
        raise InputError(
            f"broken JSON at character {error.colno} of the line: {error.msg}",
            file=file,
            row=error.lineno,
        ) from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"broken JSON: {error}", file=file) from None
    if not isinstance(content, dict):
        raise InputError("holds no object", file=file, expected="a JSON object in braces")
    return content
