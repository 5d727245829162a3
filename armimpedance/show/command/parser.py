"""The parser whose errors are one line, and its subcommands. Standard library only."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import NoReturn

from armimpedance.core.errors import LONGEST_MESSAGE, shortened, shown
from armimpedance.show.command.failures import WRONG_INPUT


class OneLineParser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line on stderr and exit 2."""
        hint = f" (see {self.prog} --help)"
        line = shortened(shown(message), LONGEST_MESSAGE - len(hint))
        self.exit(WRONG_INPUT, f"{self.prog}: {line}{hint}\n")


def add_commands(
    parser: argparse.ArgumentParser,
    lines: Mapping[str, str],
    places: str | Mapping[str, str],
    metavar: str,
    argv: Sequence[str] | None = None,
) -> None:
    """Add a subcommand for each line.

    `lines`: name of a subcommand -> its line in the overview.
    `places`: the package whose modules bear these names, or name -> module. Each module has
    `configure`, `run` and a docstring, which is the subcommand's help.
    `metavar`: name of the subcommands in the help.
    `argv`: the words of the call; modules that it does not ask for are not imported.
    """
    plain = argparse.RawDescriptionHelpFormatter
    commands = add_parsers(parser, metavar)
    chosen = next((word for word in argv or () if word in lines), None)
    for name, line in lines.items():
        if argv is not None and name != chosen:
            commands.add_parser(name, help=line)
            continue
        own = f"{places}.{name.replace('-', '_')}"
        module = import_module(own if isinstance(places, str) else places[name])
        sub = commands.add_parser(
            name, help=line, description=module.__doc__, formatter_class=plain
        )
        if hasattr(module, "run"):
            sub.set_defaults(run=module.run, prog=sub.prog)
        module.configure(sub)


def add_parsers(
    parser: argparse.ArgumentParser, metavar: str
) -> argparse._SubParsersAction[OneLineParser]:
    """Where the subcommands of a parser are added, whose errors are one line."""
    return parser.add_subparsers(
        dest=metavar.lower(), metavar=metavar, required=True, parser_class=OneLineParser
    )
