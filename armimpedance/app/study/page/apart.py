"""What sets people and conditions apart, as tables of a page."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from armimpedance.show.pages import Block, Prose, Section, Table

#: Rows of outliers on the page; the file beside it holds all.
MOST_ROWS: Final = 200
#: Columns by which a table of `compare --subjects` is known.
_OVER_SUBJECTS: Final = {
    "group_1",
    "group_2",
    "matrix",
    "quantity",
    "change",
    "n_subjects",
    "p_adjusted",
}
#: What a reader of the page sees of each pair of conditions; the file holds all quantities.
_SHOWN: Final = (
    ("stiffness", "size"),
    ("viscosity", "size"),
    ("inertia", "size"),
    ("stiffness", "orientation"),
)

Cells = Mapping[str, Any]


def outliers_table(rows: Sequence[Cells]) -> Table:
    """Who is far from the others, the farthest first: one row a session, with its worst value."""
    sessions: dict[tuple[str, str], list[Cells]] = {}
    for row in rows:
        sessions.setdefault((row["participant"], row["session"]), []).append(row)
    cells = tuple(_far_row(own) for own in list(sessions.values())[:MOST_ROWS])
    more = f", the first {MOST_ROWS} of {len(sessions)}" if len(sessions) > MOST_ROWS else ""
    heads = ("session", "values far", "the farthest", "its value (95 %)", "median", "spreads", "of")
    return Table(f"Sessions far from the others{more}", heads, cells, "outliers")


def _far_row(own: Sequence[Cells]) -> tuple[str, ...]:
    row = own[0]
    quantities = list(dict.fromkeys(str(one["quantity"]).removesuffix("_deg") for one in own))
    more = f" and {len(quantities) - 4} more" if len(quantities) > 4 else ""
    farthest = f"{_quantity(row)}, {row['condition']}" if row["condition"] else _quantity(row)
    return (
        f"{row['participant']} {row['session']}".strip(),
        str(len(own)),
        farthest,
        f"{row['value']:.3g} ({row['ci_low']:.3g} to {row['ci_high']:.3g})",
        f"{row['median']:.3g}",
        f"{row['spreads']:+.1f}",
        f"{', '.join(name.replace('_', ' ', 1) for name in quantities[:4])}{more}",
    )


def _quantity(row: Cells) -> str:
    unit = f" ({row['unit']})" if row["unit"] else ""
    name = str(row["quantity"]).removesuffix("_deg").replace("_", " ", 1)
    return f"{name}{unit}"


def conditions_table(file: Path) -> Table | None:
    """Mean changes over people between conditions; None where a file is no such table."""
    with open(file, newline="", encoding="utf-8") as stream:
        reader = csv.DictReader(stream)
        if not set(reader.fieldnames or ()) >= _OVER_SUBJECTS:
            return None
        rows = list(reader)
    known = dict.fromkeys((row["matrix"], row["quantity"]) for row in rows)
    shown = [name for name in _SHOWN if name in known] or list(known)[: len(_SHOWN)]
    pairs: dict[tuple[str, str], dict[tuple[str, str], str]] = {}
    people: dict[tuple[str, str], str] = {}
    for row in rows:
        pair = (row["group_1"], row["group_2"])
        people[pair] = row["n_subjects"]
        name = (row["matrix"], row["quantity"])
        if name in shown:
            pairs.setdefault(pair, {})[name] = _change(row)
    cells = tuple(
        (" | ".join(pair), people[pair], *(own.get(name, "") for name in shown))
        for pair, own in pairs.items()
    )
    caption = (
        "Mean change over people from the first condition to the second, with its 95 % interval "
        f"and the adjusted p; ratios of sizes. All quantities: {file.name}"
    )
    return Table(caption, ("conditions", "people", *map(_words, shown)), cells)


def _words(name: tuple[str, str]) -> str:
    """Matrix and quantity, which names its matrix where it is an element."""
    matrix, quantity = name
    return quantity.replace("_", " ", 1) if "_" in quantity else f"{quantity} of {matrix}"


def _change(row: Cells) -> str:
    try:
        value, low, high, p = (
            float(row[name]) for name in ("change", "ci_low", "ci_high", "p_adjusted")
        )
    except (ValueError, KeyError):
        return ""
    sign = "x " if row.get("kind") == "ratio" else ""
    unit = f" {row['unit']}" if row.get("unit") and not sign else ""
    return f"{sign}{value:.3g} ({low:.3g} to {high:.3g}){unit}, p {p:.2g}"


_HOW_GROUPS: Final = Prose(
    (
        "People are the sample: each counts once, with the error of its own estimate. p is "
        "adjusted over the conditions of each quantity and the pairs of groups (Holm); by chance "
        "one quantity in twenty would differ. That no difference was found is no proof of none: "
        "read the intervals.",
    )
)


def groups_sections(rows: Sequence[Cells]) -> list[Section]:
    """One section for each column that parts the people into groups."""
    found = []
    for column in dict.fromkeys(row["column"] for row in rows):
        own = [row for row in rows if row["column"] == column]
        pairs = dict.fromkeys((row["first"], row["second"]) for row in own)
        blocks = [
            block
            for pair in pairs
            for block in _pair_blocks(
                column, [row for row in own if (row["first"], row["second"]) == pair]
            )
        ]
        found.append(Section(f"Groups of people: {column}", (_HOW_GROUPS, *blocks)))
    return found


def _pair_blocks(column: str, rows: Sequence[Cells]) -> tuple[Block, ...]:
    first, second = rows[0]["first"], rows[0]["second"]
    quantities = list(dict.fromkeys((row["table"], row["quantity"]) for row in rows))
    differ = {(row["table"], row["quantity"]) for row in rows if row["p_adjusted"] < 0.05}
    text = (
        f"{first} and {second} ({column}) differ in {len(differ)} of {len(quantities)} quantities."
    )
    order = sorted(rows, key=lambda row: row["p"])
    cells = tuple(_groups_row(row) for row in order[:MOST_ROWS])
    caption = f"{second} against {first}: differences, or of sizes and shapes ratios"
    heads = (
        *("quantity", "condition", f"{first} (people)", f"{second} (people)"),
        *("change (95 %)", "p", "adjusted"),
    )
    return (Prose((text,)), Table(caption, heads, cells, f"groups {column}"))


def _groups_row(row: Cells) -> tuple[str, ...]:
    sign = "x " if row["kind"] == "ratio" else ""
    return (
        _quantity(row),
        str(row["condition"]),
        f"{row['mean_first']:.3g} ({row['n_first']})",
        f"{row['mean_second']:.3g} ({row['n_second']})",
        f"{sign}{row['change']:.3g} ({row['low']:.3g} to {row['high']:.3g})",
        f"{row['p']:.2g}",
        f"{row['p_adjusted']:.2g}",
    )
