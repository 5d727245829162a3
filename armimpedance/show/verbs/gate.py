"""The gate of every analysis: no number of a recording that a check stops."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from typing import Final

from armimpedance.core.conventions import group_name
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.numerics.criticism import refuse_stops
from armimpedance.recordings import AnyRecording
from armimpedance.show.verbs.checks import NO_CHECKS, TopicChecks, findings_of, spread

#: Checks of what a fit assumes; where they warn, every result is marked.
OF_THE_FIT: Final = (
    "held",
    "clipping",
    "imposed",
    "axes",
    "own motion",
    "delay",
    "reflex",
    "amplitude",
    "friction",
    "voluntary",
    "lack of fit",
    "gain",
    "reach",
)


def checked(
    recording: AnyRecording,
    despite: str | Collection[str] = (),
    own: TopicChecks = NO_CHECKS,
) -> tuple[str, ...]:
    """Check a recording as `inspect` does, before anything is fitted.

    `recording`: of more than 4000 trials as many are checked, spread over all.
    `despite`: names of checks whose STOP is overruled.
    `own`: the checks that only the verb's topic can make.
    Returns what each result is to be marked with; see `marks_of`.
    Raises InputError: a check says STOP and is not named in `despite`; or `despite` names no check.
    """
    if isinstance(recording, Recording):
        recording = spread(recording)
    return marks_of(findings_of(recording, own), despite)


def marks_of(found: Iterable[Finding], despite: str | Collection[str] = ()) -> tuple[str, ...]:
    """Refuse where a check says STOP; what results are marked with where none does.

    `despite`: names of checks whose STOP is overruled.
    Returns the checks that were overruled, and assumptions of the fit that the data contradict.
    Raises InputError: a check says STOP and is not named in `despite`; or `despite` names no check.
    """
    found = list(found)
    named = (despite,) if isinstance(despite, str) else tuple(despite)
    overruled = refuse_stops(found, named)
    contradicted = [one for one in found if one.name in OF_THE_FIT and one.verdict == "warning"]
    return (
        *(f"despite {one.sentence}" for one in overruled),
        *(one.sentence for one in contradicted),
    )


def in_groups(recording: Recording, by: Sequence[str]) -> Recording:
    """The recording with its groups as conditions; as it is where a column is not there."""
    if tuple(by) == ("condition",) or not set(by) <= set(recording.trials):
        return recording
    # without a column: a frame of no columns forgets its rows (pandas 2)
    rows = zip(*(recording.trials[column] for column in by), strict=True) if by else ()
    names = [group_name(dict(zip(by, row, strict=True))) for row in rows]
    names = names or [group_name({})] * len(recording.trials)
    return replace(recording, trials=recording.trials.assign(condition=names))
