"""Formats of result files: which ending is which. Standard library only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from armimpedance.core.method_table import MethodTable
from armimpedance.show.files.content import Content


@dataclass(frozen=True)
class Ending:
    """One format of result files; its ending is the name of its file in `endings`.

    `what`: what such a file is, for help texts.
    `write` function (content, path): writes the whole file. The path is a temporary one, beside the
    final one and with its ending; it is renamed when the function returns.
    `every_table`: whether any table of results can be written so. A command that offers an ending
    of few results names it beside the others.
    `long`: whether the long table may stand in place of the wide one.
    `about`: whether it has a place for methods, checks and options.
    `most_rows`: rows beyond which a table is refused: all of them are held in memory at once. inf
    where they are written one after another, or where the format says its own limit.
    """

    what: str
    write: Callable[[Content, Path], None]
    every_table: bool = True
    long: bool = False
    about: bool = False
    most_rows: float = 400_000


#: ``csv`` -> how a .csv is written.
ENDINGS: Final[MethodTable[Ending]] = MethodTable(
    "armimpedance.show.files.endings", "ENDING", "ending", default="csv"
)
