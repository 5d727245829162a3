"""Settings of a grid: name, default and allowed values. Standard library only."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from armimpedance.core.errors import InputError

Value = str | int | float | tuple[str, ...] | None
Settings = Mapping[str, Value]


@dataclass(frozen=True)
class Field:
    """One setting of a rig.

    `name`: with its unit, where it has one.
    `check`: entry of the list in the file -> its value.
    `simulated`: whether it changes what is simulated, or only what is estimated from it.
    """

    name: str
    default: Value
    check: Callable[[object], Value]
    simulated: bool = True


def one_of(names: Callable[[], Iterable[str]]) -> Callable[[object], Value]:
    """A name among others, which are looked up when they are needed."""

    def check(value: object) -> Value:
        allowed = list(names())
        if not isinstance(value, str) or value not in allowed:
            raise InputError(f"unknown {value!r}", expected=f"one of {', '.join(allowed)}")
        return value

    return check


def number(low: float, high: float) -> Callable[[object], Value]:
    """A number between limits, both allowed."""

    def check(value: object) -> Value:
        right = isinstance(value, int | float) and not isinstance(value, bool)
        if not right or not low <= value <= high:  # type: ignore[operator]
            raise InputError(f"{value!r}", expected=f"a number from {low:g} to {high:g}")
        return float(value)  # type: ignore[arg-type]

    return check


def whole(low: int, high: int) -> Callable[[object], Value]:
    """A whole number between limits, both allowed."""

    def check(value: object) -> Value:
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise InputError(f"{value!r}", expected=f"a whole number from {low} to {high}")
        return value

    return check


def number_or(name: str, low: float, high: float) -> Callable[[object], Value]:
    """A number between limits, or a word."""
    as_number = number(low, high)

    def check(value: object) -> Value:
        if value == name:
            return name
        if isinstance(value, float) and math.isinf(value):
            raise InputError(f"{value!r}", expected=f'a number or "{name}"')
        try:
            return as_number(value)
        except InputError as error:
            expected = f'a number from {low:g} to {high:g}, or "{name}"'
            raise InputError(error.problem, expected=expected) from None

    return check


def names_or_all(value: object) -> Value:
    """A list of names, one name, or "all"."""
    if isinstance(value, str) and value:
        return None if value == "all" else (value,)
    if isinstance(value, list) and value and all(isinstance(v, str) and v for v in value):
        if len(set(value)) < len(value):
            raise InputError(f"{value!r} names one twice", expected="names that differ")
        return tuple(value)
    expected = 'a list of names for each cell, such as [["a", "b"]], or "all"'
    raise InputError(f"{value!r}", expected=expected)
