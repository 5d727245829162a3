"""Results of several groups of trials, found by the values of their columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from armimpedance.core.errors import InputError


def position_of(which: object, groups: Sequence[tuple[Any, ...]]) -> int:
    """Number of the group that a name means.

    Parameters
    ----------
    which : object
        The value of one of the group's columns, or a tuple of the values of all of them.
    groups : sequence of tuples
        The values of each group's columns.

    Raises
    ------
    InputError
        No group has this name, or several have; the message lists the names.
    """
    wanted = tuple(map(str, which)) if isinstance(which, tuple) else None
    texts = [tuple(map(str, values)) for values in groups]
    fits = [i for i, own in enumerate(texts) if own == wanted or str(which) in own]
    if len(fits) == 1:
        return fits[0]
    problem = "names several groups" if fits else "names no group"
    # a single name is looked up as a text, several as a tuple
    known = ", ".join(repr(own[0] if len(own) == 1 else own) for own in texts)
    raise InputError(f"{which!r} {problem}", expected=f"one of {known}")


def as_columns(by: str | Sequence[str]) -> tuple[str, ...]:
    """One column's name or several as a tuple."""
    return (by,) if isinstance(by, str) else tuple(by)
