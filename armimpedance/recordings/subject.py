"""Who was recorded, of any format, without reading the samples where that can be avoided."""

from __future__ import annotations

import os
from pathlib import Path

from armimpedance.core.inputs import unchanged
from armimpedance.core.records import Recording
from armimpedance.recordings.opening import format_of
from armimpedance.recordings.reading import ReadOptions, RecordedSubject


def read_subject(
    path: str | os.PathLike[str], options: ReadOptions | None = None
) -> RecordedSubject:
    """The subject and the muscles of a recording in any of the known formats.

    Only `recording.json` of a recording's folder is read. A Kinarm exam needs no `force_by` here.

    Parameters
    ----------
    path : path
    options : ReadOptions, optional

    Returns
    -------
    RecordedSubject

    Raises
    ------
    InputError
        There is nothing at `path`, its format is not known, or what is there is wrong.
    """
    wanted = options or ReadOptions()
    known = format_of(path, wanted)
    if known.read_subject is not None:
        return known.read_subject(Path(path), wanted)
    with unchanged(path, wanted.mapping, wanted.forces):
        recording = known.read(Path(path), wanted)
    if isinstance(recording, Recording):
        muscles = recording.muscles or None
        return RecordedSubject(recording.subject, muscles, recording.gravity_m_s2)
    emg = recording.emg
    return RecordedSubject(recording.subject, None if emg is None else emg.muscles)
