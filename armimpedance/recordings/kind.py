"""Which kind of recording a folder holds."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final, Literal, cast

from armimpedance.core.errors import InputError
from armimpedance.recordings.tables.folder import METADATA_FILE
from armimpedance.recordings.tables.metadata import recording_fields

AnyKind = Literal["hand", "joint", "markers", "motion"]
KINDS: Final = ("hand", "joint", "markers", "motion")


def recording_kind(path: str | os.PathLike[str]) -> AnyKind:
    """The kind that a recording's folder states, without reading its samples.

    Raises
    ------
    InputError
        There is no such folder, no `recording.json` in it, or it states no known kind.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise InputError("no such folder", file=path, expected="a recording's folder")
    given = recording_fields(folder / METADATA_FILE)
    return cast(AnyKind, given.choice("kind", KINDS, required=True))
