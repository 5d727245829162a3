"""A command of one verb: what it reads, its outputs and options, and the steps of its run."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from armimpedance.show.command.outputs import (
    FIGURE,
    TABLE,
    Output,
    add_figure,
    add_out,
    check_long,
    check_outputs,
    write_result,
)
from armimpedance.show.verbs.options import Verb


@dataclass(frozen=True)
class Command:
    """The command of a verb that reads one recording and gives one result.

    Functions are named as ``module:name``, so that ``--help`` does not import what they need, or
    stand in the module of the command and import it themselves.

    `verb`: its options.
    `progress`: title of the bar; ``{recording}`` stands for the recording's name.
    `call`: the Python function.
    `out`: what ``--out`` holds, in words.
    `text`: gives what is printed of the result.
    `figure`: what ``--figure`` shows, in words.
    `draw`: draws it.
    `caption`: the words below it, or what gives them.
    `rows`: counts the rows of ``--out``, where the screen says how many were written.
    """

    verb: Verb
    progress: str
    call: str
    text: str | Callable[[Any], str]
    draw: str | Callable[[Any], Any]
    caption: str | Callable[[Any], str]
    out: str = "the result"
    figure: str = "draw the result"
    rows: Callable[[Any], int] | None = None

    def configure(self, parser: argparse.ArgumentParser) -> None:
        """Arguments of the command."""
        from armimpedance.show.command.options import add_choice

        parser.add_argument("recording", metavar="RECORDING", type=Path)
        add_out(parser, self.out, TABLE, long=True)
        add_figure(parser, self.figure)
        self.verb.configure(parser)
        add_choice(parser, "recording")

    def run(self, arguments: argparse.Namespace) -> int:
        """Check outputs and options; read, check and compute; write, print and draw."""
        from armimpedance.show.command.options import draw_picture
        from armimpedance.show.command.screen import bar

        check_outputs(
            Output("--out", arguments.out, TABLE),
            Output("--figure", arguments.figure, FIGURE),
            reads=[arguments.recording, *self.verb.reads(arguments)],
        )
        check_long(arguments)
        keywords = self.verb.keywords(arguments)
        with bar(self.progress.format(recording=arguments.recording.name)) as progress:
            result = _named(self.call)(arguments.recording, **keywords, progress=progress)
        write_result(result.content, arguments)
        print(_named(self.text)(result))
        if self.rows is not None and arguments.out is not None:
            print(f"\n{self.rows(result)} rows written to {arguments.out}")
        caption = self.caption if isinstance(self.caption, str) else self.caption(result)
        draw_picture(arguments, lambda: _named(self.draw)(result), caption)
        return 0


def _named(place: str | Callable[[Any], Any]) -> Any:
    """Import the function at ``module:name``; a function is returned as it is."""
    if callable(place):
        return place
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
