"""`recording.json` of a moving body, and conversion of a laboratory's axes and units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, json_text
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.records import Subject
from armimpedance.recordings.tables.metadata import (
    FORMAT,
    VERSION,
    is_number,
    recording_fields,
    subject_of,
)

MovingKind = Literal["markers", "motion"]

#: The size of the largest studio; a larger position was given in mm.
LARGEST_PLACE_M: Final = 20.0

#: Descriptions for messages to users who give the wrong kind.
_DESCRIPTIONS: Final = {
    "hand": "a recording of the hand: `armimpedance estimate` takes it",
    "joint": "a recording of one joint: `armimpedance estimate`, `passive` or `elbow` take it",
    "markers": "a recording of markers, whose joint motion is not found yet",
    "motion": "a recording of joint motion, without markers",
}

KNOWN_KEYS: Final = (
    *("format", "version", "kind", "sample_rate_hz", "subject", "plates", "emg_rate_hz"),
    *("emg_unit", "provenance"),
)


@dataclass(frozen=True)
class MovingMetadata:
    """The content of `recording.json`, checked.

    `plate_origins_m` (K, 3) or None.
    `provenance`: origin of the metadata, with a remark on unused keys.
    """

    sample_rate_hz: float
    subject: Subject
    plate_origins_m: FloatArray | None
    emg_rate_hz: float | None
    emg_unit: Literal["V", "normalised"]
    provenance: tuple[str, ...]


def read_moving_metadata(file: Path, kind: MovingKind) -> MovingMetadata:
    """Read and check `recording.json` of a recording of this kind.

    Raises InputError: the file is missing or not JSON, a field is invalid, or the kind differs.
    """
    fields = recording_fields(file)
    stated = fields.choice("kind", tuple(_DESCRIPTIONS), required=True)
    if stated != kind:
        expected = f'kind "{kind}"'
        raise InputError(_DESCRIPTIONS[str(stated)], file=file, column="kind", expected=expected)
    ignored = [key for key in fields.values if key not in KNOWN_KEYS]
    remarks = (f"Not read from {file.name}: {', '.join(ignored)}.",) if ignored else ()
    return MovingMetadata(
        sample_rate_hz=_rate(fields, "sample_rate_hz", required=True) or 0.0,
        subject=subject_of(fields),
        plate_origins_m=_plates(fields),
        emg_rate_hz=_rate(fields, "emg_rate_hz"),
        emg_unit=cast(Any, fields.choice("emg_unit", ("V", "normalised")) or "normalised"),
        provenance=(*(fields.texts("provenance") or ()), *remarks),
    )


def moving_metadata_text(recording: MarkerRecording | MotionRecording) -> str:
    """The text of `recording.json`."""
    content: dict[str, object] = {
        "format": FORMAT,
        "version": VERSION,
        "kind": "markers" if isinstance(recording, MarkerRecording) else "motion",
        "sample_rate_hz": float(recording.sample_rate_hz),
        "subject": {k: v for k, v in vars(recording.subject).items() if v is not None},
        "provenance": list(recording.provenance),
    }
    if recording.plate_origins_m is not None:
        content["plates"] = [{"origin_m": p} for p in recording.plate_origins_m.tolist()]
    if recording.emg is not None:
        content["emg_rate_hz"] = float(recording.emg.sample_rate_hz)
        content["emg_unit"] = recording.emg.unit
    return json_text(content)


def _rate(fields: Fields, key: str, required: bool = False) -> float | None:
    rate = fields.number(key, required)
    if rate is not None and not 1e-6 <= rate <= 1e9:
        raise fields.wrong(key, "0.000001 to 1e9")
    return rate


def _plates(fields: Fields) -> FloatArray | None:
    plates = fields.values.get("plates")
    if plates is None or plates == []:
        return None
    expected = 'a list such as [{"origin_m": [0.2, 0.3, 0]}]'
    if not isinstance(plates, list):
        raise fields.wrong("plates", expected)
    origins = []
    for i, plate in enumerate(plates):
        origin = plate.get("origin_m") if isinstance(plate, dict) else None
        if not isinstance(origin, list) or len(origin) != 3 or not all(map(is_number, origin)):
            raise InputError(
                "is no plate", file=fields.file, column=f"plates[{i}]", expected=expected
            )
        if max(abs(v) for v in origin) > LARGEST_PLACE_M:
            column = f"plates[{i}].origin_m"
            problem = "looks like millimetres"
            raise InputError(problem, file=fields.file, column=column, expected="metres")
        origins.append([float(v) for v in origin])
    return np.array(origins)


# Conversion of the axes and units of a laboratory's files to the world's frame in m.

#: The file's axes that point forward, to the left and up, for files whose z points up.
Z_UP: Final = ("x", "y", "z")
#: OpenSim's frame: x forward, y up, z to the right.
Y_UP: Final = ("x", "-z", "y")

#: Units of length in such files, in m.
_METRES: Final = {
    "m": 1.0, "meter": 1.0, "metre": 1.0, "meters": 1.0, "metres": 1.0, "mete": 1.0,
    "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254, "inches": 0.0254,
}  # fmt: skip


def lab_rotation(axes: Sequence[str]) -> FloatArray:
    """Rotation (3, 3) from the file's frame to the world's (x forward, y left, z up).

    `axes`: the file's axes that point forward, to the left and up.
    Raises InputError: the axes are not a right-handed frame.
    """
    rows = np.zeros((3, 3))
    expected = "the file's axes that point forward, left and up, such as x,-z,y"
    shown = ",".join(axes)
    if len(axes) != 3 or any(a.removeprefix("-") not in ("x", "y", "z") for a in axes):
        raise InputError(f"axes {shown}", expected=expected)
    for i, axis in enumerate(axes):
        rows[i, "xyz".index(axis.removeprefix("-"))] = -1.0 if axis.startswith("-") else 1.0
    if np.linalg.det(rows) < 0.5:
        raise InputError(f"axes {shown} are no right-handed frame", expected=expected)
    return rows


def metres_per(unit: str, file: object) -> float:
    """A file's unit of length in m.

    Raises InputError: the unit is not known.
    """
    scale = _METRES.get(unit.strip().lower())
    if scale is None:
        raise InputError(f"unit of length {unit!r}", file=file, expected="m, cm, mm or inches")
    return scale
