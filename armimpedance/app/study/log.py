"""What a study did and when, for a person to read: lines added to one file."""

from __future__ import annotations

import time
from datetime import timedelta
from pathlib import Path
from typing import Final

from armimpedance.app.study.participants import Progressed

LOG_NAME: Final = "study.log"


class StudyLog:
    """A file to which each session's end is added; several processes may add to one.

    Parameters
    ----------
    out : Path
        The study's folder.
    """

    def __init__(self, out: Path) -> None:
        self._file = out / LOG_NAME
        self._began = time.monotonic()
        self._worked = 0

    def begun(self, what: str) -> None:
        """Say that a run begins.

        Parameters
        ----------
        what : str
        """
        self._add(f"begin: {what}")

    def ended(self, one: Progressed) -> None:
        """Say what became of a session, and how much time is left; known ones need no line.

        Parameters
        ----------
        one : Progressed
        """
        outcome = one.outcome
        if outcome.recomputed == 0 and not outcome.problem:
            return
        self._worked += 1
        spent = time.monotonic() - self._began
        left = timedelta(seconds=round(spent / self._worked * (one.all - one.done)))
        what = outcome.reason or f"{outcome.recomputed} of {len(outcome.done)} steps run"
        self._add(f"{one.done} of {one.all}: {one.session}: {outcome.state}: {what}; {left} left")

    def _add(self, line: str) -> None:
        now = time.strftime("%Y-%m-%d %H:%M:%S")
        with open(self._file, "a", encoding="utf-8") as stream:
            stream.write(f"{now}  {line}\n")
