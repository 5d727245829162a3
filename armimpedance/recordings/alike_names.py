"""Names that look alike and are not the same: two conditions that a blank tells apart.

A table that was typed by hand holds `rest` and `rest `, or an accent written in two ways. Taken as
they are they make two groups that nobody can tell apart on a screen.
"""

from __future__ import annotations

import unicodedata
from dataclasses import replace
from typing import Any

from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.recordings.reading import AnyRecording


def with_one_name_each(recording: AnyRecording) -> AnyRecording:
    """The recording with names of the trial table that look alike as one name.

    Parameters
    ----------
    recording : Recording, MarkerRecording or MotionRecording

    Returns
    -------
    Recording, MarkerRecording or MotionRecording
        The same where no two names of a column look alike; otherwise its provenance (and the
        findings of a `Recording`) say which were taken as one.
    """
    trials, sentences = recording.trials, []
    for column in trials.columns:
        names = {name for name in trials[column] if isinstance(name, str)}
        one = _one_name(names)
        if one:
            trials = trials.assign(**{column: trials[column].map(lambda n, o=one: o.get(n, n))})
            pairs = ", ".join(f"{name!r} as {clean!r}" for name, clean in sorted(one.items()))
            sentences.append(f"Names of {column} that look alike were taken as one: {pairs}.")
    if not sentences:
        return recording
    told: dict[str, Any] = {"trials": trials, "provenance": (*recording.provenance, *sentences)}
    if isinstance(recording, Recording):
        found = tuple(Finding("names", "warning", text.rstrip(".")) for text in sentences)
        return replace(recording, **told, findings=(*recording.findings, *found))
    return replace(recording, **told)


def _one_name(names: set[str]) -> dict[str, str]:
    """The names that another one looks like, with what both become."""
    alike: dict[str, list[str]] = {}
    for name in names:
        alike.setdefault(" ".join(unicodedata.normalize("NFC", name).split()), []).append(name)
    return {
        name: clean
        for clean, written in alike.items()
        if len(written) > 1
        for name in written
        if name != clean
    }
