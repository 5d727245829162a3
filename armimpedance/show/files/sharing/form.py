"""Data to be shared, their owner's statement, and the forms. Standard library only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from armimpedance.core.method_table import MethodTable


@dataclass(frozen=True)
class Statement:
    """Metadata that only the owner of the data can state; whatever is missing stays empty.

    `name`, `description`, `licence`, `identifier`, `url`: `licence` as an SPDX name or an address,
    `identifier` such as a DOI.
    """

    name: str | None = None
    description: str | None = None
    creators: tuple[str, ...] = ()
    licence: str | None = None
    identifier: str | None = None
    url: str | None = None
    keywords: tuple[str, ...] = ()
    funding: tuple[str, ...] = ()


@dataclass(frozen=True)
class ResultTable:
    """A table of results as its file has it.

    `rows`: column -> the text of the cell; empty where there is no value.
    """

    path: Path
    columns: tuple[str, ...]
    rows: tuple[Mapping[str, str], ...]


@dataclass(frozen=True)
class Shared:
    """Recordings and results to be shared.

    `recordings` sequence of (Path, recording).
    `person`, `task`: labels for BIDS; None: made from the recording and its name.
    `version`: of the toolkit.
    """

    recordings: Sequence[tuple[Path, Any]] = ()
    results: Sequence[ResultTable] = ()
    statement: Statement = field(default_factory=Statement)
    person: str | None = None
    task: str | None = None
    version: str = ""

    @property
    def paths(self) -> list[Path]:
        """Where all of it was read."""
        return [*(path for path, _ in self.recordings), *(table.path for table in self.results)]


@dataclass(frozen=True)
class Form:
    """A form in which data are shared.

    `what`: for help texts.
    `write`: writes to a folder that is there and empty, or to a file; returns sentences on what was
    left out or is not known.
    `endings`: of the file; empty: a folder is written.
    `takes`: of "recording" and "results".
    """

    what: str
    write: Callable[[Shared, Path], tuple[str, ...]]
    endings: tuple[str, ...] = ()
    takes: tuple[str, ...] = ("recording", "results")

    def share(
        self,
        recordings: Sequence[tuple[Path, Any]],
        tables: Sequence[Path],
        out: Path,
        *,
        said: Mapping[str, Any],
        person: str | None = None,
        task: str | None = None,
        version: str = "",
    ) -> tuple[str, ...]:
        """Write recordings and tables of results in this form.

        `recordings` sequence of (Path, recording): with the paths that they were read from.
        `tables`: RESULTS.csv.
        `out`: an empty folder, or a file.
        `said`: fields of `Statement`.
        `person`, `task`, `version`: see `Shared`.
        Returns: what was left out or is not known.
        Raises InputError: a table cannot be read, or what is given has no place in this form.
        """
        results = [result_table(path) for path in tables]
        return self.write(
            Shared(recordings, results, Statement(**said), person, task, version), out
        )


def result_table(path: Path) -> ResultTable:
    """A table of results, its cells as they are."""
    from armimpedance.show.files.table_row import table_rows

    rows = table_rows(path)
    columns = tuple(name for name in rows[0].cells if name)
    return ResultTable(path, columns, tuple(row.cells for row in rows))


#: One file in the folder is one form.
FORMS: Final[MethodTable[Form]] = MethodTable(
    "armimpedance.show.files.sharing.forms", "FORM", "form", joint="-"
)
