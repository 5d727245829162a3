"""What is asked of one frozen record again and again is worked out once."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar

Record = TypeVar("Record")
Answer = TypeVar("Answer")


def once_per_record(function: Callable[[Record], Answer]) -> Callable[[Record], Answer]:
    """The same function, which keeps its answer as long as the record lives.

    Parameters
    ----------
    function : callable
        Of one record that nobody can change; it always gives the same answer for it.

    Returns
    -------
    callable
    """
    kept: dict[int, tuple[weakref.ref[Any], Answer]] = {}

    @wraps(function)
    def asked(record: Record) -> Answer:
        number = id(record)
        known = kept.get(number)
        if known is not None and known[0]() is record:
            return known[1]
        answer = function(record)
        kept[number] = (weakref.ref(record, lambda _gone: kept.pop(number, None)), answer)
        return answer

    return asked
