"""Sentences that the methods paragraphs of all topics share."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.metadata import version
from typing import Final

from armimpedance.findings import Finding

#: Kind of covariance -> how a paper says it.
COVARIANCES: Final = {
    "cr3": "the jackknife over trials (CR3)",
    "replicates": "the spread of trials within each direction of disturbance",
    "cr1": "the sandwich covariance clustered by trial (CR1)",
    "bootstrap": "drawing trials with replacement",
}
CITED: Final = "armimpedance: impedance of the human arm, version {}."


def software() -> str:
    """The program and its version, as a paper names it."""
    return f"armimpedance {version('armimpedance')}"


def software_reference() -> str:
    """The entry in the list of references."""
    return CITED.format(version("armimpedance"))


def checked_sentence(findings: Iterable[Finding]) -> str:
    """Which assumptions were held against the data, and which of them failed.

    Parameters
    ----------
    findings : iterable of Finding

    Returns
    -------
    str
        One sentence or two; empty where nothing was checked.
    """
    asked = [f for f in findings if f.verdict != "missing" and f.name]
    if not asked:
        return ""
    names = ", ".join(dict.fromkeys(f.name for f in asked))
    failed = ", ".join(dict.fromkeys(f.name for f in asked if f.verdict != "ok"))
    ending = f"; not met or not decidable: {failed}" if failed else "; all were met"
    return f"These assumptions were held against the data: {names}{ending}."


def paragraph(*sentences: str) -> str:
    """Whole sentences as one paragraph; empty ones are left out."""
    return " ".join(s if s.endswith((".", "!", "?")) else f"{s}." for s in sentences if s)
