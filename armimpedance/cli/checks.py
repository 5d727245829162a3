"""What commands refuse before any work, because it could not end well."""

from __future__ import annotations

from pathlib import Path

from armimpedance.errors import InputError


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
