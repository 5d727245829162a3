"""The options of a verb, each described once.

From one `Option` follow the option of the command and its help, the check of the Python function's
keyword, the keyword's lines in the function's docstring, and the row in the table of options in the
documentation. Standard library only, because ``--help`` loads nothing else.
"""

from __future__ import annotations

import argparse
import inspect
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence, Sized
from dataclasses import dataclass
from functools import wraps
from math import inf
from numbers import Integral, Real
from pathlib import Path
from sys import float_info
from typing import Any, Final, ParamSpec, TypeVar

from armimpedance.core.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")


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
        """What `add_argument` is told of it."""
        return {"metavar": self.metavar}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return self.python

    @property
    def expected(self) -> str:
        """What a value must be, in words."""
        return self.typed

    def holds(self, value: Any) -> bool:
        """Whether a keyword may have this value."""
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
        """What `add_argument` is told of it."""
        return {"metavar": self.metavar, "type": Path}


@dataclass(frozen=True)
class Switch(AnyWord):
    """Whether something is so; on the command line the option alone gives `to`."""

    python: str = "bool"
    to: bool = True

    @property
    def argparse(self) -> dict[str, Any]:
        """What `add_argument` is told of it."""
        return {"action": "store_true"}

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
        """What `add_argument` is told of it."""
        return {"choices": self.offered or self.values, "type": type(self.values[0])}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return f"{{{', '.join(map(repr, self.values))}}}".replace("'", '"')

    @property
    def expected(self) -> str:
        """What a value must be, in words."""
        return f"one of {', '.join(map(str, self.values))}"

    def holds(self, value: Any) -> bool:
        """Whether a keyword may have this value."""
        word = isinstance(value, str | Real) and not isinstance(value, bool)
        return word and value in self.values


@dataclass(frozen=True)
class MethodName(OneOf):
    """One of the methods of a table, whose names the help lists in words of its own."""

    @property
    def argparse(self) -> dict[str, Any]:
        """What `add_argument` is told of it."""
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
        """What `add_argument` is told of it; where a word may be given, all are words to it."""
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
        """What a value must be, in words."""
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
        """Whether a keyword may have this value."""
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
        """Whether a keyword may have this value."""
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
    def expected(self) -> str:
        """What a value must be, in words."""
        return f"{super().expected} (m{self.unit} at the command)"

    def given(self, value: Any) -> Any:
        """A keyword's value as argparse gives it."""
        return round(1e3 * value, 9)

    def of(self, given: Any) -> Any:
        """The keyword's value, of what argparse gives."""
        return super().of(given) / 1e3


@dataclass(frozen=True)
class Names(AnyWord):
    """Several words behind one option.

    `count`: how many; 0: one or more.
    """

    python: str = "sequence of str"
    count: int = 0

    @property
    def argparse(self) -> dict[str, Any]:
        """What `add_argument` is told of it."""
        return {"metavar": self.metavar, "nargs": self.count or "+"}

    def of(self, given: Any) -> tuple[str, ...]:
        """The keyword's value, of what argparse gives."""
        return tuple(given)


@dataclass(frozen=True)
class NumberPair(AnyWord):
    """Two numbers that are not negative, the lower first."""

    @property
    def argparse(self) -> dict[str, Any]:
        """What `add_argument` is told of it."""
        return {"nargs": 2, "type": float, "metavar": ("LOW", "HIGH")}

    @property
    def typed(self) -> str:
        """The keyword's type, as a docstring names it."""
        return f"(low, high) ({self.unit})"

    @property
    def expected(self) -> str:
        """What a value must be, in words."""
        return f"two numbers that rise, {self.unit}"

    def holds(self, value: Any) -> bool:
        """Whether a keyword may have this value."""
        one = Number(low=0)
        pair = len(value) == 2 if isinstance(value, Sized) else False
        return pair and all(map(one.holds, value)) and bool(value[0] < value[1])

    def of(self, given: Any) -> tuple[float, ...]:
        """The keyword's value, of what argparse gives."""
        return tuple(given)


@dataclass(frozen=True)
class Option:
    """One option: of a command, and a keyword of a Python function.

    `name`: the keyword.
    `kind`: what it may be.
    `help`: what it is, as the command's help says it; ``{default}`` stands for the default.
    `default`: of the keyword.
    `flag`: the command's option, where it is not the keyword with dashes.
    `many`: whether it may be repeated; the keyword takes a sequence.
    `made`: makes the keyword's value of the word, or of the list of words.
    `doc`: what the keyword is, where `help` speaks of the command alone.
    `required`: whether a call must give it; it has no default then.
    `group`: the title under which the command's help lists it.
    """

    name: str
    kind: AnyWord
    help: str
    default: Any = None
    flag: str = ""
    many: bool = False
    made: Callable[[Any], Any] | None = None
    doc: str = ""
    required: bool = False
    group: str = ""

    @property
    def command(self) -> str:
        """The command's option, such as ``--cutoff-hz``."""
        return self.flag or f"--{self.name.replace('_', '-')}"

    @property
    def dest(self) -> str:
        """Where argparse keeps it."""
        return self.command.removeprefix("--").replace("-", "_")

    @property
    def shown(self) -> str:
        """The default in words; "" where there is none."""
        if self.many or self.default is None or isinstance(self.default, bool):
            return ""
        given = self.kind.given(self.default)
        return f"{given:g}" if isinstance(given, float) else str(given)

    @property
    def said(self) -> str:
        """What it is, with its default."""
        return self.help.format(default=self.shown)

    def add(self, parser: argparse._ActionsContainer) -> None:
        """Add it to a command; words that become numbers only later have a word as default."""
        more: dict[str, Any] = {"help": self.said.replace("%", "%%")}
        if self.many:
            more |= {"action": "append", "default": [] if self.default == () else None}
        elif self.shown:
            given = self.kind.given(self.default)
            more |= {"default": self.shown if self.made or self.kind.nothing else given}
        more |= {"required": True} if self.required else {}
        parser.add_argument(self.command, **self.kind.argparse, **more)

    def value(self, given: Any) -> Any:
        """The keyword's value, of what argparse gives.

        Raises InputError: it is out of bounds.
        """
        if given is None or given == []:
            return self.default
        if self.made is not None:
            return self.made(given)
        if self.many:
            return given
        value = self.kind.of(given)
        words = " ".join(map(str, given)) if isinstance(given, list) else given
        self._check(value, f"{self.command} {words}", self.kind.nothing)
        return value

    def check(self, value: Any) -> None:
        """Refuse a keyword's value that is out of bounds.

        Raises InputError: it is.
        """
        if not self.many and self.made is None:
            self._check(value, f"{self.name} {value!r}", "None" if self.kind.nothing else "")

    def _check(self, value: Any, shown: str, nothing: str) -> None:
        if value is not None and not self.kind.holds(value):
            expected = f"{self.kind.expected}{f', or {nothing}' if nothing else ''}"
            raise InputError(shown, expected=expected)

    def docs(self) -> Iterator[str]:
        """Its lines in a docstring's section of parameters."""
        missing = self.default is None and not self.kind.nothing and not self.required
        yield f"{self.name} : {self.kind.typed}{', optional' if missing else ''}"
        text = self.doc or self.said
        text, indent = f"{text[:1].upper()}{text[1:]}.", " " * 4
        yield from textwrap.wrap(text, 96, initial_indent=indent, subsequent_indent=indent)


#: Of every verb that looks at the data first and can be told to go on.
DESPITE: Final = Option(
    "despite",
    AnyWord("CHECK", "str or collection of str"),
    "go on although this check of `inspect` says STOP, such as 'force sign'; results are marked; "
    "may be repeated",
    (),
    many=True,
    doc="names of checks of `inspect` whose STOP is overruled; the notes say so",
)

#: Of every verb that takes recordings of markers.
LONGEST_GAP: Final = Option(
    "longest_gap_s",
    Number(unit="s", low=0),
    "longest loss of a marker to bridge (default: 0.2)",
    doc="only with markers: longest loss of a marker to bridge (default: 0.2)",
)


@dataclass(frozen=True)
class Verb:
    """A verb: its name and its options in the order of the command's help."""

    name: str
    options: tuple[Option, ...]

    def configure(self, parser: argparse._ActionsContainer) -> None:
        """Add all options to the command, each under its title."""
        titles = dict.fromkeys(option.group for option in self.options)
        under = {title: parser.add_argument_group(title) if title else parser for title in titles}
        for option in self.options:
            option.add(under[option.group])

    def keywords(self, arguments: argparse.Namespace) -> dict[str, Any]:
        """The function's keywords, of a call of the command.

        Raises InputError: an option is out of bounds.
        """
        given = vars(arguments)
        return {option.name: option.value(given[option.dest]) for option in self.options}

    def chosen(self, asked: Any) -> dict[str, Any]:
        """The function's keywords that a page's record of what is asked holds, too."""
        return {
            one.name: getattr(asked, one.name) for one in self.options if hasattr(asked, one.name)
        }

    def differing(self, keywords: Mapping[str, Any]) -> tuple[str, ...]:
        """Options that differ from their defaults: a sentence for a methods section, or none."""
        values = [(one, keywords.get(one.name, one.default)) for one in self.options]
        said = [f"{one.name} {value}" for one, value in values if value not in (one.default, ())]
        return (f"Options of `{self.name}`: {', '.join(said)}",) if said else ()

    def reads(self, arguments: argparse.Namespace) -> list[Path | None]:
        """Files and folders that options name and the function reads."""
        places = [option for option in self.options if isinstance(option.kind, PlaceToRead)]
        return [getattr(arguments, option.dest) for option in places]

    def function(self, function: Callable[P, R]) -> Callable[P, R]:
        """Decorate the Python function: its keywords are checked, its docstring lists them.

        ``{options}`` in the docstring becomes the lines of the options, in the signature's order.
        """
        known = {option.name: option for option in self.options}

        @wraps(function)
        def checked(*args: P.args, **given: P.kwargs) -> R:
            for name in known.keys() & given.keys():
                known[name].check(given[name])
            return function(*args, **given)

        names = [name for name in inspect.signature(function).parameters if name in known]
        lines = [line for name in names for line in known[name].docs()]
        doc = inspect.getdoc(function) or ""
        checked.__doc__ = doc.replace("{options}", "\n".join(lines))
        return checked

    def table(self) -> Iterator[tuple[str, ...]]:
        """The rows of the table of options in the documentation, the heads first."""
        yield ("option", "keyword", "unit", "default", "what it is")
        for one in self.options:
            yield f"``{one.command}``", f"``{one.name}``", one.kind.unit, one.shown, one.said
