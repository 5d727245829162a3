"""JSON files of the toolkit: one writer, one reader, and fields that are read with a check."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import LARGEST
from armimpedance.core.errors import InputError, shortened
from armimpedance.core.inputs import text_of

#: Results, models and descriptions of recordings are far smaller.
LARGEST_BYTES: Final = 200_000_000


def json_text(content: Any) -> str:
    """Return the text of a JSON file: arrays as lists, null for a number that is not finite."""
    return json.dumps(finite(content), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def finite(value: Any) -> Any:
    """Return plain numbers, lists and mappings for JSON; None for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(name): finite(v) for name, v in value.items()}
    if isinstance(value, np.ndarray):
        return finite(value.tolist())
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, np.generic):
        return finite(value.item())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text_of(file: Path, expected: str) -> str:
    text = text_of(file, LARGEST_BYTES, expected)
    if not text.strip():
        raise InputError("is empty", file=file, expected=expected)
    return text


def read_json(file: Path, expected: str = "a JSON object") -> dict[str, Any]:
    """Read the object in a JSON file; its numbers must be finite and its names different."""
    text = _text_of(file, expected)

    def no_constant(name: str) -> float:
        raise InputError(f"holds {name}", file=file, expected="finite numbers")

    def no_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        for name, value in pairs:
            if name in fields:
                problem = f"{json.dumps(name)} appears twice"
                raise InputError(problem, file=file, expected="one value")
            fields[name] = value
        return fields

    try:
        content = json.loads(
            text,
            parse_constant=no_constant,
            parse_int=_whole,
            parse_float=_decimal,
            object_pairs_hook=no_repeats,
        )
    except OverflowError as error:
        written = str(error)
        row = text[: text.index(written)].count("\n") + 1
        problem = f"holds {shortened(written, 40)}"
        raise InputError(problem, file=file, row=row, expected="at most 1.8e308") from None
    except json.JSONDecodeError as error:
        raise InputError(
            f"broken JSON at character {error.colno} of the line: {error.msg}",
            file=file,
            row=error.lineno,
            expected=expected,
        ) from None
    except (RecursionError, ValueError) as error:
        raise InputError(f"broken JSON: {error}", file=file, expected=expected) from None
    return _object(content, text, file, expected)


def _object(content: Any, text: str, file: Path, expected: str) -> dict[str, Any]:
    if not isinstance(content, dict):
        raise InputError("holds no object", file=file, expected=expected)
    if "\\ud" in text.lower() and not _is_writable(content):
        raise InputError("holds half of a character", file=file, expected="whole Unicode text")
    return content


def _whole(digits: str) -> int:
    """Read an integer; one that is too large for a float is refused."""
    # Python's own error for a text of some thousand digits would not help the user.
    if len(digits) <= 300 or (len(digits) <= 310 and math.isfinite(float(digits))):
        return int(digits)
    raise OverflowError(digits)


def _decimal(digits: str) -> float:
    """Read a number with a point or an exponent, which must not be infinite."""
    number = float(digits)
    if math.isinf(number):
        raise OverflowError(digits)
    return number


def _is_writable(content: dict[str, Any]) -> bool:
    """True if every text can be written as UTF-8: half of a surrogate pair cannot."""
    try:
        json.dumps(content, ensure_ascii=False).encode("utf-8")
    except UnicodeEncodeError:
        return False
    return True


class Fields:
    """Fields of one JSON object, each read with a check; its error names the file and the field."""

    def __init__(self, file: Path, values: Mapping[str, Any], prefix: str = "") -> None:
        self.file, self.values, self.prefix = file, values, prefix

    def wrong(self, key: str, expected: str) -> InputError:
        shown = json.dumps(self.values.get(key))
        problem = f"is {shown}" if len(shown) <= 40 else f"is {shown[:37]}…"
        if key not in self.values:
            problem = "is missing"
        return InputError(problem, file=self.file, column=self.prefix + key, expected=expected)

    def _get(self, key: str, required: bool, expected: str) -> Any:
        value = self.values.get(key)
        if value is None and required:
            raise self.wrong(key, expected)
        return value

    def choice(self, key: str, choices: Iterable[str], required: bool = False) -> str | None:
        expected = " or ".join(f'"{c}"' for c in choices)
        value = self._get(key, required, expected)
        if value is not None and value not in tuple(choices):
            raise self.wrong(key, expected)
        return value

    def number(self, key: str, required: bool = False) -> float | None:
        value = self._get(key, required, "a number")
        if value is not None and not is_number(value):
            raise self.wrong(key, "a number")
        return None if value is None else float(value)

    def texts(self, key: str) -> tuple[str, ...] | None:
        value = self.values.get(key)
        if value is None:
            return None
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            raise self.wrong(key, "a list of texts")
        return tuple(value)


def is_number(value: object) -> bool:
    """Return True if a JSON value is a finite number, and not too large to be measured."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return abs(float(value)) < LARGEST
    except OverflowError:
        return False
