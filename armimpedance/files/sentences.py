"""Several sentences in one cell of a table, and out of it again."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

_BETWEEN: Final = "; "


def in_one_cell(sentences: Iterable[str]) -> str:
    """The sentences with ``"; "`` between them; within a sentence it becomes a comma.

    A sentence that kept it would come back as two.
    """
    return _BETWEEN.join(sentence.replace(_BETWEEN, ", ") for sentence in sentences)


def of_one_cell(text: str | None) -> tuple[str, ...]:
    """What `in_one_cell` put into a cell; none of an empty one."""
    return tuple(part for part in (text or "").split(_BETWEEN) if part)
