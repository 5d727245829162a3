"""Options of outputs and numbers: checked before any work, so that no result is lost at its end."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.errors import InputError, check_number
from armimpedance.show.files import ENDINGS
from armimpedance.show.verbs.kinds import listed

if TYPE_CHECKING:
    from armimpedance.core.findings import Finding
    from armimpedance.show.files import About, Content

#: Endings of what commands write; the ending decides the format.
TABLE: Final = tuple(f".{name}" for name, one in ENDINGS.items() if one.every_table)
FIT: Final = (".json",)
FIGURE: Final = (".png", ".svg", ".pdf")


class OutputPath(type(Path())):  # type: ignore[misc]
    """The type of an argument that names what a command writes: whoever looks at a parsed call,
    as the check of a study's steps does, knows such a path from one that is read.
    """


@dataclass(frozen=True)
class Output:
    """A file that a command is asked to write.

    `option`: such as ``--out``.
    `path`: None where it was not asked for.
    `endings`: endings of the files that can be written.
    """

    option: str
    path: Path | None
    endings: tuple[str, ...]


def add_out(
    parser: argparse._ActionsContainer,
    what: str,
    endings: tuple[str, ...],
    *,
    required: bool = False,
    long: bool = False,
) -> None:
    """The option ``--out FILE`` for a result; its help names the endings.

    With ``--long``, which `written.write_result` heeds, where the result has a long table.
    """
    parser.add_argument(
        "--out",
        type=OutputPath,
        required=required,
        metavar="FILE",
        help=f"{what}: {listed(endings)}",
    )
    if long:
        parser.add_argument(
            "--long",
            action="store_true",
            help="one row a number in --out: its group, name, value, lower and upper 95 %% limit, "
            "standard error, unit",
        )


def add_figure(parser: argparse._ActionsContainer, what: str) -> None:
    """The option ``--figure FILE`` for a drawing of the result, with those of its look."""
    parser.add_argument(
        "--figure", type=OutputPath, metavar="FILE", help=f"{what}: {listed(FIGURE)}"
    )
    add_look(parser)


def add_look(parser: argparse._ActionsContainer) -> None:
    """The options ``--style`` and ``--caption`` of pictures."""
    parser.add_argument(
        "--style",
        choices=("print", "talk"),
        default="print",
        help="of the picture: letters and lines for a column of print (default) or for a slide",
    )
    parser.add_argument(
        "--caption",
        action="store_true",
        help="write the caption below the picture, not to a .txt beside it",
    )


def add_replace(parser: argparse._ActionsContainer) -> None:
    """The option ``--replace``, without which a folder that is there already stays as it is."""
    parser.add_argument("--replace", action="store_true", help="replace an earlier output")


def check_folder(
    path: Path, known: Iterable[str], *, replace: bool, mark: str = "recording.json"
) -> None:
    """Refuse a folder to be written that is there already, before any work.

    `known`: the names that an earlier output may hold.
    `replace`: whether an earlier output may be replaced; any other folder never is.
    `mark`: the file by which an earlier output is known.
    Raises InputError: a file of that name, a folder that is no earlier output, or one without leave
    to replace it.
    """
    from armimpedance.core.outputs import check_replaceable

    check_replaceable(path, mark, tuple(known))
    if path.exists() and not replace and any(path.iterdir()):
        raise InputError("exists already", file=path, expected="a new folder, or --replace")


def check_outputs(*outputs: Output, reads: Iterable[Path | None] = ()) -> None:
    """Refuse outputs that cannot be written, or that would replace what the command reads.

    `reads`: files and folders that the command reads; None is passed over.
    Raises InputError: an ending that cannot be written, a folder that is not there, a folder for a
    file, an output that is an input or lies in one, or two outputs in one file. It names the path.
    """
    inputs = [path.resolve() for path in reads if path is not None]
    used: dict[Path, str] = {}
    for output in outputs:
        if output.path is None:
            continue
        _check_place(output.path, output.endings)
        place = output.path.resolve()
        if place in used:
            options = f"{used[place]} and to {output.option}"
            raise InputError(f"given to {options}", file=output.path, expected="two files")
        if place in inputs:
            raise InputError(
                f"{output.option} would replace what is read",
                file=output.path,
                expected="another file",
            )
        if any(path in place.parents for path in inputs):
            raise InputError(
                f"{output.option} lies in a folder that is read",
                file=output.path,
                expected="another folder",
            )
        used[place] = output.option
        if output.endings == FIGURE and place.with_suffix(".txt") in inputs:
            raise InputError(
                f"the caption of {output.option} would replace what is read",
                file=output.path.with_suffix(".txt"),
                expected="another file",
            )


def _check_place(path: Path, endings: tuple[str, ...]) -> None:
    from armimpedance.core.outputs import check_file_replaceable

    if path.suffix not in endings:
        what = "not a figure's name" if endings == FIGURE else f"no ending {path.suffix!r} here"
        raise InputError(what, file=path, expected=f"one that ends in {listed(endings)}")
    if not path.absolute().parent.is_dir():
        raise InputError("no such folder", file=path.parent, expected="an existing folder")
    if path.is_dir():
        raise InputError("is a folder", file=path, expected="the name of a file")
    check_file_replaceable(path)


# Numbers given with options, and what is refused of them.


def check_seed(seed: int) -> None:
    """Random numbers want a seed that is not negative."""
    check_number(seed, f"seed {seed}", low=0)


def number(word: str, option: str, expected: str) -> float:
    """A finite positive number given with an option.

    Raises InputError: it is none.
    """
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise InputError(f"{option} {word}", expected=expected)
    return value


# Results as the options ask for them: `--out`, `--long`, and what stands beside the numbers.

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
    """Refuse `--long` without a file in which the long table can stand."""
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

    `arguments`: of the command: its options are said in the formats that have a place for them.
    `checks`: what was held against the recording.
    """
    from armimpedance.show.files import write_content

    if arguments.out is not None:
        about = about_call(arguments, checks)
        write_content(content, arguments.out, long=arguments.long, about=about)


def about_call(arguments: argparse.Namespace, checks: Sequence[Finding] = ()) -> About:
    """Describe the call that makes a file: its command, its options and the checks."""
    from armimpedance.show.files import About

    facts = [("command", arguments.prog)]
    for name, value in vars(arguments).items():
        if name not in _ASIDE and value not in (None, False, (), []):
            facts.append((name.replace("_", " "), _words(value)))
    return About(made=tuple(facts), checks=tuple(checks))


def _words(value: Any) -> str:
    """An option in words; of a path its name, which is the same on every machine."""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_words, value))
    return value.name if isinstance(value, Path) else str(value)
