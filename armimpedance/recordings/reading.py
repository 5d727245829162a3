"""File formats, options of their readers, and similar names in a recording."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal, cast

from armimpedance.core.errors import InputError, shortened, shown
from armimpedance.core.findings import Finding
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.records import Recording, Subject
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.tables.folder import METADATA_FILE
from armimpedance.recordings.tables.metadata import recording_fields

#: All kinds of recordings: trials of the hand or of joints, markers, joint motion.
AnyRecording = Recording | MarkerRecording | MotionRecording


@dataclass(frozen=True)
class ReadOptions:
    """Options of a reader that a file does not state itself; None: not stated.

    Attributes
    ----------
    force_by : {"limb", "device"} or None
        The one that exerts the force recorded by a Kinarm's sensor, or by force plates in a C3D;
        None: determined from the robot or the plates' load.
    side : {"right", "left"} or None
    onset_event, end_event : str or None
    protocols : sequence of int
    events : sequence of str
    without_errors : bool
        Selected trials of a Kinarm exam: those of these trial protocols, with these events, not
        marked as errors. Empty: all.
    keep_personal : bool
        See `read_kinarm`.
    emg_channels : mapping
        Analog channel -> muscle, such as ``{"ACH0": "biceps_long"}``.
    axes : three str or None
        The file's axes that point forward, left and up; None: z up in C3D, OpenSim's in `.trc`.
    prefix : str or None
        The subject whose markers are read; see `read_marker_c3d`.
    skeleton : Skeleton or None
        The skeleton of markers; a table of angles needs one.
    angles : mapping
        Coordinate -> column of a table of angles; see `opensim_motion`.
    forces : path or None
        The table of ground reaction forces beside a `.trc`; see `with_ground_forces`.
    in_degrees : bool or None
        True if a table of angles that states no unit is in degrees.
    where : str or None
        Selected trials, as an expression over the columns of the trial table, such as
        ``TP == 3 and is_error == 0``. Every format accepts it.
    mapping : Path or None
        The mapping of a table of any layout; None: `columns.toml` beside it.
    strict : bool
        Refuse a table with irregular time stamps instead of resampling it evenly.
    """

    force_by: Literal["limb", "device"] | None = None
    side: Literal["right", "left"] | None = None
    onset_event: str | None = None
    end_event: str | None = None
    protocols: Sequence[int] = ()
    events: Sequence[str] = ()
    without_errors: bool = False
    keep_personal: bool = False
    emg_channels: Mapping[str, str] = field(default_factory=dict)
    axes: Sequence[str] | None = None
    prefix: str | None = None
    skeleton: Skeleton | None = None
    angles: Mapping[str, str] = field(default_factory=dict)
    in_degrees: bool | None = None
    forces: Path | None = None
    where: str | None = None
    mapping: Path | None = None
    strict: bool = False

    @property
    def given(self) -> tuple[str, ...]:
        """The names of the options that are set."""
        plain = vars(ReadOptions())
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != plain[f.name])


@dataclass(frozen=True)
class RecordedSubject:
    """The subject of a recording and the recorded muscles.

    `muscles`: the muscles that the recording lists; None if it lists none.
    `gravity_m_s2`: gravity along the axes of the hand; None if not stated.
    """

    subject: Subject
    muscles: tuple[str, ...] | None
    gravity_m_s2: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Format:
    """A file format.

    `name`: name of the format in messages, such as "a folder with recording.json".
    `recognises`: True if an existing path is of this format; no path may be of two formats.
    `read`: reads a path with the given options.
    `options`: fields of `ReadOptions` that this format uses; others are refused.
    `read_subject`: reads only the subject, if that is faster; None: the whole recording is read.
    """

    name: str
    recognises: Callable[[Path], bool]
    read: Callable[[Path, ReadOptions], AnyRecording]
    options: tuple[str, ...] = ()
    read_subject: Callable[[Path, ReadOptions], RecordedSubject] | None = None


# The kind of recording in a folder.

AnyKind = Literal["hand", "joint", "markers", "motion"]
KINDS: Final = ("hand", "joint", "markers", "motion")


def recording_kind(path: str | os.PathLike[str]) -> AnyKind:
    """The kind that a recording's folder states, without reading its samples.

    Raises InputError: there is no such folder, it has no `recording.json`, or states no known kind.
    """
    folder = Path(path)
    if not folder.is_dir():
        raise InputError("no such folder", file=path, expected="a recording's folder")
    content = recording_fields(folder / METADATA_FILE)
    return cast(AnyKind, content.choice("kind", KINDS, required=True))


# Names that look alike but differ, such as two conditions that differ by a blank.
#
# A table typed by hand may hold `rest` and `rest `, or an accent written in two ways. Unchanged,
# they would make two groups that look identical on a screen.


def with_one_name_each(recording: AnyRecording) -> AnyRecording:
    """Merge names in the trial table that look alike.

    Returns: the same recording if no names in a column look alike; otherwise the provenance (and
    the findings of a `Recording`) list the merged names.
    """
    trials, sentences = recording.trials, []
    for column in trials.columns:
        names = {name for name in trials[column] if isinstance(name, str)}
        merged = _one_name(names)
        if merged:
            trials = trials.assign(**{column: trials[column].map(lambda n, o=merged: o.get(n, n))})
            pairs = ", ".join(f"{name!r} as {clean!r}" for name, clean in sorted(merged.items()))
            sentences.append(f"Names of {column} that look alike were taken as one: {pairs}.")
    if not sentences:
        return recording
    changes: dict[str, Any] = {"trials": trials, "provenance": (*recording.provenance, *sentences)}
    if isinstance(recording, Recording):
        findings = tuple(Finding("names", "warning", text.rstrip(".")) for text in sentences)
        return replace(recording, **changes, findings=(*recording.findings, *findings))
    return replace(recording, **changes)


def _one_name(names: set[str]) -> dict[str, str]:
    """Map each name to be changed to the common form of names that look alike."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(" ".join(unicodedata.normalize("NFC", name).split()), []).append(name)
    return {
        name: clean
        for clean, variants in groups.items()
        if len(variants) > 1
        for name in variants
        if name != clean
    }


# Names from files: checked and shortened for display in one line.

LONGEST_NAME: Final = 120
_MOST: Final = 20


def can_be_shown(name: str) -> bool:
    """True if a column may have this name: printable and not too long."""
    return name.isprintable() and len(name) <= LONGEST_NAME


def shown_name(name: str) -> str:
    """A name made fit for messages."""
    return shortened(shown(name[: 4 * LONGEST_NAME]), LONGEST_NAME)


def some_names(names: Iterable[str]) -> list[str]:
    """The first of these names for a sentence, each once, and the number of the others."""
    different = list(dict.fromkeys(names))
    shortened_names = [shown_name(name) for name in different[:_MOST]]
    return (
        shortened_names
        if len(different) <= _MOST
        else [*shortened_names, f"and {len(different) - _MOST} more"]
    )
