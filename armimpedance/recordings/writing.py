"""Writing a recording of any kind as a folder."""

from __future__ import annotations

import os
from typing import Final

from armimpedance.core.motion import MarkerRecording
from armimpedance.core.outputs import RECORDING_FILES
from armimpedance.core.records import Recording
from armimpedance.recordings.motion.emg_table import EMG_FILES, TableForm
from armimpedance.recordings.motion.marker_folder import write_markers
from armimpedance.recordings.motion.motion_folder import write_motion
from armimpedance.recordings.motion.skeleton_json import SKELETON_FILE
from armimpedance.recordings.reading import AnyRecording
from armimpedance.recordings.tables.folder import write_folder

#: What the folder of a recording of any kind may hold.
FOLDER_FILES: Final = (*RECORDING_FILES, *EMG_FILES, SKELETON_FILE)


def write_recording(
    recording: AnyRecording, path: str | os.PathLike[str], table: TableForm = "parquet"
) -> None:
    """Write a recording to a folder that appears only when it is complete.

    `open_recording` gives the same recording back, bit by bit.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording
        Trials of the hand or of joints; markers; joint motion.
    path : path
        A new or empty folder, or an earlier recording of this kind, which is replaced.
    table : {"parquet", "csv"}
        The form of the samples.

    Raises
    ------
    InputError
        The folder cannot be written, or a name in the recording has no form on disk.

    Examples
    --------
    >>> import tempfile
    >>> from armimpedance.recordings import open_recording, write_recording
    >>> from manipulandum_sim.hand import simulate
    >>> recording, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_recording(recording, f"{folder}/session")
    ...     bool((open_recording(f"{folder}/session").force == recording.force).all())
    True
    """
    if isinstance(recording, Recording):
        write_folder(recording, path, table)
    elif isinstance(recording, MarkerRecording):
        write_markers(recording, path, table)
    else:
        write_motion(recording, path, table)
