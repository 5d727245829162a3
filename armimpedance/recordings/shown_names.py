"""Names that somebody else gave: which can be shown in a line, and how many of a long list."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from armimpedance.core.errors import shortened, shown

LONGEST_NAME: Final = 120
_MOST: Final = 20


def can_be_shown(name: str) -> bool:
    """Whether a column may have this name: it is printable, and no essay."""
    return name.isprintable() and len(name) <= LONGEST_NAME


def shown_name(name: str) -> str:
    """The name for a message, whatever it is made of."""
    return shortened(shown(name[: 4 * LONGEST_NAME]), LONGEST_NAME)


def some_names(names: Iterable[str]) -> list[str]:
    """The first of these names for a sentence, each once, and how many follow."""
    different = list(dict.fromkeys(names))
    told = [shown_name(name) for name in different[:_MOST]]
    return told if len(different) <= _MOST else [*told, f"and {len(different) - _MOST} more"]
