"""Findings of checks: one type for every check of a recording, an experiment or a fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from armimpedance.core.errors import InputError

Verdict = Literal["ok", "warning", "unusable", "missing", "cannot tell"]

#: Verdict -> how a line of text begins.
MARKS: Final[dict[str, str]] = {
    "ok": "ok  ",
    "warning": "WARN",
    "unusable": "STOP",
    "missing": "--  ",
    "cannot tell": "??  ",
}


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    `name`: what was checked, such as "force sign"; "" if the message says it.
    `verdict`: `unusable`: an analysis would be refused or meaningless. `missing`: a later analysis
    may need it. `cannot tell`: the data do not show whether the assumption holds; the interval
    allows for it, or the message says how large the error could be.
    `message`: what was detected and what to do, one line.
    `smallest`: detection limit of the check, with its unit; "" if it compares exact facts.
    Raises InputError: an unknown verdict.

    Examples
    --------
    >>> print(Finding("skew", "ok", "+0.02 ms", smallest="0.1 ms"))
    ok    skew: +0.02 ms (would have seen 0.1 ms)
    """

    name: str
    verdict: Verdict
    message: str
    smallest: str = ""

    def __post_init__(self) -> None:
        if self.verdict not in MARKS:
            raise InputError(f"verdict {self.verdict!r}", expected=", ".join(MARKS))

    @property
    def sentence(self) -> str:
        """Name and message, as listed among warnings."""
        return f"{self.name}: {self.message}" if self.name else self.message

    def to_dict(self) -> dict[str, Any]:
        """Return check, verdict, message and smallest, as written to FIT.json."""
        return {
            "check": self.name,
            "verdict": self.verdict,
            "message": self.message,
            "smallest": self.smallest,
        }

    def __str__(self) -> str:
        seen = f" (would have seen {self.smallest})" if self.smallest else ""
        return f"{MARKS[self.verdict]}  {self.sentence}{seen}"


def missing(what: str) -> Finding:
    """Return a finding that something is not known, which a later analysis may need."""
    return Finding("", "missing", f"not known: {what}")


def warnings_of(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Return the sentences of violated or undecided checks: the warnings of a result."""
    return tuple(
        f.sentence for f in findings if f.verdict in ("warning", "unusable", "cannot tell")
    )


def checked_sentence(findings: Iterable[Finding]) -> str:
    """Return a sentence for a methods paragraph on the checks; "" if there were none.

    Returns: one sentence: what was checked, and what is violated or undecided.
    """
    checked = [f for f in findings if f.name and f.verdict != "missing"]
    if not checked:
        return ""
    names = ", ".join(dict.fromkeys(f.name for f in checked))
    failed = ", ".join(dict.fromkeys(f.name for f in checked if f.verdict != "ok"))
    ending = f"violated or not decidable: {failed}" if failed else "no violation was seen"
    return f"These assumptions were held against the data: {names}; {ending}."


#: Checks by the size of the error that a violation may cause, the gravest first; others follow.
GRAVEST: Final = (
    *("units", "force sign", "tremor", "axes", "imposed", "own motion", "session", "labels"),
    *("filter", "single trials", "delay", "gain", "clipping", "held", "plausible"),
    *("inner mode", "reflex", "voluntary"),
    *("amplitude", "friction", "lack of fit", "reach"),
)


def by_gravity(sentences: Iterable[str]) -> list[str]:
    """Return warnings without repeats, the gravest first.

    `sentences`: a name, a colon and a message each, as `Finding.sentence`.

    Examples
    --------
    >>> by_gravity(["friction: makes B wrong", "units: kgf?"])[0]
    'units: kgf?'
    """
    return sorted(dict.fromkeys(sentences), key=lambda text: gravity(text.split(":")[0]))


def gravity(name: str) -> int:
    """Rank of a check by the error that a violation may cause; 0 is the gravest."""
    return GRAVEST.index(name) if name in GRAVEST else len(GRAVEST)


# Contents of a file that its recording leaves out: stated in the provenance, listed by `inspect`.

_BEGINNING: Final = "Not taken: "


def not_taken(what: Sequence[str], why: str) -> tuple[str, ...]:
    """Return a sentence for the provenance on what was left out and why; none if nothing was.

    `what`: names of channels, groups or columns.
    `why`: such as "no meaning was given to them".
    Returns: one sentence or none.

    Examples
    --------
    >>> not_taken(["ACH3", "Gaze_X"], "no meaning was given to them")
    ('Not taken: ACH3, Gaze_X (no meaning was given to them).',)
    """
    return (f"{_BEGINNING}{', '.join(what)} ({why}).",) if what else ()


def told_not_taken(provenance: Iterable[str]) -> tuple[str, ...]:
    """Return what these sentences list as left out, without their common beginning."""
    return tuple(s.removeprefix(_BEGINNING) for s in provenance if s.startswith(_BEGINNING))
