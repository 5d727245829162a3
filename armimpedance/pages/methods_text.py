"""Sentences that the methods paragraphs of all topics share."""

from __future__ import annotations

import re
from collections.abc import Sequence
from importlib.metadata import version
from itertools import chain
from typing import Final

from armimpedance.findings import Finding
from armimpedance.pages.page import Methods

#: Kind of covariance -> how a paper says it.
COVARIANCES: Final = {
    "cr3": "the jackknife over trials (CR3)",
    "replicates": "the spread of trials within each direction of disturbance",
    "cr1": "the sandwich covariance clustered by trial (CR1)",
    "bootstrap": "drawing trials with replacement",
}
#: A number that stands by itself, not one in a name such as "cr3".
_NUMBER: Final = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w|\.\d)")
CITED: Final = "armimpedance: impedance of the human arm, version {}."


def software() -> str:
    """The program and its version, as a paper names it."""
    return f"armimpedance {version('armimpedance')}"


def shared_steps(steps: Sequence[Sequence[str]]) -> list[str]:
    """What was done to all groups, each step once; a number that differs is given as a range.

    Parameters
    ----------
    steps : sequence of sequence of str
        The provenance of each group.

    Returns
    -------
    list of str
        The steps of the first group that all groups have, apart from their numbers.
    """
    shared = []
    for step in dict.fromkeys(steps[0] if steps else ()):
        words = _NUMBER.split(step)
        like = [[one for one in own if _NUMBER.split(one) == words] for own in steps]
        if all(like):
            columns = zip(*map(_NUMBER.findall, chain(*like)), strict=True)
            numbers = [_span(column) for column in columns]
            shared.append("".join(a + b for a, b in zip(words, [*numbers, ""], strict=True)))
    return list(dict.fromkeys(shared))


def _span(numbers: Sequence[str]) -> str:
    """The number, or the smallest and the largest of them."""
    low, high = min(numbers, key=float), max(numbers, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"


def methods_of(
    sentences: Sequence[str], references: Sequence[str] = (), findings: Sequence[Finding] = ()
) -> Methods:
    """Whole sentences as one paragraph, what was checked at its end; the program is cited last.

    Parameters
    ----------
    sentences : sequence of str
        Without a full stop where they are to get one; empty ones are left out.
    references : sequence of str
        Each is listed once.
    findings : sequence of Finding

    Returns
    -------
    Methods
    """
    said = [s if s.endswith((".", "!", "?")) else f"{s}." for s in sentences if s]
    cited = dict.fromkeys((*references, CITED.format(version("armimpedance"))))
    return Methods(" ".join([*said, *_checked_sentences(findings)]), tuple(cited))


def _checked_sentences(findings: Sequence[Finding]) -> list[str]:
    """Which assumptions were held against the data, and which of them failed."""
    asked = [f for f in findings if f.verdict != "missing" and f.name]
    if not asked:
        return []
    names = ", ".join(dict.fromkeys(f.name for f in asked))
    failed = ", ".join(dict.fromkeys(f.name for f in asked if f.verdict != "ok"))
    ending = f"; violated or not decidable: {failed}" if failed else "; no violation was seen"
    return [f"These assumptions were held against the data: {names}{ending}."]
