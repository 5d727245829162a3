"""Numbers in a row of the trial table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from armimpedance.core.errors import InputError


def number_in(line: Mapping[Any, Any], column: str) -> float | None:
    """The number that a trial's row has in this column; None where there is none.

    Raises
    ------
    InputError
        There is something else.
    """
    value = line.get(column)
    if value is None:
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.inf
    if np.isinf(number):
        raise InputError(
            f"trial {line['trial']}: {value!r:.40}", column=column, expected="a number"
        )
    return None if np.isnan(number) else number
