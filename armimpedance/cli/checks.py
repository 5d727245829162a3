"""What commands refuse before any work, and how errors name the recording that they are about."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from armimpedance.errors import EstimationError, InputError, NotIdentifiableError


def check_outputs(*, figure: Path | None, out: Path | None) -> None:
    """A figure has a format that can be written, and all outputs have a folder.

    Raises
    ------
    InputError
        Naming the path.
    """
    if figure is not None and figure.suffix not in (".png", ".svg", ".pdf"):
        raise InputError(
            "a figure's name", file=figure, expected="one that ends in .png, .svg or .pdf"
        )
    for path in (figure, out):
        if path is not None and not path.absolute().parent.is_dir():
            raise InputError("no such folder", file=path.parent, expected="an existing folder")


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
