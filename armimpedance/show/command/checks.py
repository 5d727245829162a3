"""Numbers given with options, and what is refused of them."""

from __future__ import annotations

from armimpedance.core.errors import InputError


def check_seed(seed: int) -> None:
    """Random numbers want a seed that is not negative."""
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")


def number(word: str, option: str, expected: str) -> float:
    """A finite positive number given with an option.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise InputError(f"{option} {word}", expected=expected)
    return value
