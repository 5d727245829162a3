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

    Functions are named as ``module:name``, so that ``--help`` does not import what they need.

    `verb`: its options.
    `progress`: title of the bar.
    `call`: the Python function.
    `out`: what ``--out`` holds, in words.
    `text`: gives what is printed of the result.
    `figure`: what ``--figure`` shows, in words.
    `draw`: draws it.
    `caption`: gives the words below it.
    """

    verb: Verb
    progress: str
    call: str
    out: str
    text: str
    figure: str
    draw: str
    caption: Callable[[Any], str]

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
        with bar(self.progress) as progress:
            result = _named(self.call)(arguments.recording, **keywords, progress=progress)
        write_result(result.content, arguments)
        print(_named(self.text)(result))
        draw_picture(arguments, lambda: _named(self.draw)(result), self.caption(result))
        return 0


def _named(place: str) -> Any:
    """What stands at ``module:name``, imported only now."""
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)
