"""The options of a verb, each described once.

From one `Option` follow the option of the command and its help, the check of the Python function's
keyword, the keyword's lines in the function's docstring, and the row in the table of options in the
documentation. Standard library only, because ``--help`` loads nothing else.
"""

from __future__ import annotations

import argparse
import inspect
import textwrap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar

from armimpedance.core.errors import InputError
from armimpedance.show.verbs.kinds import AnyWord, Number, PlaceToRead

P = ParamSpec("P")
R = TypeVar("R")


def _is_given(value: Any) -> bool:
    """Return True if a call set an option of this value; 0 counts as set."""
    return value is not None and value is not False and value != []


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
        """The help text with its default."""
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

    def words(self, given: Any) -> Iterator[str]:
        """The words of a call that gave it; of a file its name alone."""
        unsaid = None if self.default is None else self.kind.given(self.default)
        if not _is_given(given) or given == unsaid:
            return
        for one in given if self.many else [given]:
            yield self.command
            parts = [] if one is True else one if isinstance(one, list) else [one]
            yield from (part.name if isinstance(part, Path) else str(part) for part in parts)

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

#: Of every verb whose trials may be chosen by hand.
LEAVE_OUT: Final = Option(
    "leave_out",
    PlaceToRead("FILE.csv", "path"),
    "leave out the trials of this list, as `trials` saves it",
    doc="a list of trials that are left out, as ``armimpedance trials`` saves it",
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

    def configure_beside(self, parser: argparse._ActionsContainer, *others: Verb) -> None:
        """Add the options to a command that has those of other verbs already.

        The command does not state their defaults, so that `refuse` knows which were given.
        """
        commands = {option.command for other in others for option in other.options}
        own = tuple(option for option in self.options if option.command not in commands)
        Verb(self.name, own).configure(parser)
        stated = [option.dest for option in own if option.shown]
        parser.set_defaults(**dict.fromkeys(stated))

    def keywords(self, arguments: argparse.Namespace) -> dict[str, Any]:
        """The function's keywords, of a call of the command.

        Raises InputError: an option is out of bounds.
        """
        given = vars(arguments)
        return {option.name: option.value(given[option.dest]) for option in self.options}

    def refuse(self, arguments: argparse.Namespace, asked: Verb, expected: str) -> None:
        """Refuse options of this verb that have no meaning in the one that is asked for.

        Raises InputError: one of them was given; `expected` says where it belongs.
        """
        allowed = {option.command for option in asked.options}
        for option in self.options:
            given = vars(arguments)[option.dest]
            if option.command not in allowed and _is_given(given):
                raise InputError(option.command, expected=expected)

    def words(self, arguments: argparse.Namespace) -> list[str]:
        """The words of a call of the command: what differs from the defaults."""
        given = vars(arguments)
        return [word for one in self.options for word in one.words(given[one.dest])]

    def chosen(self, asked: Any) -> dict[str, Any]:
        """The function's keywords that a page's record of what is asked holds, too."""
        return {
            one.name: getattr(asked, one.name) for one in self.options if hasattr(asked, one.name)
        }

    def differing(self, keywords: Mapping[str, Any]) -> tuple[str, ...]:
        """Options that differ from their defaults: a sentence for a methods section, or none."""
        values = [(one, keywords.get(one.name, one.default)) for one in self.options]
        words = [f"{one.name} {value}" for one, value in values if value not in (one.default, ())]
        return (f"Options of `{self.name}`: {', '.join(words)}",) if words else ()

    def reads(self, arguments: argparse.Namespace) -> list[Path | None]:
        """Files and folders that options name and the function reads."""
        places = [option for option in self.options if isinstance(option.kind, PlaceToRead)]
        return [getattr(arguments, option.dest) for option in places]

    def function(self, function: Callable[P, R]) -> Callable[P, R]:
        """Decorate the Python function: its keywords are checked, its docstring lists them.

        ``{options}`` in the docstring becomes the lines of the options, in the signature's order.
        """
        by_name = {option.name: option for option in self.options}

        @wraps(function)
        def checked(*args: P.args, **given: P.kwargs) -> R:
            from armimpedance.core.workers import one_thread

            for name in by_name.keys() & given.keys():
                by_name[name].check(given[name])
            with one_thread():
                return function(*args, **given)

        names = [name for name in inspect.signature(function).parameters if name in by_name]
        lines = [line for name in names for line in by_name[name].docs()]
        doc = inspect.getdoc(function) or ""
        checked.__doc__ = doc.replace("{options}", "\n".join(lines))
        return checked

    def table(self) -> Iterator[tuple[str, ...]]:
        """The rows of the table of options in the documentation, the heads first."""
        yield ("option", "keyword", "unit", "default", "what it is")
        for one in self.options:
            yield f"``{one.command}``", f"``{one.name}``", one.kind.units, one.shown, one.said
