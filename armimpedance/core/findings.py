"""What a check found: one type for every check of a recording, an experiment or a fit."""

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
    """One thing that was looked at.

    `name`: what was looked at, such as "force sign"; "" where the message says it.
    `verdict`: `unusable`: an analysis would be refused or meaningless. `missing`: a later analysis
    may ask for it. `cannot tell`: the data do not show whether the assumption holds; the interval
    allows for it, or the message says what it could cost.
    `message`: what was seen and what to do, one line.
    `smallest`: the smallest violation that this check would have seen, with its unit; "" where the
    check compares exact facts.
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
        """The name and the message, as it stands among warnings."""
        return f"{self.name}: {self.message}" if self.name else self.message

    def to_dict(self) -> dict[str, Any]:
        """Check, verdict, message, smallest: what FIT.json holds of it."""
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
    """A finding that something is not known, which a later analysis may ask for."""
    return Finding("", "missing", f"not known: {what}")


def warnings_of(findings: Iterable[Finding]) -> tuple[str, ...]:
    """The sentences of what is violated or cannot be told: the warnings of a result."""
    return tuple(
        f.sentence for f in findings if f.verdict in ("warning", "unusable", "cannot tell")
    )


def checked_sentence(findings: Iterable[Finding]) -> str:
    """What a methods paragraph says of the checks; "" where none was made.

    Returns: one sentence: what was held against the data, and what is violated or cannot be told.
    """
    asked = [f for f in findings if f.name and f.verdict != "missing"]
    if not asked:
        return ""
    names = ", ".join(dict.fromkeys(f.name for f in asked))
    failed = ", ".join(dict.fromkeys(f.name for f in asked if f.verdict != "ok"))
    ending = f"violated or not decidable: {failed}" if failed else "no violation was seen"
    return f"These assumptions were held against the data: {names}; {ending}."


#: Checks in the order of what they may make wrong, the gravest first; others follow as they come.
GRAVEST: Final = (
    *("units", "force sign", "tremor", "axes", "imposed", "own motion", "session", "labels"),
    *("filter", "single trials", "delay", "gain", "clipping", "held", "plausible"),
    *("inner mode", "reflex", "voluntary"),
    *("amplitude", "friction", "lack of fit", "reach"),
)


def by_gravity(sentences: Iterable[str]) -> list[str]:
    """Warnings without repeats, those first that may make most wrong.

    `sentences`: such as `Finding.sentence`: a name, a colon, a message.

    Examples
    --------
    >>> by_gravity(["friction: makes B wrong", "units: kgf?"])[0]
    'units: kgf?'
    """
    return sorted(dict.fromkeys(sentences), key=lambda text: gravity(text.split(":")[0]))


def gravity(name: str) -> int:
    """A check's place among those that may make most wrong, the gravest 0."""
    return GRAVEST.index(name) if name in GRAVEST else len(GRAVEST)


# What a file holds and a recording of it does not: said in its provenance, listed by `inspect`.

_BEGINNING: Final = "Not taken: "


def not_taken(what: Sequence[str], why: str) -> tuple[str, ...]:
    """A sentence of the provenance on what was not taken, and why; none where that is nothing.

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
    """What these sentences say was not taken, without their beginning."""
    return tuple(s.removeprefix(_BEGINNING) for s in provenance if s.startswith(_BEGINNING))
