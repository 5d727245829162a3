"""The last rows of a stream, in one block of memory that does not grow."""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray


class LastRows:
    """The last rows that were pushed, one after another in memory."""

    def __init__(self, length: int, width: int) -> None:
        # every row stands twice: any `length` of them in turn are then one block
        self._rows = np.zeros((2 * length, width))
        self._length = length
        self._next = 0

    def push(self, row: FloatArray) -> None:
        """Add a row (width,); the oldest one goes."""
        self._rows[self._next] = self._rows[self._next + self._length] = row
        self._next = (self._next + 1) % self._length

    def last(self, count: int) -> FloatArray:
        """The last rows (count, width), oldest first; a view that the next push changes."""
        end = self._next + self._length
        return self._rows[end - count : end]
