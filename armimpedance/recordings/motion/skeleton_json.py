"""`skeleton.json`: segments, hinges and marker sites of one subject.

``{"format": "armimpedance-skeleton", "version": 1, "segments": [...], "markers": [...],
"floating": true}``, the fields of `core.skeleton.Skeleton`. Optional in a segment: hinges, mass,
centre of mass and inertia (none, 0); optional in a skeleton: markers (none), floating (true).
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final

from armimpedance.core.arrays import from_plain, to_plain
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import Fields, json_text, read_json
from armimpedance.core.outputs import staged_file
from armimpedance.core.skeleton import Skeleton

FORMAT: Final = "armimpedance-skeleton"
VERSION: Final = 1
SKELETON_FILE: Final = "skeleton.json"

_SEGMENT_DEFAULTS: Final = {
    "hinges": [],
    "mass_kg": 0.0,
    "com_m": [0.0] * 3,
    "inertia_kgm2": [[0.0] * 3] * 3,
}
_SKELETON_DEFAULTS: Final = {"markers": [], "floating": True}

#: The largest distance between adjacent joints; a longer bone was given in mm or cm.
LONGEST_BONE_M: Final = 2.0


def read_skeleton(path: str | os.PathLike[str]) -> Skeleton:
    """Read and check a skeleton.

    Parameters
    ----------
    path : path
        The file, such as ``skeleton.json``.

    Returns
    -------
    Skeleton

    Raises
    ------
    InputError
        The file is missing or not JSON, a field is missing or invalid, or the skeleton is
        impossible.
    """
    file = Path(path)
    fields = Fields(file, read_json(file))
    fields.choice("format", (FORMAT,), required=True)
    if fields.number("version", required=True) != VERSION:
        raise fields.wrong("version", str(VERSION))
    plain: dict[str, Any] = {**_SKELETON_DEFAULTS, **fields.values}
    plain.pop("format")
    plain.pop("version")
    segments = plain.get("segments")
    if isinstance(segments, list):
        plain["segments"] = [
            {**_SEGMENT_DEFAULTS, **s} if isinstance(s, dict) else s for s in segments
        ]
    try:
        skeleton = from_plain(Skeleton, plain)
    except InputError as error:
        raise InputError(
            error.problem, file=file, column=error.column, expected=error.expected
        ) from None
    _check_metres(skeleton, file)
    return skeleton


def write_skeleton(skeleton: Skeleton, path: str | os.PathLike[str]) -> None:
    """Write a skeleton; `read_skeleton` returns exactly the same skeleton.

    `path`: the file, which is replaced if it exists.
    Raises InputError: the file cannot be written.
    """
    with staged_file(path) as file:
        file.write_text(skeleton_text(skeleton), encoding="utf-8")


def skeleton_text(skeleton: Skeleton) -> str:
    """The text of `skeleton.json`."""
    content = {"format": FORMAT, "version": VERSION, **to_plain(skeleton)}
    return json_text(content)


def _check_metres(skeleton: Skeleton, file: Path) -> None:
    positions = [(f"origin_m of {s.name}", s.origin_m) for s in skeleton.segments]
    positions += [(f"com_m of {s.name}", s.com_m) for s in skeleton.segments]
    positions += [(f"position_m of {m.name}", m.position_m) for m in skeleton.markers]
    for name, position in positions:
        far = float(abs(position).max())
        if far > LONGEST_BONE_M:
            raise InputError(
                f"{far:g} looks like millimetres", file=file, column=name, expected="metres"
            )
