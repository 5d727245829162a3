"""Permissions of a study's step: commands that it may run, places to write and read.

A design comes with the data, and data come from anybody: a step is checked as it will be parsed, so
that an abbreviated option or ``--out=FILE`` is seen for what it is.
"""

from __future__ import annotations

import re
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Final

from armimpedance.app.study.design import PLACES, StudyDesign, StudyStep
from armimpedance.core.errors import InputError
from armimpedance.show.command.outputs import OutputPath

#: Commands that read recordings or tables, write what they are asked to, and work unattended.
#: A command that serves a page or a stream, starts studies or processes, shows examples, or
#: proposes what a person has to look over is none of them.
STEP_COMMANDS: Final = frozenset(
    {
        *("exam", "convert", "inspect", "trials", "plan"),
        *("estimate", "reflex", "compare", "report"),
        *("map", "fit", "predict", "explore"),
        *("movement", "random", "elbow", "passive", "body", "therapy"),
        *("discriminate", "share"),
    }
)

#: A path may begin with the recording, or with something beside it, or below the design's folder.
_BEGINS: Final = re.compile(r"\{recording\}|\{study\}(?=/|$)")
#: What becomes an absolute path, which no output may hold.
_ABSOLUTE: Final = re.compile(r"\{(recording|study)\}")
#: A label has no slash and may be empty.
_LABEL: Final = re.compile(r"\{(participant|session)\}")


def check_steps(design: StudyDesign, parse: Callable[[list[str]], Namespace]) -> None:
    """Refuse a design that may do anything but compute in its own folders, before any work is done.

    Outputs lie in the folder of the session. Unless whoever runs the study named the design, its
    steps read the recording, files beside the design and what steps wrote, and nothing else.

    Parameters
    ----------
    design : StudyDesign
    parse : function
        Parses the words of a command; raises InputError.

    Raises
    ------
    InputError
        Naming the file and the step.
    """
    for step in (*design.steps, *design.group_steps):
        try:
            _check_step(step, parse, reads_anything=design.named)
        except InputError as error:
            problem = f"the step {str(step)!r}: {error.problem}"
            raise InputError(problem, file=design.file, expected=error.expected) from None


def _check_step(
    step: StudyStep, parse: Callable[[list[str]], Namespace], *, reads_anything: bool
) -> None:
    if step.command not in STEP_COMMANDS:
        expected = f"one of {', '.join(sorted(STEP_COMMANDS))}"
        raise InputError(f"{step.command!r} is no command of a study", expected=expected)
    # The places stand for themselves: no word of a session is known yet.
    called = parse(step.filled({place: f"{{{place}}}" for place in PLACES}))
    for value in _words(vars(called).values()):
        path = str(value)
        if isinstance(value, OutputPath):
            if _ABSOLUTE.search(path) or _leads_out(path):
                expected = "a name in the session's own folder"
                raise InputError(f"would write to {path!r}", expected=expected)
        elif not reads_anything and _is_elsewhere(path):
            expected = "a file beside the design, {study}/..., or the design named with --design"
            raise InputError(f"would read {path!r}", expected=expected)


def _words(values: Iterable[object]) -> Iterator[str | Path]:
    """The texts and paths among parsed values; a text may name a file, as ``--arm`` does."""
    for value in values:
        if isinstance(value, str | Path):
            yield value
        elif isinstance(value, list | tuple):
            yield from _words(value)


def _is_elsewhere(path: str) -> bool:
    """Return True if a path lies outside the recording, the design's and the step's own folder."""
    start = _BEGINS.match(path)
    rest = path[start.end() :].lstrip("/") if start else path
    return _ABSOLUTE.search(rest) is not None or _leads_out(rest)


def _leads_out(path: str) -> bool:
    """Return True if a relative path may leave its folder, whatever its labels stand for."""
    ways = [Path(path), Path(_LABEL.sub("", path))]
    return path.startswith("~") or any(way.anchor or ".." in way.parts for way in ways)
