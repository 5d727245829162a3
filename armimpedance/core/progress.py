"""How far a fit has come, for whoever wants to see it."""

from __future__ import annotations

from collections.abc import Callable

#: Called with what is done and what there is to do.
Progress = Callable[[int, int], None]


class Steps:
    """Counts the steps of a fit and tells `progress` after each."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def step(self) -> None:
        """One more step is done."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)
