"""Damage that a format survives: a file that is well-formed, and says what nobody meant.

A table keeps its shape and gets a column of other numbers, a JSON keeps its grammar and gets
another value; such files come past the parsers and reach what computes.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from typing import Any, Final

import numpy as np

Rng = np.random.Generator

NUMBERS: Final = (
    0, 1, -1, 2, 1e-300, -1e-9, 1e9, 1e38, 1e155, 1e300, -1e300, 1.7e308, 5e-324, 10**20,
)  # fmt: skip
TEXTS: Final = (
    "", " ", "nan", "inf", "-inf", "NaN", "1e999", "9" * 401, "a ", "relaxed\u3000", "条件" * 20,
    "$x_{", "\\frac", "=cmd|' /C calc'!A0", "\x1b[31mred", "A" * 250, "alpha_99999999", "true",
    "1,5", "\ud800", "a\nb", "../../x", "<b>&amp;", "\u202eevil", "％d%s{0}", "é" * 200, "-1", "0",
    "1_000", "٣", "\u00a0",
)  # fmt: skip
VALUES: Final = (
    None, True, False, [], {}, [[]], [None], ["a"], [1e300, 1e300], {"a": 1}, 10**400, float("nan"),
    float("inf"), "1", 0.5,
)  # fmt: skip


def other_meaning(data: bytes, rng: Rng) -> bytes | None:
    """The bytes of a file of another meaning, or None for a format that is not known here."""
    change = _change(data)
    if change is None:
        return None
    try:
        return change(data, rng)
    except (ValueError, KeyError, IndexError, RecursionError, OSError):
        return None


def _change(data: bytes) -> Callable[[bytes, Rng], bytes] | None:
    if data[:4] == b"PAR1":
        return _parquet
    if data[:1] in (b"{", b"["):
        return _json
    head = data[:4096]
    if b"\x00" not in head and b"," in head.split(b"\n", 1)[0]:
        return _csv
    return None


def column_of_numbers(values: np.ndarray, rng: Rng) -> np.ndarray:
    """A column whose numbers are others, as of a dead, a loose or a wrongly scaled sensor."""
    values = np.array(values, dtype=float)
    number = float(NUMBERS[int(rng.integers(len(NUMBERS)))])
    size = len(values)
    first = int(rng.integers(size)) if size else 0
    with np.errstate(all="ignore"):
        changes: tuple[Callable[[], np.ndarray], ...] = (
            lambda: np.full(size, number),
            lambda: values * number,
            lambda: values + number,
            lambda: values[::-1],
            lambda: rng.permutation(values),
            lambda: np.round(values, int(rng.integers(-2, 4))),
            lambda: np.where(np.arange(size) >= first, np.nan, values),
            lambda: np.where(np.arange(size) == first, number, values),
            lambda: np.where(np.arange(size) == first, (np.nan, np.inf)[size % 2], values),
            lambda: np.abs(values),
            lambda: values * 10.0 ** rng.integers(-12, 13),
            lambda: np.sort(values),
        )  # fmt: skip
        return changes[int(rng.integers(len(changes)))]()


def _csv(data: bytes, rng: Rng) -> bytes:
    """A table with a column, a row, a cell or a name that is another."""
    rows = list(csv.reader(io.StringIO(data.decode("utf-8"))))
    width = len(rows[0])
    column = int(rng.integers(width))
    how = rng.random()
    if how < 0.4:
        _csv_column(rows, column, rng)
    elif how < 0.6:
        rows[int(rng.integers(1, len(rows)))][column] = _text(rng)
    elif how < 0.75:
        _csv_row(rows, rng)
    else:
        _csv_header(rows, column, rng)
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(rows)
    return stream.getvalue().encode("utf-8", "surrogatepass")


def _csv_column(rows: list[list[str]], column: int, rng: Rng) -> None:
    cells = [row[column] for row in rows[1:]]
    try:
        numbers = column_of_numbers(np.array([float(c or "nan") for c in cells]), rng)
        changed = [repr(float(n)) for n in numbers]
        if all(float(c).is_integer() for c in cells if c) and np.all(np.abs(numbers) < 1e15):
            changed = [str(int(n)) for n in numbers]
    except (ValueError, OverflowError):
        changed = [_text(rng)] * len(cells) if rng.random() < 0.5 else cells[::-1]
    for row, cell in zip(rows[1:], changed, strict=True):
        row[column] = cell


def _csv_row(rows: list[list[str]], rng: Rng) -> None:
    place = int(rng.integers(1, len(rows)))
    how = int(rng.integers(4))
    if how == 0:
        del rows[place]
    elif how == 1:
        rows.insert(place, list(rows[place]))
    elif how == 2:
        del rows[place:]
    else:
        rows[1:] = [rows[i] for i in rng.permutation(np.arange(1, len(rows)))]


def _csv_header(rows: list[list[str]], column: int, rng: Rng) -> None:
    how = int(rng.integers(4))
    other = int(rng.integers(len(rows[0])))
    if how == 0:
        for row in rows:
            del row[column]
    elif how == 1:
        rows[0][column], rows[0][other] = rows[0][other], rows[0][column]
    elif how == 2:
        rows[0][column] = _text(rng)
    else:
        for row in rows:
            row.append(row[column])


def _json(data: bytes, rng: Rng) -> bytes:
    """A JSON with one value that is another, or a key that is missing, doubled or misnamed."""
    held = json.loads(data)
    places = list(_places(held))
    for _ in range(int(rng.integers(1, 3))):
        home, key = places[int(rng.integers(len(places)))]
        _change_value(home, key, rng)
    # A sealed model that was changed is refused at once; one of an earlier version is read.
    if isinstance(held, dict) and rng.random() < 0.9:
        held.pop("model_sha256", None)
    text = json.dumps(held)
    if isinstance(held, dict) and held and rng.random() < 0.05:
        key = list(held)[int(rng.integers(len(held)))]
        text = text[:-1] + f", {json.dumps(key)}: {json.dumps(held[key])}}}"
    return text.encode("ascii")


def _places(held: Any) -> Any:
    """Every container with each of its keys; of long lists of numbers the first few."""
    if isinstance(held, dict):
        items = list(held.items())
    else:
        items = list(enumerate(held))
        if items and not isinstance(items[0][1], dict | list):
            items = items[:4]
    for key, value in items:
        yield held, key
        if isinstance(value, dict | list):
            yield from _places(value)


def _change_value(home: Any, key: Any, rng: Rng) -> None:
    try:
        value = home[key]
    except (KeyError, IndexError):
        return
    how = rng.random()
    if how < 0.1:
        del home[key]
    elif how < 0.15 and isinstance(home, dict):
        home[_text(rng)] = home.pop(key)
    elif how < 0.3 and isinstance(value, list) and value:
        home[key] = value[: int(rng.integers(len(value) + 1))] * int(rng.integers(1, 3))
    elif how < 0.55 and isinstance(value, int | float):
        home[key] = _times(value, NUMBERS[int(rng.integers(len(NUMBERS)))])
    elif how < 0.8 and isinstance(value, str):
        home[key] = _text(rng)
    elif how < 0.9:
        home[key] = NUMBERS[int(rng.integers(len(NUMBERS)))]
    else:
        home[key] = VALUES[int(rng.integers(len(VALUES)))]


def _times(value: int | float, factor: int | float) -> int | float:
    """The product; of a whole number that no float holds, the number itself."""
    try:
        return value * factor
    except OverflowError:
        return value


def _parquet(data: bytes, rng: Rng) -> bytes:
    """A Parquet table with a column of other numbers, another name or type, or fewer rows."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pq.read_table(io.BytesIO(data), use_threads=False)
    place = int(rng.integers(table.num_columns))
    name, column = table.column_names[place], table.column(place)
    how = rng.random()
    if how < 0.7 and pa.types.is_floating(column.type):
        values = column_of_numbers(column.to_numpy(), rng)
        table = table.set_column(place, name, pa.array(values, column.type))
    elif how < 0.75:
        table = table.set_column(place, _text(rng).encode("utf-8", "replace").decode(), column)
    elif how < 0.8:
        table = table.drop_columns([name])
    elif how < 0.9:
        first, last = sorted(rng.integers(table.num_rows + 1, size=2))
        table = table.slice(int(first), int(last - first))
    else:
        table = table.set_column(place, name, column.cast(pa.string()))
    stream = io.BytesIO()
    pq.write_table(table, stream)
    return stream.getvalue()


def _text(rng: Rng) -> str:
    return TEXTS[int(rng.integers(len(TEXTS)))]
