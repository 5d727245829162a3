"""A course over time as MATLAB has it: one struct with a vector a column, not a struct a sample."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from armimpedance.show.files.written.content import Cells
from armimpedance.show.files.written.words import meaning_of


def course_struct(columns: Sequence[str], rows: Sequence[Cells]) -> dict[str, Any]:
    """The columns of a table as vectors, with their units.

    Parameters
    ----------
    columns : sequence of str
    rows : sequence of mappings

    Returns
    -------
    dict
        Column -> (rows, 1) array, not a number where a cell is empty; texts as cells, or one text
        where all rows have the same. `units` holds those that are known.
    """
    means = {name: meaning_of(name, "joint") for name in columns}
    units = {name: one.unit for name, one in means.items() if one.unit}
    return {**{n: _vector([row.get(n) for row in rows]) for n in columns}, "units": units}


def _vector(cells: Sequence[Any]) -> Any:
    if any(isinstance(cell, str) for cell in cells):
        texts = tuple("" if cell is None else str(cell) for cell in cells)
        return texts[0] if len(set(texts)) == 1 else texts
    if cells and all(isinstance(cell, (bool, np.bool_)) for cell in cells):
        return np.array(cells, dtype=bool)[:, None]
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)[:, None]
