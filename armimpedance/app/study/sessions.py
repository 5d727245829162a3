"""Which people and sessions a folder holds."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError

#: What may stand in the name of a folder on every system.
_SAFE: Final = re.compile(r"[^\w.+-]+")
#: Folders that BIDS knows beside those of people.
_NO_PEOPLE: Final = ("code", "derivatives", "sourcedata", "stimuli", "phenotype")


@dataclass(frozen=True)
class StudySession:
    """One recording of one person.

    Attributes
    ----------
    participant : str
        Without ``sub-``.
    session : str
        Without ``ses-``; empty where a person has one recording without a name of its own.
    recording : Path
        Absolute.
    """

    participant: str
    session: str
    recording: Path

    @property
    def folder(self) -> str:
        """Folder of its results below that of the study."""
        person = f"sub-{_safe(self.participant)}"
        return f"{person}/ses-{_safe(self.session)}" if self.session else person

    def __str__(self) -> str:
        return f"{self.participant} {self.session}".strip()


def find_sessions(
    data: Path, pattern: str | None, is_recording: Callable[[Path], bool]
) -> list[StudySession]:
    """All sessions below a folder, sorted by person and session.

    Folders named ``sub-<person>`` and within them ``ses-<session>`` are people and sessions, as in
    BIDS. In any other folder each entry is a person: a recording, or a folder of recordings.

    Parameters
    ----------
    data : Path
    pattern : str, optional
        Of the recordings' paths below `data`; without, whatever is a recording.
    is_recording : function
        Whether a path is a recording of a known format.

    Returns
    -------
    list of StudySession

    Raises
    ------
    InputError
        There is no such folder, nothing in it is a recording, a name is dots alone, or two sessions
        have one name.
    """
    if not data.is_dir():
        raise InputError("no such folder", file=data, expected="a folder of people's recordings")
    top = data.resolve()
    if pattern is not None:
        sessions = [_named(top, path) for path in sorted(top.glob(pattern))]
    else:
        sessions = [_named(top, path) for path in _recordings(top, is_recording)]
    if not sessions:
        what = f"nothing fits {pattern!r}" if pattern else "holds no recording"
        raise InputError(what, file=data, expected="recordings, one folder a person")
    return _told_apart(sorted(sessions, key=lambda one: (one.participant, one.session)), top)


def chosen(sessions: Iterable[StudySession], labels: Iterable[str] | None) -> list[StudySession]:
    """The sessions of some people.

    Parameters
    ----------
    sessions : iterable of StudySession
    labels : iterable of str, optional
        With or without ``sub-``; None: all.

    Returns
    -------
    list of StudySession

    Raises
    ------
    InputError
        Nobody has one of the labels.
    """
    all_sessions = list(sessions)
    if labels is None:
        return all_sessions
    wanted = [label.removeprefix("sub-") for label in labels]
    participants = {one.participant for one in all_sessions}
    for label in wanted:
        if label not in participants:
            some = ", ".join(sorted(participants)[:8]) + (", ..." if len(participants) > 8 else "")
            raise InputError(f"no participant {label!r}", expected=f"one of {some}")
    return [one for one in all_sessions if one.participant in wanted]


def share_of(sessions: Sequence[StudySession], index: int, count: int) -> list[StudySession]:
    """Share of one of several jobs: every `count`-th session from `index` on.

    Parameters
    ----------
    sessions : sequence of StudySession
    index, count : int

    Returns
    -------
    list of StudySession

    Raises
    ------
    InputError
        The index is not one of 0 to `count` - 1.
    """
    if not 0 <= index < count:
        raise InputError(f"task {index} of {count}", expected="a number from 0 to one less")
    return list(sessions[index::count])


def _recordings(top: Path, is_recording: Callable[[Path], bool]) -> Iterator[Path]:
    """Recordings below a folder, at most three levels down."""
    for person in _entries(top, "sub-") or _people(top):
        for place in _entries(person, "ses-") if person.is_dir() else ():
            yield from _inside(place, is_recording)
        if not (person.is_dir() and _entries(person, "ses-")):
            yield from _inside(person, is_recording)


def _people(top: Path) -> list[Path]:
    return [entry for entry in _entries(top) if entry.name not in _NO_PEOPLE]


def _inside(place: Path, is_recording: Callable[[Path], bool]) -> list[Path]:
    """The place itself, if it is a recording, or else those in it.

    A folder in which nothing is one counts as one: who has no usable recording is a row as well.
    """
    if is_recording(place):
        return [place]
    if not place.is_dir():
        return []
    return [entry for entry in _entries(place) if is_recording(entry)] or [place]


def _entries(folder: Path, beginning: str = "") -> list[Path]:
    hidden = (entry for entry in folder.iterdir() if not entry.name.startswith((".", "_")))
    return sorted(entry for entry in hidden if entry.name.startswith(beginning))


def _named(top: Path, recording: Path) -> StudySession:
    """Person and session from a recording's path below the data's folder."""
    parts = recording.relative_to(top).parts
    person = next((part for part in parts if part.startswith("sub-")), parts[0])
    session = next((part for part in parts if part.startswith("ses-")), "")
    if not session and len(parts) > 1:
        session = _stem(parts[-1]) if recording.is_file() else parts[-1]
    first = person if len(parts) > 1 or recording.is_dir() else _stem(person)
    session_record = StudySession(
        first.removeprefix("sub-"), session.removeprefix("ses-"), recording
    )
    # In the words of a step such a name would stand for a folder above.
    if any(
        label and not label.strip(".")
        for label in (session_record.participant, session_record.session)
    ):
        raise InputError("a name of dots alone", file=recording, expected="letters or digits")
    return session_record


def _told_apart(sessions: list[StudySession], top: Path) -> list[StudySession]:
    """Sessions whose folders differ; several recordings of one take their own names."""
    count: dict[str, int] = {}
    for one in sessions:
        count[one.folder] = count.get(one.folder, 0) + 1
    distinct = []
    for one in sessions:
        name = one.session
        if count[one.folder] > 1 and _stem(one.recording.name) != name:
            name = f"{name} {_stem(one.recording.name)}".strip()
        distinct.append(StudySession(one.participant, name, one.recording))
    folders: dict[str, Path] = {}
    for one in distinct:
        if one.folder in folders:
            first = folders[one.folder].relative_to(top)
            raise InputError(
                f"{first} and {one.recording.relative_to(top)} would both be {one.folder}",
                file=top,
                expected="names that tell people and sessions apart",
            )
        folders[one.folder] = one.recording
    return distinct


def _stem(name: str) -> str:
    return name.split(".")[0] or name


def _safe(text: str) -> str:
    return _SAFE.sub("-", text).strip("-.") or "x"
