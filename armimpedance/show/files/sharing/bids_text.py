"""Texts of BIDS: labels, tables and JSON files, and what every dataset has at its top."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import json_text
from armimpedance.show.files.sharing.form import Shared

VERSION: Final = "1.10.0"
MISSING: Final = "n/a"
_BREAKS: Final = re.compile(r"[\t\r\n\x00]+")
_ROWS: Final = 100_000


def label(text: str, instead: str) -> str:
    """Letters and digits of a text, as a label of BIDS must be."""
    return re.sub(r"[^0-9A-Za-z]", "", text.encode("ascii", "ignore").decode()) or instead


def checked_label(text: str, option: str) -> str:
    """A label that was given.

    Raises
    ------
    InputError
        It holds something else than letters and digits.
    """
    if not re.fullmatch(r"[0-9A-Za-z]+", text):
        raise InputError(f"{option} {text!r:.60}", expected="letters and digits")
    return text


def cell(value: Any) -> str:
    """A cell of a table: numbers so that every bit comes back, n/a where there is none."""
    if value is None:
        return MISSING
    if isinstance(value, str):
        return _BREAKS.sub(" ", value).strip() or MISSING
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, int | np.integer):
        return str(int(value))
    number = float(value)
    return repr(number) if np.isfinite(number) else MISSING


def write_table(file: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a table with a header."""
    lines = ["\t".join(cell(name) for name in columns)]
    lines += ["\t".join(cell(row.get(name)) for name in columns) for row in rows]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_numbers(file: Path, columns: Sequence[FloatArray]) -> None:
    """Write a table of numbers without a header; NaN becomes n/a."""
    options = pyarrow.csv.WriteOptions(
        include_header=False, delimiter="\t", quoting_style="none", batch_size=_ROWS
    )
    names = [str(i) for i in range(len(columns))]
    gaps = [bool(np.isnan(values).any()) for values in columns]
    with file.open("wb") as stream:
        for first in range(0, len(columns[0]), _ROWS):
            part = [
                _with_gaps(values[first : first + _ROWS]) if gap else values[first : first + _ROWS]
                for values, gap in zip(columns, gaps, strict=True)
            ]
            pyarrow.csv.write_csv(pa.table(dict(zip(names, part, strict=True))), stream, options)


def _with_gaps(values: FloatArray) -> pa.Array:
    return pc.fill_null(pa.array(values, from_pandas=True).cast(pa.string()), MISSING)


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write a JSON file."""
    file.write_text(json_text(content), encoding="utf-8")


def text_of(write: Any) -> str:
    """What a function writes to a stream."""
    stream = io.StringIO()
    write(stream)
    return stream.getvalue()


def dataset_name(shared: Shared) -> str:
    """The name that was given, or that of the first file."""
    return shared.statement.name or shared.paths[0].resolve().stem


def write_description(
    folder: Path, shared: Shared, kind: str, sources: Sequence[Mapping[str, str]] = ()
) -> tuple[str, ...]:
    """Write `dataset_description.json`; returns the fields that nobody told.

    Parameters
    ----------
    folder : Path
    shared : Shared
    kind : {"raw", "derivative"}
    sources : sequence of mappings
        The datasets that a derivative was made from.
    """
    said = shared.statement
    made_by = {"Name": "armimpedance", "Version": shared.version}
    content: dict[str, Any] = {
        "Name": dataset_name(shared),
        "BIDSVersion": VERSION,
        "DatasetType": kind,
        "GeneratedBy": [made_by],
    }
    told: dict[str, Any] = {
        "License": said.licence,
        "Authors": list(said.creators),
        "Keywords": list(said.keywords),
        "Funding": list(said.funding),
        "DatasetDOI": said.identifier,
        "SourceDatasets": list(sources),
    }
    content |= {key: value for key, value in told.items() if value}
    write_json(folder / "dataset_description.json", content)
    return tuple(key for key in ("License", "Authors") if key not in content)
