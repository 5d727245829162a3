"""The columns of every result: what the results say of themselves."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path

from rst import directive, title

import armimpedance
from armimpedance.core.described import Meaning, meanings
from armimpedance.show.files import IMPEDANCE_COLUMNS, FittedResult, WrittenResult

_INTRODUCTION = """\
What stands in the columns of the tables that results are written to. Beside a number stand
``sd_`` (standard error), ``ci_low_`` and ``ci_high_`` (95 % limits). ``…`` stands for a muscle,
a joint or a segment. In Python ``result.to_frame()``, ``to_long()`` and ``to_xarray()`` hold the
same numbers.
"""
_MATRICES = {
    "M_{ij}, B_{ij}, K_{ij}": Meaning("inertia, viscosity, stiffness: row i, column j", "of level"),
    "K_size, K_orientation_deg, K_shape": Meaning("ellipse of a matrix"),
    "position_{i}_m, force_{i}_N": Meaning("place and force of the hand", "m, N"),
}


def column_pages() -> dict[str, str]:
    """Name of the page -> its text."""
    text = [title("Columns of results"), _INTRODUCTION]
    text += [_section("Impedance", _MATRICES | meanings(IMPEDANCE_COLUMNS), "Of every estimate.")]
    text += [_section("Fitted numbers", FittedResult.DESCRIBED, "Of every fit: a row a number.")]
    seen: list[Mapping[str, Meaning]] = []
    for kind in sorted(_results(), key=lambda kind: kind.__name__):
        first = (inspect.getdoc(kind) or "").splitlines()[0]
        columns = kind.MEANINGS if issubclass(kind, FittedResult) else kind.DESCRIBED
        if columns and columns not in seen:
            seen.append(columns)
            text.append(_section(kind.__name__, columns, first))
    return {"reference/columns": "\n".join(text)}


def _results() -> Iterator[type[WrittenResult]]:
    package = Path(armimpedance.__file__).parent
    for path in sorted(package.rglob("*.py")):
        if "WrittenResult" in path.read_text() or "FittedResult" in path.read_text():
            parts = path.relative_to(package.parent).with_suffix("").parts
            module = importlib.import_module(".".join(parts))
            own = (k for k in vars(module).values() if isinstance(k, type))
            yield from (
                k for k in own if issubclass(k, WrittenResult) and k.__module__ == module.__name__
            )


def _section(name: str, columns: Mapping[str, Meaning], what: str) -> str:
    rows = "\n".join(
        f"* - ``{column}``\n  - {means.words}\n  - {means.unit}".replace("{}", "…")
        for column, means in columns.items()
    )
    head = "* - column\n  - what it is\n  - unit\n"
    table = directive("list-table", "", head + rows, header_rows="1", widths="30 55 15")
    return f"{title(name, '-')}\n{what}\n\n{table}"
