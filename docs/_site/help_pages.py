"""A page for each command: its help, as its parser prints it."""

from __future__ import annotations

import argparse
import importlib
import json
from collections.abc import Iterator

from command_runs import KEPT
from rst import code, directive, title, toctree

from armimpedance.app.cli.main import COMMANDS, GROUPS, PLACES, make_parser
from armimpedance.show.verbs.options import Verb

#: Above the examples.
WHOSE = "On simulated people, when this site was built.\n"


def command_pages() -> dict[str, str]:
    """Name of a page -> its text."""
    pages = {f"reference/commands/{name}": _page(name) for name in COMMANDS}
    text = [
        title("Commands"),
        "``armimpedance COMMAND --help`` prints what stands on these pages.\n",
    ]
    for heading, names in GROUPS.items():
        lines = ((name, COMMANDS[name].replace("%%", "%")) for name in names)
        rows = "\n".join(f"* - :doc:`{name}`\n  - {line}" for name, line in lines)
        text += [title(heading, "-"), directive("list-table", "", rows, widths="20 80")]
    text += [toctree(COMMANDS, hidden="")]
    pages["reference/commands/index"] = "\n".join(text)
    return pages


def runs() -> dict[str, list[dict[str, str]]]:
    """Command -> calls that were run for these pages, with what they printed."""
    return json.loads(KEPT.read_text()) if KEPT.exists() else {}


def parsers_of(name: str) -> Iterator[argparse.ArgumentParser]:
    """The parser of a command and those of its subcommands."""
    yield from _with_children(_children(make_parser([name]))[name])


def _with_children(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    yield parser
    for child in _children(parser).values():
        yield from _with_children(child)


def _children(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    actions = parser._actions
    found = [a.choices for a in actions if isinstance(a, argparse._SubParsersAction)]
    return dict(found[0]) if found else {}


def _page(name: str) -> str:
    first, *others = parsers_of(name)
    text = [title(first.prog), _help(first)]
    verbs = verbs_of(name)
    text += [title("Options and keywords", "-")] * bool(verbs) + list(map(_options, verbs))
    if calls := runs().get(name):
        text += [title("An example that was run", "-"), WHOSE]
        text += [code(f"$ {run['call']}\n{run['printed']}") for run in calls]
    for parser in others:
        text += [title(parser.prog, "-"), _help(parser)]
    return "\n".join(text)


def verbs_of(name: str) -> list[Verb]:
    """What the modules of a command and its steps say of its options, where they say it once."""
    module = importlib.import_module(PLACES[name])
    steps = [
        importlib.import_module(f"{PLACES[name]}.{step}") for step in vars(module).get("STEPS", ())
    ]
    return [
        one for each in (module, *steps) for one in vars(each).values() if isinstance(one, Verb)
    ]


def _options(verb: Verb) -> str:
    head, *rows = verb.table()
    lines = ["\n  - ".join(("* - " + cells[0], *cells[1:])) for cells in (head, *rows)]
    table = directive("list-table", "", "\n".join(lines), header_rows="1", widths="20 20 10 10 40")
    return f"In Python they are keywords of ``{verb.name}``.\n\n{table}"


def _help(parser: argparse.ArgumentParser) -> str:
    return code(parser.format_help())
