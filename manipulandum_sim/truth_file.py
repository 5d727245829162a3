"""Form of all rigs' truths on disk: one JSON object, arrays row by row."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.outputs import staged_file


def write_values(
    values: Mapping[str, Any], path: str | os.PathLike[str], indent: int | None = None
) -> None:
    """Write names and values; a file of that name is replaced at once or not at all."""
    plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}
    with staged_file(path) as staged:
        staged.write_text(json.dumps(plain, indent=indent) + "\n", encoding="utf-8")


def row_of(condition: str, conditions: Sequence[str]) -> int:
    """The row of a condition.

    Raises
    ------
    InputError
        If there is no such condition.
    """
    if condition not in conditions:
        raise InputError(f"no truth for condition {condition!r}")
    return conditions.index(condition)


@contextmanager
def reading_values(path: str | os.PathLike[str], what: str) -> Iterator[dict[str, Any]]:
    """The values of a file, as they lie there; what cannot be made of them is told with its name.

    Raises
    ------
    InputError
        The file is not ``what``.
    """
    try:
        yield json.loads(Path(path).read_text(encoding="utf-8"))
    except RecordError:
        raise
    except (OSError, ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError(f"not {what}: {error}", file=path) from error
