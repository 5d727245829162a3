"""Which trials of a large recording are checked: as many as keep every condition judged."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import IntArray
from armimpedance.core.records import Recording

#: More trials than this are not checked before a fit, nor fitted by the checks.
MOST_CHECKED: Final = 4000
#: Of more than ten conditions the four largest keep as many, the others at least so many or none.
LARGEST: Final = 4
OF_THE_LARGEST: Final = 400
LEAST_OF_OTHERS: Final = 16


def spread(recording: Recording) -> Recording:
    """At most 4000 of the trials, spread over all.

    Of many conditions each would be left with too few trials for a fit of its own: the largest,
    by which departures from the model are judged, keep 400, and some of the others enough.
    """
    if recording.n_trials <= MOST_CHECKED:
        return recording
    conditions = recording.trials.groupby("condition", sort=False).indices.values()
    if len(conditions) <= max(LARGEST, MOST_CHECKED // OF_THE_LARGEST):
        return recording.select(_thinned(np.arange(recording.n_trials), MOST_CHECKED))
    by_size = sorted(map(np.sort, conditions), key=len, reverse=True)
    kept = [_thinned(rows, OF_THE_LARGEST) for rows in by_size[:LARGEST]]
    others, left = by_size[LARGEST:], MOST_CHECKED - sum(map(len, kept))
    each = min(max(LEAST_OF_OTHERS, left // len(others)), len(others[0]))
    chosen = _thinned(np.arange(len(others)), left // each)
    kept += [_thinned(others[i], each) for i in chosen]
    return recording.select(np.sort(np.concatenate(kept)))


def _thinned(rows: IntArray, most: int) -> IntArray:
    """At most so many of the rows, from the first to the last at equal distances."""
    if len(rows) <= most:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, most).astype(int)])
