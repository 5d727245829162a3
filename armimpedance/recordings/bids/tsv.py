"""Tables of BIDS (tab-separated, `n/a` for a missing value) and the names of its files."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.csv

from armimpedance.core.arrays import FloatArray
from armimpedance.core.delimited import TSV, number_of, read_text_table
from armimpedance.core.errors import InputError

#: Limit for tables of descriptions (channels, participants, events), which are small.
_LARGEST_HEADED_BYTES: Final = 20_000_000
#: Limit for an unpacked table, bytes.
_LARGEST_UNPACKED_BYTES: Final = 300_000_000
_MISSING: Final = ("n/a", "N/A", "NaN", "nan", "NAN", "")


def is_missing(cell: str) -> bool:
    """Return True if a cell marks a missing value."""
    return cell.strip() in _MISSING


def headed_rows(file: Path, required: Sequence[str] = ()) -> list[dict[str, str]]:
    """Read the rows of a table with a header, as texts.

    `required`: columns that the table must have.
    Raises InputError: it cannot be read, a required column is missing, a name appears twice, or a
    row has another number of cells.
    """
    if file.is_file() and file.stat().st_size > _LARGEST_HEADED_BYTES:
        raise InputError("is too large for such a table", file=file, expected="below 20 MB")
    table = read_text_table(file, TSV, "a table of BIDS")
    for name in required:
        if name not in table.header:
            raise InputError("no such column", file=file, row=1, column=name, expected="it")
    return [{name: cell.strip() for name, cell in row.items()} for row in table.dicts()]


def numbers(file: Path, names: Sequence[str], wanted: Sequence[int]) -> FloatArray:
    """Read columns of a table of numbers without a header; NaN for missing values.

    `file`: `.tsv`, or `.tsv.gz`.
    `names`: all its columns; a first row that repeats them is skipped.
    `wanted`: indices of the columns to read.
    Returns: (N, len(wanted)) array.
    Raises InputError: it cannot be read or is empty, a row has another number of cells, or a cell
    is not a number.
    """
    content = _unpacked(file) if file.suffix == ".gz" else None
    first = _first_line(file, content)
    if not first.strip():
        raise InputError("is empty", file=file, expected="one row a sample")
    cells = [cell.strip() for cell in first.rstrip("\r\n").split("\t")]
    if len(cells) != len(names):
        problem = f"{len(cells)} columns (tabs between them)"
        expected = f"{len(names)}, one a channel"
        raise InputError(problem, file=file, row=1, expected=expected)
    skip = 1 if cells == list(names) and any(not _is_number(cell) for cell in cells) else 0
    table = _table(file, content, len(names), wanted, skip)
    columns = [np.asarray(column.to_numpy(zero_copy_only=False)) for column in table.columns]
    values = np.column_stack([column.astype(np.float64) for column in columns])
    if np.isinf(values).any():
        raise _bad_cell(file, content, len(names), wanted, skip, "not finite")
    return values


def _first_line(file: Path, content: bytes | None) -> str:
    try:
        with io.BytesIO(content) if content is not None else file.open("rb") as stream:
            return stream.readline(1_000_000).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, row=1, expected="numbers") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None


def _table(
    file: Path, content: bytes | None, columns: int, wanted: Sequence[int], skip: int
) -> pa.Table:
    names = [str(i) for i in range(columns)]
    chosen = [str(i) for i in wanted]
    try:
        return pa.csv.read_csv(
            io.BytesIO(content) if content is not None else file,
            read_options=pa.csv.ReadOptions(column_names=names, skip_rows=skip),
            parse_options=pa.csv.ParseOptions(delimiter="\t", quote_char=False),
            convert_options=pa.csv.ConvertOptions(
                include_columns=chosen,
                column_types={name: pa.float64() for name in chosen},
                null_values=list(_MISSING),
            ),
        )
    except (pa.ArrowException, OSError, ValueError) as error:
        reason = str(error).splitlines()[0][:100] if str(error) else "not readable"
        raise _bad_cell(file, content, columns, wanted, skip, reason) from None


def _bad_cell(
    file: Path, content: bytes | None, columns: int, wanted: Sequence[int], skip: int, reason: str
) -> InputError:
    """Return an error that names the first wrong cell."""
    with io.BytesIO(content) if content is not None else file.open("rb") as stream:
        for number, line in enumerate(stream, start=1):
            cells = line.decode("utf-8", errors="replace").rstrip("\r\n").split("\t")
            if number <= skip or cells == [""]:
                continue
            if len(cells) != columns:
                expected = f"{columns}, one a channel"
                return InputError(f"{len(cells)} cells", file=file, row=number, expected=expected)
            for index in wanted:
                if not (_is_number(cells[index]) or is_missing(cells[index])):
                    problem = f"not a finite number: {cells[index][:40]!r}"
                    expected = "a number, or n/a"
                    location = {"file": file, "row": number, "column": str(index + 1)}
                    return InputError(problem, expected=expected, **location)  # type: ignore[arg-type]
    return InputError(reason, file=file, expected="a table of numbers")


def _is_number(cell: str) -> bool:
    value = number_of(cell)
    return value is not None and bool(np.isfinite(value))


def _unpacked(file: Path) -> bytes:
    try:
        with gzip.open(file) as stream:
            content = stream.read(_LARGEST_UNPACKED_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"cannot be unpacked: {error}", file=file, expected=".gz") from None
    if len(content) > _LARGEST_UNPACKED_BYTES:
        limit = _LARGEST_UNPACKED_BYTES // 1_000_000
        raise InputError(f"unpacks to more than {limit} MB", file=file, expected="less")
    return content


# Names of files in BIDS: entities such as `sub-01`, a suffix such as `motion`, an ending.

#: Entities that name the recording system, not the recorded task.
OF_THE_SYSTEM: Final = ("tracksys", "recording", "space", "desc")


@dataclass(frozen=True)
class BidsName:
    """A file and the parts of its name.

    `entities`: such as ``{"sub": "01", "task": "reach"}``, in the name's order.
    `suffix`: such as "motion".
    `ending`: such as ".tsv.gz".
    """

    path: Path
    suffix: str
    ending: str
    entities: Mapping[str, str] = field(default_factory=dict)

    def describes(self, data: BidsName, but: Collection[str] = ()) -> bool:
        """Return True if this file describes `data`: all its entities are the same there.

        `but`: entities that are not compared.
        """
        compared = {key: value for key, value in self.entities.items() if key not in but}
        return all(data.entities.get(key) == value for key, value in compared.items())


def parsed(path: Path) -> BidsName | None:
    """Split the name of a file into its parts; None if it is not a BIDS name."""
    stem, dot, ending = path.name.partition(".")
    *parts, suffix = stem.split("_")
    entities = {}
    for part in parts:
        key, dash, value = part.partition("-")
        if not (key and dash and value) or key in entities:
            return None
        entities[key] = value
    return BidsName(path, suffix, dot + ending, entities) if suffix and dot else None
