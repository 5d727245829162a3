"""Several sentences in one cell of a table, and out of it again; those that all rows share."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Final

_BETWEEN: Final = "; "
_LIST: Final = re.compile(r"\d, \d")
#: A number that stands by itself, not one in a name such as "cr3".
_NUMBER: Final = re.compile(r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w|\.\d)")


def in_one_cell(sentences: Iterable[str]) -> str:
    """The sentences with ``"; "`` between them; within a sentence it becomes a comma.

    A sentence that kept it would come back as two.
    """
    return _BETWEEN.join(sentence.replace(_BETWEEN, ", ") for sentence in sentences)


def of_one_cell(text: str | None) -> tuple[str, ...]:
    """What `in_one_cell` put into a cell; none of an empty one."""
    return tuple(part for part in (text or "").split(_BETWEEN) if part)


def shared_steps(steps: Sequence[Sequence[str]]) -> list[str]:
    """What was done to all groups, each step once; a number that differs is given as a range.

    Parameters
    ----------
    steps : sequence of sequence of str
        The provenance of each group.

    Returns
    -------
    list of str
        The steps of the first group that all groups have, apart from their numbers.
    """
    shared = []
    for step in dict.fromkeys(steps[0] if steps else ()):
        words = _NUMBER.split(step)
        like = [[one for one in own if _NUMBER.split(one) == words] for own in steps]
        # numbers of a list, such as those of trials, make no range
        listed = _LIST.search(step) and len(set(chain(*like))) > 1
        if all(like) and not listed:
            columns = zip(*map(_NUMBER.findall, chain(*like)), strict=True)
            numbers = [_span(column) for column in columns]
            shared.append("".join(a + b for a, b in zip(words, [*numbers, ""], strict=True)))
    return list(dict.fromkeys(shared))


def _span(numbers: Sequence[str]) -> str:
    """The number, or the smallest and the largest of them."""
    low, high = min(numbers, key=float), max(numbers, key=float)
    return low if float(low) == float(high) else f"{low} to {high}"
