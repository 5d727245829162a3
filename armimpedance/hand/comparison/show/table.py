"""DIFFERENCES.csv: one row per pair of groups and quantity or test, or per quantity over subjects.

Angles in degrees, sd of a ratio as that of its logarithm; missing values are empty.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import isnan
from typing import Any, Final, overload

from armimpedance.core.described import Meaning
from armimpedance.core.findings import Finding
from armimpedance.hand.comparison.groups import Pair
from armimpedance.hand.comparison.subjects import SubjectsChange
from armimpedance.show.files import About, Content, Quantity, in_one_cell, meaning_of

Row = dict[str, Any]

#: With more rows than this, they are not all kept in memory.
_MOST_HELD: Final = 20_000

#: Meanings of the columns; for those without a unit here, the column `unit` of the row has it.
COMPARED: Final = {
    "group_1": Meaning("first group"),
    "group_2": Meaning("second group"),
    "matrix": Meaning("matrix that is compared"),
    "quantity": Meaning("quantity of the matrix, or the test"),
    "unit": Meaning("unit of values, change, limits and sd"),
    "kind": Meaning("difference, ratio or test"),
    "value_1": Meaning("value of the first group"),
    "value_2": Meaning("value of the second group"),
    "change": Meaning("second less first, or second over first; the statistic of a test"),
    "ci_low": Meaning("lower 95 % limit of the change"),
    "ci_high": Meaning("upper 95 % limit of the change"),
    "sd": Meaning("standard error of the change; of a ratio that of its logarithm"),
    "dof": Meaning("degrees of freedom", "1"),
    "p": Meaning("p value", "1"),
    "p_adjusted": Meaning("p value after Holm over the tests", "1"),
    "basis": Meaning("what the standard errors come from"),
    "notes": Meaning("what a reader must know of the pair"),
    "between_sd": Meaning("standard deviation of the change between subjects"),
    "ci_low_between_sd": Meaning("lower 95 % limit of the sd between subjects"),
    "ci_high_between_sd": Meaning("upper 95 % limit of the sd between subjects"),
    "n_subjects": Meaning("number of subjects", "1"),
    "warnings": Meaning("what the checks of the recording warn of"),
}
_OF_SUBJECTS: Final = ("between_sd", "ci_low_between_sd", "ci_high_between_sd", "n_subjects")
PAIR_COLUMNS: Final = tuple(c for c in COMPARED if c not in (*_OF_SUBJECTS, "warnings"))
SUBJECTS_COLUMNS: Final = (
    *("group_1", "group_2", "matrix", "quantity", "unit", "kind", "change", "ci_low", "ci_high"),
    *(*_OF_SUBJECTS, "p", "p_adjusted"),
)


def comparison_rows(
    pairs: Sequence[Pair], over_subjects: Sequence[SubjectsChange] = ()
) -> tuple[tuple[str, ...], Sequence[Row]]:
    """The columns and rows of DIFFERENCES.csv; None if a number does not exist.

    Tests are rows of kind "test": quantity "distance" (`change` is the affine-invariant distance)
    or "t2" (`change` is Hotelling's T2), with `p` and `p_adjusted`.

    `pairs`: every change and test of each pair is a row.
    `over_subjects`: if there are any, the rows are these mean changes and the sd between subjects.
    Returns: `rows`: with many pairs they are built one by one when they are accessed.
    """
    if over_subjects:
        cells_of_rows = [_subjects_cells(change.in_degrees()) for change in over_subjects]
        return SUBJECTS_COLUMNS, [_without_nan(row, SUBJECTS_COLUMNS) for row in cells_of_rows]
    later = _Rows(pairs)
    return PAIR_COLUMNS, later if len(later) > _MOST_HELD else list(later)


@dataclass(frozen=True, eq=False)
class _Rows(Sequence[Row]):
    """The rows of pairs; only those of one pair exist at a time."""

    pairs: Sequence[Pair]
    more: Row = field(default_factory=dict)

    @property
    def _each(self) -> int:
        """Number of rows of a pair: its changes, and two for each test."""
        return len(self.pairs[0].changes) + 2 * len(self.pairs[0].tests) if self.pairs else 0

    def __len__(self) -> int:
        return len(self.pairs) * self._each

    def __iter__(self) -> Iterator[Row]:
        for pair in self.pairs:
            yield from self._of(pair)

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> list[Row]: ...
    def __getitem__(self, index: int | slice) -> Row | list[Row]:
        if isinstance(index, slice):
            return [self[row] for row in range(*index.indices(len(self)))]
        pair, row = divmod(range(len(self))[index], self._each)
        return self._of(self.pairs[pair])[row]

    def _of(self, pair: Pair) -> list[Row]:
        notes = in_one_cell(pair.notes)
        rows = [*map(_change_cells, pair.changes), *_test_cells(pair)]
        return [
            _row((pair.first, pair.second, *cells, pair.basis, notes)) | self.more for cells in rows
        ]


def _row(cells: Iterable[Any]) -> Row:
    """A row of `PAIR_COLUMNS`; None instead of nan."""
    # only nan is not equal to itself
    return {
        name: cell if cell == cell else None for name, cell in zip(PAIR_COLUMNS, cells, strict=True)
    }


def comparison_content(
    pairs: Sequence[Pair],
    over_subjects: Sequence[SubjectsChange] = (),
    warnings: Sequence[str] = (),
    checks: Sequence[Finding] = (),
) -> Content:
    """Content of a file for a comparison.

    `pairs`, `over_subjects`: as for `comparison_rows`.
    `warnings`: each row is marked with them.
    """
    columns, rows = comparison_rows(pairs, over_subjects)
    if warnings:
        marks = {"warnings": in_one_cell(warnings)}
        columns = (*columns, *marks)
        rows = (
            replace(rows, more=marks) if isinstance(rows, _Rows) else [row | marks for row in rows]
        )
    about = About(checks=tuple(checks))
    return Content(
        columns, rows, lambda: [_quantity(row) for row in rows], about=about, described=COMPARED
    )


def _quantity(row: Row) -> Quantity:
    """Convert a change or a test to a row of the long table, with its other cells added."""
    means = meaning_of(row["quantity"] or "")
    own = ("quantity", "change", "ci_low", "ci_high", "sd", "unit")
    keys = {name: row[name] for name in ("group_1", "group_2", "matrix", "kind")}
    return Quantity(
        keys,
        row["quantity"],
        f"{row['kind']} of {row['matrix']} {row['quantity']}",
        row["change"],
        row["ci_low"],
        row["ci_high"],
        row.get("sd"),
        # the sd of a ratio is that of its logarithm
        "1" if row["kind"] == "ratio" else row["unit"] or "",
        means.i,
        means.j,
        {name: cell for name, cell in row.items() if name not in own and name not in keys},
    )


def _without_nan(row: Row, columns: Sequence[str]) -> Row:
    """Cells of a row in the order of the columns, None instead of nan."""
    cells = {column: row.get(column) for column in columns}
    return {k: None if isinstance(v, float) and isnan(v) else v for k, v in cells.items()}


def _change_cells(change: Any) -> tuple[Any, ...]:
    """Cells of a change from `matrix` to `p_adjusted`."""
    c = change.in_degrees()
    ends = (c.first, c.second, c.value, c.low, c.high)
    return c.matrix, c.quantity, c.unit, c.kind, *ends, c.sd, c.dof, None, None


def _test_cells(pair: Pair) -> Iterator[tuple[Any, ...]]:
    """Yield the cells of a pair's tests, the distance and T2 of each matrix."""
    for t in pair.tests:
        for quantity, statistic, p, adjusted in (
            ("distance", t.distance, t.p_distance, t.p_distance_adjusted),
            ("t2", t.t2, t.p_t2, t.p_t2_adjusted),
        ):
            head = (t.matrix, quantity, None, "test", None, None)
            yield *head, statistic, None, None, None, None, p, adjusted


def _subjects_cells(change: SubjectsChange) -> Row:
    names = ("matrix", "quantity", "unit", "kind", "between_sd", "p", "p_adjusted")
    return {
        **{name: getattr(change, name) for name in names},
        "group_1": change.first,
        "group_2": change.second,
        "change": change.value,
        "ci_low": change.low,
        "ci_high": change.high,
        "ci_low_between_sd": change.between_low,
        "ci_high_between_sd": change.between_high,
        "n_subjects": change.n,
    }
