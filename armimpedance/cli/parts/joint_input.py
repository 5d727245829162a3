"""A recording of joint angles and torques, as several commands take it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from armimpedance.errors import InputError

if TYPE_CHECKING:
    from armimpedance.records import Recording


def read_joint(path: Path, condition: str | None = None) -> Recording:
    """A recording of kind "joint", or its trials of one condition.

    Raises
    ------
    InputError
        It cannot be read, is of another kind, or has no such condition.
    """
    from armimpedance.cli.estimate import open_checked

    recording = open_checked(path, None)
    if recording.kind != "joint":
        raise InputError(f"a recording of kind {recording.kind!r}", file=path, expected="'joint'")
    if condition is None:
        return recording
    chosen = (recording.trials["condition"].astype(str) == condition).to_numpy()
    if not chosen.any():
        known = ", ".join(map(str, recording.trials["condition"].unique()))
        raise InputError(f"no condition {condition!r}", file=path, expected=f"one of {known}")
    return recording.select(chosen)
