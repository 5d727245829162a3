"""Plain values as MATLAB has them: structs, cells of texts, matrices, and names that it takes.

MATLAB's names are letters, digits and underscores, begin with a letter, have at most 63 characters
and are no word of the language. Others are mended, and the file says which.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.described import Meaning
from armimpedance.show.files.content import Cells, Content, of_one_cell
from armimpedance.show.files.words import meaning_of

#: Words of MATLAB and Octave that cannot name a field's dot access everywhere.
_WORDS: Final = frozenset(
    (
        *("break", "case", "catch", "classdef", "continue", "do", "else", "elseif", "end"),
        *("endfunction", "endif", "endwhile", "for", "function", "global", "if", "otherwise"),
        *("parfor", "persistent", "return", "spmd", "switch", "try", "until", "while"),
    )
)
LONGEST_NAME: Final = 63


class Names:
    """Names of fields, mended where MATLAB would not take them; each name is mended alike."""

    def __init__(self) -> None:
        #: Mended name -> the name that it stands for, of those that had to be mended.
        self.mended: dict[str, str] = {}
        self._taken: dict[str, str] = {}

    def of(self, name: str) -> str:
        """The field's name for a name.

        Returns: valid in MATLAB; two different names never become one.
        """
        if name in self._taken:
            return self._taken[name]
        valid = _valid(name)
        given, number = valid, 1
        while given in self._taken.values():
            number += 1
            given = f"{valid[: LONGEST_NAME - len(str(number)) - 1]}_{number}"
        self._taken[name] = given
        if given != name:
            self.mended[given] = name
        return given


def _valid(name: str) -> str:
    valid = re.sub(r"[^0-9A-Za-z_]", "_", name)
    if not valid or not valid[0].isascii() or not valid[0].isalpha() or valid in _WORDS:
        valid = f"x{valid}"
    return valid[:LONGEST_NAME]


def matlab_value(value: Any, names: Names) -> Any:
    """A plain value as SciPy writes it to a MATLAB file.

    Returns: a mapping becomes a struct, a list of mappings a struct array, a list of texts a column
    of cells, a list of numbers (also nested) a matrix, None an empty matrix, and an empty tuple,
    which stands for no texts, an empty cell array.
    """
    if value is None:
        return np.zeros((0, 0))
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        fields = {names.of(str(name)): matlab_value(one, names) for name, one in value.items()}
        return fields or {"none": np.zeros((0, 0))}
    if isinstance(value, np.ndarray):
        return np.atleast_2d(value)
    if isinstance(value, (bool, np.bool_)):
        return np.array([[bool(value)]])
    if isinstance(value, (int, float, np.number)):
        return np.array([[float(value)]])
    if isinstance(value, tuple) and not value:
        return np.empty((0, 1), dtype=object)
    return _list(list(value), names)


def _text(value: str) -> Any:
    # a lone surrogate is no character: what writes the other formats refuses it as well
    value.encode("utf-8")
    return value


def _list(values: Sequence[Any], names: Names) -> Any:
    if not values:
        return np.zeros((0, 0))
    if all(isinstance(one, Mapping) for one in values):
        return struct_array(values, names)
    if all(isinstance(one, str) for one in values):
        return _cells(values, names)
    try:
        return np.atleast_2d(np.array([_numbers(one) for one in values], dtype=float))
    except (ValueError, TypeError):
        return _cells(values, names)


def _numbers(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_numbers(one) for one in value]
    if isinstance(value, (str, Mapping)):
        raise TypeError
    return np.nan if value is None else value


def _cells(values: Iterable[Any], names: Names) -> Any:
    values_of_cells = [matlab_value(one, names) for one in values]
    cells = np.empty((len(values_of_cells), 1), dtype=object)
    for row, one in enumerate(values_of_cells):
        cells[row, 0] = one
    return cells


def struct_array(rows: Sequence[Mapping[str, Any]], names: Names) -> Any:
    """Rows as one struct array; a field that a row does not have is empty there.

    Returns: (1, rows) structured array.
    """
    fields = list(dict.fromkeys(str(name) for row in rows for name in row)) or ["none"]
    kinds = [(names.of(field), object) for field in fields]
    array = np.empty((1, len(rows)), dtype=kinds)
    for at, row in enumerate(rows):
        for field, (valid, _) in zip(fields, kinds, strict=True):
            array[valid][0, at] = matlab_value(row.get(field), names)
    return array


# A .mat file (version 5, also read by Octave and SciPy): a struct array with units.
#
# ``results(1).stiffness``, ``results(1).units.stiffness``, ``results(1).keys.condition``: one
# struct a row. Beside it ``checks``, ``methods``, ``made``, and ``mended_names``: the names that
# MATLAB would not take.

#: The first 116 bytes of the file are free text, where SciPy puts the time.
_HEADER: Final = "MATLAB 5.0 MAT-file, written by armimpedance"


def write_mat(content: Content, path: Path) -> None:
    """Write results, checks and methods; the same result gives the same bytes."""
    from scipy.io import savemat

    names = Names()
    rows = _structs(content) if content.structs is None else list(content.structs())
    variables = {
        "results": struct_array(rows, names),
        "checks": matlab_value([check.to_dict() for check in content.about.checks], names),
        "methods": content.about.methods,
        "made": matlab_value([{"what": k, "text": v} for k, v in content.about.made], names),
    }
    mended = [{"field": field, "name": name} for field, name in sorted(names.mended.items())]
    variables["mended_names"] = matlab_value(mended, names)
    savemat(str(path), variables, format="5", long_field_names=True, do_compression=True)
    with open(path, "r+b") as stream:
        stream.write(_HEADER.encode("ascii").ljust(116))


def _structs(content: Content) -> list[dict[str, Any]]:
    """Row by row: its texts as `keys`, its numbers by their columns' names, their units."""
    # of columns: where each row has a unit of its own, it stands among the row's keys
    unit_of = {one.quantity: one.unit for one in content.long}
    units = {name: unit_of[name] for name in content.columns if name in unit_of}
    return [_struct(content.columns, row, units) for row in content.rows]


def _struct(columns: Any, row: Cells, units: dict[str, str]) -> dict[str, Any]:
    cells = {name: row.get(name) for name in columns}
    sentences = ("warnings", "provenance", "notes")
    keys = {n: c for n, c in cells.items() if isinstance(c, str) and n not in sentences}
    lists = {name: of_one_cell(str(cells[name] or "")) for name in sentences if name in cells}
    numbers = {n: float("nan") if c is None else c for n, c in cells.items() if n not in keys}
    numbers = {n: c for n, c in numbers.items() if n not in lists}
    return {"keys": keys, **numbers, **({"units": units} if units else {}), **lists}


# A course over time as MATLAB has it: one struct with a vector a column, not a struct a sample.


def course_struct(
    columns: Sequence[str], rows: Sequence[Cells], described: Mapping[str, Meaning]
) -> dict[str, Any]:
    """The columns of a table as vectors, with their units.

    Parameters
    ----------
    columns : sequence of str
    rows : sequence of mappings
    described : mapping
        What the columns are.

    Returns
    -------
    dict
        Column -> (rows, 1) array, not a number where a cell is empty; texts as cells, or one text
        where all rows have the same. `units` holds those that are known.
    """
    means = {name: meaning_of(name, described=described) for name in columns}
    units = {name: one.unit for name, one in means.items() if one.unit}
    return {**{n: _vector([row.get(n) for row in rows]) for n in columns}, "units": units}


def _vector(cells: Sequence[Any]) -> Any:
    if any(isinstance(cell, str) for cell in cells):
        texts = tuple("" if cell is None else str(cell) for cell in cells)
        return texts[0] if len(set(texts)) == 1 else texts
    if cells and all(isinstance(cell, (bool, np.bool_)) for cell in cells):
        return np.array(cells, dtype=bool)[:, None]
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=float)[:, None]
