"""Progress of a fit, for a caller that shows it."""

from __future__ import annotations

from collections.abc import Callable

#: Called with the number of steps done and their total.
Progress = Callable[[int, int], None]


class Steps:
    """Counter of the steps of a fit, which calls `progress` after each."""

    def __init__(self, progress: Progress | None, total: int) -> None:
        self._progress, self._total, self._done = progress, total, 0

    def step(self) -> None:
        """Count one more step."""
        self._done += 1
        if self._progress is not None:
            self._progress(self._done, self._total)
