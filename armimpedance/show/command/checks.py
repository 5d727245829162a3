"""What commands refuse before any work, and how errors name the recording that they are about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from armimpedance.core.errors import EstimationError, InputError, NotIdentifiableError


def check_outputs(*, figure: Path | None, out: Path | None) -> None:
    """A figure has a format that can be written, and all outputs have a folder.

    Raises
    ------
    InputError
        Naming the path.
    """
    if figure is not None and figure.suffix not in (".png", ".svg", ".pdf"):
        raise InputError(
            "not a figure's name", file=figure, expected="one that ends in .png, .svg or .pdf"
        )
    for path in (figure, out):
        if path is not None and not path.absolute().parent.is_dir():
            raise InputError("no such folder", file=path.parent, expected="an existing folder")
        if path is not None and path.is_dir():
            raise InputError("is a folder", file=path, expected="the name of a file")


def refuse_same_file(read: Mapping[str, Path | None], **written: Path | None) -> None:
    """What is written must replace neither what is read nor another output.

    Parameters
    ----------
    read, written : option (without its dashes) -> path

    Raises
    ------
    InputError
        Naming the file and both options.
    """
    seen = {path.absolute(): name for name, path in read.items() if path is not None}
    for name, path in written.items():
        if path is None:
            continue
        if path.absolute() in seen:
            options = f"--{seen[path.absolute()]} and to --{name}"
            raise InputError(f"given to {options}", file=path, expected="two files")
        seen[path.absolute()] = name


def check_seed(seed: int) -> None:
    """Random numbers want a seed that is not negative."""
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the recording's name before what is wrong with it, where no file is named yet."""
    try:
        yield
    except NotIdentifiableError as error:
        raise NotIdentifiableError(f"{path}: {error}", error.parameters) from error
    except EstimationError as error:
        raise EstimationError(f"{path}: {error}") from error
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(
            error.problem, file=path, row=error.row, column=error.column, expected=error.expected
        ) from error


def number(word: str, option: str, expected: str) -> float:
    """A finite positive number given with an option.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        value = float(word)
    except ValueError:
        value = float("nan")
    if not 0 < value < float("inf"):
        raise InputError(f"{option} {word}", expected=expected)
    return value
