"""TOML as the project reads it: one reader of mappings, designs of studies and their settings."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular, unchanged

#: Nobody types more.
LARGEST_BYTES: Final = 1_000_000
#: Parts of a key, ``a.b.c = 1``: the reader makes a table for each of them on every line.
_MOST_PARTS: Final = 20


def read_toml(file: Path, expected: str) -> tuple[dict[str, Any], str]:
    """The values in a TOML file, and its text.

    `expected`: what the file should be, such as "a mapping".
    Raises InputError: it is not there, no regular file, too large, or no TOML.
    """
    check_regular(file, LARGEST_BYTES, expected)
    try:
        with unchanged(file):
            text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, expected=expected) from None
    except OSError as error:
        raise InputError(
            f"cannot be read: {error.strerror}", file=file, expected=expected
        ) from None
    for row, line in enumerate(text.splitlines(), start=1):
        key = line.partition("=")[0]
        is_key = "=" in line or line.lstrip().startswith("[")
        if is_key and key.count(".") >= _MOST_PARTS:
            problem = f"a key of {key.count('.') + 1} parts"
            raise InputError(problem, file=file, row=row, expected=f"at most {_MOST_PARTS}")
    try:
        return tomllib.loads(text), text
    except (ValueError, RecursionError) as error:
        raise InputError(f"broken TOML: {error}", file=file, expected=expected) from None
