"""From one row a group to one row a quantity, by the names of the columns.

A column ``X`` may have ``sd_X``, ``ci_low_X`` and ``ci_high_X`` beside it: one quantity with its
standard error and its 95 % limits.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from numbers import Real
from typing import Any, Final

from armimpedance.show.files.written.content import Cells, Quantity
from armimpedance.show.files.written.words import Meaning, meaning_of

#: Beginnings of columns that belong to another column -> the field of the quantity, or its column.
_BESIDE: Final = {
    "sd_": "sd",
    "ci_low_": "lower",
    "ci_high_": "upper",
    "feasible_low_": "feasible_lower",
    "feasible_high_": "feasible_upper",
    "efficiency_": "efficiency",
}
_RANGES: Final = ("ci_low_", "ci_high_", "feasible_low_", "feasible_high_")
_OWN: Final = ("lower", "upper", "sd")
_COUNTED: Final = re.compile(r"K_(\d)(\d)")

Meaner = Callable[[str, str, int], Meaning]


def quantities_of(
    columns: Sequence[str],
    rows: Sequence[Cells],
    keys: Sequence[str],
    meaning: Meaner = meaning_of,
) -> list[Quantity]:
    """One entry for each number of each row that has a value or limits.

    Parameters
    ----------
    columns : sequence of str
        Of the wide table, in their order.
    rows : sequence of mappings
    keys : sequence of str
        Columns that name a row; they stand before each of its quantities. Texts and truths that
        are no keys are left out.
    meaning : function (column, level, axes), optional
        What a column means.

    Returns
    -------
    list of Quantity
    """
    beside = _beside(columns)
    base = {name: column for column, others in beside.items() for name in others.values()}
    # limits may stand without the number that they are of: a range, nothing more
    own = dict.fromkeys(base.get(name, name) for name in columns if name not in keys)
    return [one for row in rows for one in _of_row(row, own, keys, beside, meaning)]


def _beside(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Column -> what stands beside it: field -> its column."""
    known = set(columns)
    found: dict[str, dict[str, str]] = {}
    for name in columns:
        for beginning, field in _BESIDE.items():
            base = name.removeprefix(beginning)
            if base == name:
                continue
            # The sd of a percentage is told without the unit: share_percent, sd_share.
            own = [column for column in (base, f"{base}_percent") if column in known]
            for column in own or ([base] if beginning in _RANGES else []):
                found.setdefault(column, {})[field] = name
    return found


def _of_row(
    row: Cells,
    own: Iterable[str],
    keys: Sequence[str],
    beside: dict[str, dict[str, str]],
    meaning: Meaner,
) -> Iterator[Quantity]:
    level = row.get("level")
    level = level if level in ("hand", "joint", "muscle") else "hand"
    named = {name: row.get(name) for name in keys}
    # what the checks said of the data behind the row
    verdict = {"verdict": "warning" if row["warnings"] else "ok"} if "warnings" in row else {}
    axes = _axes(row)
    for name in own:
        value = row.get(name)
        if not (value is None or _is_number(value)):
            continue
        others = {field: number(row.get(column)) for field, column in beside.get(name, {}).items()}
        if number(value) is None and all(other is None for other in others.values()):
            continue
        means = meaning(name, level, axes)
        limits = {field: others.pop(field, None) for field in _OWN}
        yield Quantity(
            named,
            name,
            means.words,
            number(value),
            **limits,
            unit=means.unit,
            i=means.i,
            j=means.j,
            more={**others, **verdict},
        )


def _axes(row: Cells) -> int:
    """The number of axes of a row: the highest number in ``K_ij``."""
    found = (_COUNTED.fullmatch(name) for name, cell in row.items() if cell is not None)
    return max((int(match[1]) for match in found if match), default=2)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def number(value: Any) -> float | None:
    """A cell as a number; None where it is none or not a number.

    Parameters
    ----------
    value : Any

    Returns
    -------
    float or None
    """
    if not _is_number(value) or math.isnan(value):
        return None
    return float(value)
