"""The older name of `open_recording` for moving bodies."""

from __future__ import annotations

import os
from typing import cast

from armimpedance.motion import MarkerRecording, MotionRecording
from armimpedance.recordings.opening import open_recording


def open_motion_capture(path: str | os.PathLike[str]) -> MarkerRecording | MotionRecording:
    """See `open_recording`."""
    return cast("MarkerRecording | MotionRecording", open_recording(path))
