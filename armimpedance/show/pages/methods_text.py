"""Sentences that the methods paragraphs of all topics share."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version
from typing import Final

from armimpedance.core.findings import Finding, checked_sentence
from armimpedance.show.pages.page import Methods

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
    every = (*sentences, checked_sentence(findings))
    said = [s if s.endswith((".", "!", "?")) else f"{s}." for s in every if s]
    cited = dict.fromkeys((*references, CITED.format(version("armimpedance"))))
    return Methods(" ".join(said), tuple(cited))
