"""Results as the options ask for them: `--out`, `--long`, and what stands beside the numbers."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.errors import InputError

if TYPE_CHECKING:
    from armimpedance.core.findings import Finding
    from armimpedance.show.files import About, Content

#: Endings of files in which the long table can stand.
LONG: Final = (".csv", ".json", ".parquet")
#: Endings of files that have a place for checks and methods.
WITH_CHECKS: Final = (".xlsx", ".mat")
#: Options that do not change a number.
_ASIDE: Final = (
    *("run", "prog", "command", "out", "figure", "style", "caption", "long", "format", "samples"),
    *("workers", "live", "out_profile", "therapy"),
)


def check_long(arguments: argparse.Namespace) -> None:
    """Refuse `--long` without a file in which the long table can stand.

    Raises
    ------
    InputError
    """
    if not arguments.long:
        return
    if arguments.out is None:
        raise InputError("--long without --out", expected="a file to write")
    if arguments.out.suffix not in LONG:
        holds = "; its sheet intervals is that table" if arguments.out.suffix == ".xlsx" else ""
        raise InputError(
            f"--long has no effect on a {arguments.out.suffix}{holds}",
            file=arguments.out,
            expected=f"one that ends in {', '.join(LONG[:-1])} or {LONG[-1]}",
        )


def write_result(
    content: Content, arguments: argparse.Namespace, checks: Sequence[Finding] = ()
) -> None:
    """Write a result to `--out`, if it was asked for.

    Parameters
    ----------
    content : Content
    arguments : Namespace
        Of the command: its options are said in the formats that have a place for them.
    checks : sequence of Finding
        What was held against the recording.
    """
    from armimpedance.show.files import write_content

    if arguments.out is not None:
        about = about_call(arguments, checks)
        write_content(content, arguments.out, long=arguments.long, about=about)


def about_call(arguments: argparse.Namespace, checks: Sequence[Finding] = ()) -> About:
    """What a file says of the call that made it.

    Parameters
    ----------
    arguments : Namespace
    checks : sequence of Finding

    Returns
    -------
    About
    """
    from armimpedance.show.files import About

    said = [("command", arguments.prog)]
    for name, value in vars(arguments).items():
        if name not in _ASIDE and value not in (None, False, (), []):
            said.append((name.replace("_", " "), _words(value)))
    return About(made=tuple(said), checks=tuple(checks))


def _words(value: Any) -> str:
    """An option in words; of a path its name, which is the same on every machine."""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_words, value))
    return value.name if isinstance(value, Path) else str(value)
