"""Kinds of options: a word, a path, a switch, one of a few values, a number, several of them.

Standard library only, because ``--help`` loads nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from pathlib import Path
from sys import float_info
from typing import Any


def listed(words: Sequence[str]) -> str:
    """Alternatives as a sentence holds them: ``.csv, .json or .parquet``."""
    return ", ".join(words[:-1]) + (" or " if len(words) > 1 else "") + words[-1]


@dataclass(frozen=True)
class AnyWord:
    """Any word; what it means is for the function to judge.

    `metavar`: how the help shows it.
    `python`: the keyword's type, as a docstring names it.
    `unit`: of a number.
    `nothing`: the word that stands for None on the command line; "" where there is none.
    """

    metavar: str = "NAME"
    python: str = "str"
    unit: str = ""
    nothing: str = ""

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"metavar": self.metavar}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return self.python

    @property
    def units(self) -> str:
        """Its unit at the command and as a keyword."""
        return self.unit

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return self.typed

    def holds(self, value: Any) -> bool:
        """Return True if a keyword may have this value."""
        return value is not None

    def of(self, given: Any) -> Any:
        """The keyword's value, of what argparse gives."""
        return given

    def given(self, value: Any) -> Any:
        """A keyword's value as argparse gives it."""
        return value


@dataclass(frozen=True)
class PlaceToRead(AnyWord):
    """A file or folder that is read."""

    metavar: str = "RECORDING"
    python: str = "recording or path"

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"metavar": self.metavar, "type": Path}


@dataclass(frozen=True)
class Switch(AnyWord):
    """A truth value; on the command line the option alone sets it to `to`."""

    python: str = "bool"
    to: bool = True

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"action": "store_true"}

    def given(self, value: Any) -> bool:
        """A keyword's value as argparse gives it."""
        return bool(value == self.to)

    def of(self, given: Any) -> bool:
        """The keyword's value, of what argparse gives."""
        return self.to if given else not self.to


@dataclass(frozen=True)
class OneOf(AnyWord):
    """One of a few values.

    `values`: all that the function takes.
    `offered`: those that the command offers, where these are fewer.
    """

    values: tuple[Any, ...] = ()
    offered: tuple[Any, ...] = ()

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"choices": self.offered or self.values, "type": type(self.values[0])}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return f"{{{', '.join(map(repr, self.values))}}}".replace("'", '"')

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return f"one of {', '.join(map(str, self.values))}"

    def holds(self, value: Any) -> bool:
        """Return True if a keyword may have this value."""
        word = isinstance(value, str | Real) and not isinstance(value, bool)
        return word and value in self.values


@dataclass(frozen=True)
class MethodName(OneOf):
    """One of the methods of a table, whose names the help lists in words of its own."""

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"metavar": self.metavar}


@dataclass(frozen=True)
class Number(AnyWord):
    """A finite number.

    `above`, `low`, `high`, `below`: it is more than `above`, at least `low`, at most `high` and
    less than `below`.
    `word`: one that may stand in its place, such as "auto"; "" where there is none.
    """

    python: str = "float"
    above: float = -inf
    low: float = -inf
    high: float = inf
    below: float = inf
    word: str = ""

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`; where a word is allowed, every value comes as text."""
        words = [word for word in (self.word, self.nothing) if word]
        metavar = "|".join([self._metavar, *words])
        return {"metavar": metavar} if words else {"metavar": metavar, "type": self._number}

    @property
    def _metavar(self) -> str:
        return "PERCENT" if self.unit == "%" else self.unit.upper() or "N"

    @property
    def _number(self) -> Callable[[str], float]:
        return float

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        number = f"{self.python} ({self.unit})" if self.unit else self.python
        words = [f'"{self.word}"'] * bool(self.word) + ["None"] * bool(self.nothing)
        return listed([number, *words])

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        number = f"{self._in_words} {self.unit}".rstrip()
        return f"{number}, or {self.word}" if self.word else number

    @property
    def _in_words(self) -> str:
        return self._limits or ("a number of" if self.unit else "a number")

    @property
    def _limits(self) -> str:
        limits = [
            *([f"more than {self.above:g}"] if self.above > -inf else []),
            *([f"at least {self.low:g}"] if self.low > -inf else []),
            *([f"at most {self.high:g}"] if self.high < inf else []),
            *([f"less than {self.below:g}"] if self.below < inf else []),
        ]
        return " and ".join(limits)

    def holds(self, value: Any) -> bool:
        """Return True if a keyword may have this value."""
        if isinstance(value, str):
            return bool(self.word) and value == self.word
        if isinstance(value, bool) or not isinstance(value, Real):
            return False
        # compared as they are: a whole number may be longer than any float
        number: Any = value
        finite = abs(number) <= self._largest
        within = self.above < number < self.below and self.low <= number <= self.high
        return bool(finite and within)

    @property
    def _largest(self) -> float:
        return float_info.max

    def of(self, given: Any) -> Any:
        """The keyword's value, of what argparse gives; what is no number stays a word."""
        if given == self.nothing:
            return None
        try:
            return self._number(given)
        except ValueError:
            return given


@dataclass(frozen=True)
class Whole(Number):
    """A whole number."""

    python: str = "int"

    @property
    def _number(self) -> Callable[[str], float]:
        return int

    @property
    def _in_words(self) -> str:
        return f"a whole number, {self._limits}" if self._limits else "a whole number"

    def holds(self, value: Any) -> bool:
        """Return True if a keyword may have this value."""
        return super().holds(value) and isinstance(value, str | Integral)

    @property
    def _largest(self) -> float:
        return inf


@dataclass(frozen=True)
class Milli(Number):
    """A number that the command takes in thousandths of its unit: mm where the keyword is in m."""

    @property
    def _metavar(self) -> str:
        return f"m{self.unit}".upper()

    @property
    def units(self) -> str:
        """Its unit at the command and as a keyword."""
        return f"m{self.unit}, keyword {self.unit}"

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return f"{super().expected} (m{self.unit} at the command)"

    def given(self, value: Any) -> Any:
        """A keyword's value as argparse gives it."""
        return round(1e3 * value, 9)

    def of(self, given: Any) -> Any:
        """The keyword's value, of what argparse gives."""
        return super().of(given) / 1e3


@dataclass(frozen=True)
class SeveralWords(AnyWord):
    """Several words behind one option.

    `count`: how many; 0: one or more.
    """

    python: str = "sequence of str"
    count: int = 0

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"metavar": self.metavar, "nargs": self.count or "+"}

    def of(self, given: Any) -> tuple[str, ...]:
        """The keyword's value, of what argparse gives."""
        return tuple(given)


@dataclass(frozen=True)
class NumberPair(AnyWord):
    """Two numbers that are not negative, the lower first."""

    @property
    def argparse(self) -> dict[str, Any]:
        """Keywords for `add_argument`."""
        return {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return f"(low, high) ({self.unit})"

    @property
    def expected(self) -> str:
        """The allowed values, in words."""
        return f"two numbers that rise, {self.unit}"

    def holds(self, value: Any) -> bool:
        """Return True if a keyword may have this value."""
        one = Number(low=0)
        pair = len(value) == 2 if isinstance(value, Sized) else False
        return pair and all(map(one.holds, value)) and bool(value[0] < value[1])

    def of(self, given: Any) -> tuple[float, ...]:
        """The keyword's value, of what argparse gives."""
        return tuple(given)
