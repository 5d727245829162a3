"""A table as a notebook shows it."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape


def html_table(table: Sequence[Sequence[str]]) -> str:
    """A table for notebooks, its first row and first column headings; every text is escaped."""
    head, *rows = ([escape(cell) for cell in row] for row in table)
    body = "".join(
        f"<tr><th>{first}</th>{''.join(f'<td>{cell}</td>' for cell in others)}</tr>"
        for first, *others in rows
    )
    return f"<table><tr>{''.join(f'<th>{cell}</th>' for cell in head)}</tr>{body}</table>"
