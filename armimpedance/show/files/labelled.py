"""Results as labelled arrays: a matrix is one array, axes have names, numbers their unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from armimpedance.core.conventions import AXES
from armimpedance.core.described import Meaning
from armimpedance.core.errors import InputError, needed
from armimpedance.core.program import software
from armimpedance.show.files.content import Cells, Content
from armimpedance.show.files.words import IMPEDANCE_COLUMNS, RowAxes, meaning_of

if TYPE_CHECKING:
    import xarray

#: Arrays that a table holds as text, which no array of numbers can hold.
_AS_TEXT: Final = ("covariance", "shared_errors")
#: Keys that say how a row was made, not which it is.
_OF_THE_ESTIMATE: Final = frozenset(column.name for column in IMPEDANCE_COLUMNS)
#: The dimension of the rows.
ROW: Final = "row"


@dataclass(frozen=True)
class _Place:
    """Where a column stands in the arrays: its array, and its place in it, from 0."""

    column: str
    array: str
    at: tuple[int, ...]
    dims: tuple[str, ...]
    means: Meaning


def dataset_of(content: Content) -> xarray.Dataset:
    """The table of a result as labelled arrays, one for each quantity.

    Parameters
    ----------
    content : Content

    Returns
    -------
    xarray.Dataset
        Dimension ``row``, with the columns that name a row as coordinates, the first of them that
        does so by itself as its index; ``i`` and ``j`` of
        matrices, ``axis``, ``joint``, ``muscle`` of lists. Each array has its `units` and its
        `long_name`; errors and limits are arrays beside it: ``K``, ``sd_K``, ``ci_low_K``.

    Raises
    ------
    InputError
        xarray is not installed, there is no row, or rows at several levels, whose units differ.
    """
    xr = needed("xarray", "xarray", None)
    axes = _axes(content.rows)
    arrays: dict[str, list[_Place]] = {}
    for place in _places(content, axes):
        arrays.setdefault(place.array, []).append(place)
    texts: dict[str, tuple[str, list[Any]]] = {}
    data: dict[str, tuple[Any, ...]] = {}
    for name, places in arrays.items():
        cells = [[row.get(place.column) for row in content.rows] for place in places]
        if any(isinstance(cell, str) for cell in cells[0]) or name in content.keys:
            texts[name] = (ROW, _texts(cells[0]))
        else:
            data[name] = _array(places, cells)
    dims = {dim for place in arrays.values() for dim in place[0].dims}
    steps = {dim: list(axes.names) for dim in dims & {"i", "j"}}
    # places and forces of the hand, also of one that is described at its joints
    steps |= {dim: list(AXES[: _size(dim, data)]) for dim in dims & {"axis"}}
    index = dict(islice(_indexes(content, texts), 1))
    return xr.Dataset(data, {**texts, **steps, **index}, {"source": software()})


def _indexes(
    content: Content, texts: Mapping[str, tuple[str, list[Any]]]
) -> Iterator[tuple[str, list[Any]]]:
    """Columns that name each row by themselves: of a group's, else the first of the table."""
    for name in content.keys or content.columns[:1]:
        cells = texts[name][1] if name in texts else []
        if name not in _OF_THE_ESTIMATE and len(set(cells)) == len(content.rows):
            yield ROW, cells


def _size(dim: str, data: Mapping[str, tuple[Any, ...]]) -> int:
    """The length of a dimension."""
    return next(v.shape[dims.index(dim)] for dims, v, _ in data.values() if dim in dims)


def _axes(rows: Sequence[Cells]) -> RowAxes:
    """The axes that all rows have; those of the most, where some have fewer."""
    axes_of_rows = sorted(map(RowAxes.of, rows), key=lambda one: one.count)
    levels = dict.fromkeys(one.level for one in axes_of_rows)
    if len(levels) != 1:
        problem = f"rows at the levels {', '.join(levels)}" if levels else "a result without rows"
        raise InputError(problem, expected="rows of one level")
    return axes_of_rows[-1]


def _places(content: Content, axes: RowAxes) -> Iterator[_Place]:
    for column in content.columns:
        if column in _AS_TEXT:
            continue
        means = meaning_of(column, axes, content.described)
        at = tuple(number - 1 for number in (means.i, means.j) if number is not None)
        numbers = "".join(str(number + 1) for number in at)
        array = re.sub(rf"_{numbers}(?=_|$)", "", column, count=1) if at else column
        dims = ("i", "j") if len(at) == 2 else (means.along,) * len(at)
        yield _Place(column, array, at, dims, means)


def _array(places: Sequence[_Place], cells: Sequence[Sequence[Any]]) -> tuple[Any, ...]:
    """Dimensions, values and attributes of one array; NaN where a row has no number."""
    first = places[0]
    if not first.at and all(isinstance(cell, bool | np.bool_) for cell in cells[0]):
        return (ROW, np.array(cells[0], dtype=bool), _attributes(first))
    shape = tuple(np.max([place.at for place in places], axis=0) + 1) if first.at else ()
    values = np.full((len(cells[0]), *shape), np.nan)
    for place, column in zip(places, cells, strict=True):
        where: tuple[Any, ...] = (slice(None), *place.at)
        values[where] = [np.nan if cell is None else cell for cell in column]
    return ((ROW, *first.dims), values, _attributes(first))


def _attributes(place: _Place) -> dict[str, str]:
    unit = {"units": place.means.unit} if place.means.unit else {}
    return {"long_name": place.means.whole or place.means.words, **unit}


def _texts(cells: Sequence[Any]) -> list[Any]:
    numeric = all(isinstance(cell, int | float) and cell is not None for cell in cells)
    return list(cells) if numeric else ["" if cell is None else str(cell) for cell in cells]
