"""Numeric tables in text files of biomechanics: tabs, blanks or commas, short rows."""

from __future__ import annotations

import math
from array import array
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.delimited import number_of
from armimpedance.core.errors import InputError
from armimpedance.core.inputs import check_regular

#: Larger files are refused; reading takes three times as much memory.
_LARGEST_BYTES: Final = 250_000_000
#: Programs' ways to write a missing number.
_NONE: Final = frozenset(
    ("", "nan", "-nan", "+nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind")
)
#: Characters around cells, and the only ones in rows that a spreadsheet left empty.
_BLANK: Final = ' \t\r\n,;"'


@dataclass(frozen=True)
class TextFile:
    """The lines of a table's file.

    `lines`: without line ends.
    `whole`: True if the last line has a line end; without one the file may have been cut.
    `remarks`: sentences for the provenance.
    """

    file: Path
    lines: list[str]
    whole: bool
    remarks: tuple[str, ...] = ()

    def line(self, index: int) -> str:
        """A line (from 0); empty beyond the last."""
        return self.lines[index] if index < len(self.lines) else ""

    def is_last(self, index: int) -> bool:
        """True if only blank lines follow."""
        return not any(line.strip(_BLANK) for line in self.lines[index + 1 :])


@dataclass(frozen=True)
class NumberRows:
    """Rows of numbers and their line numbers in the file (from 1).

    `values` (rows, columns), `numbers` (rows,) int.
    `further`: the largest number of extra cells in a row.
    """

    values: FloatArray
    numbers: IntArray
    further: int = 0


def text_file(file: Path) -> TextFile:
    """Read a text file with the line ends of any system.

    It is UTF-8, UTF-16 with its mark, or else Windows-1252, with a remark.

    Raises InputError: it is missing, empty, too large or not text.
    """
    check_regular(file, _LARGEST_BYTES, "a table in text")
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    text, remarks = _decoded(data, file)
    if not text.strip():
        raise InputError("is empty", file=file, expected="a header and rows of numbers")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    return TextFile(file, text.split("\n"), text.endswith("\n"), remarks)


def _decoded(data: bytes, file: Path) -> tuple[str, tuple[str, ...]]:
    utf_16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if utf_16 else "utf-8-sig")
        remarks: tuple[str, ...] = ()
    except UnicodeDecodeError:
        # names of folders with accents, written by old programs
        text = data.decode("cp1252", errors="replace")
        remarks = ("Not UTF-8: read as Windows-1252.",)
    if "\0" in text:
        raise InputError("is no text", file=file, expected="a table")
    return text, remarks


def cells(line: str) -> list[str]:
    """The cells of a line, without surrounding blanks and quotation marks.

    They are separated by tabs if the line has any, else by commas, else by blanks.
    """
    mark = "\t" if "\t" in line.strip() else "," if "," in line else None
    return [cell.strip().strip('"').strip() for cell in line.strip(" \r\n").split(mark)]


def number_rows(
    text: TextFile,
    first: int,
    columns: int,
    *,
    parts: int = 1,
    gaps: bool = False,
    further: bool = False,
) -> NumberRows:
    """Read rows of numbers (rows, columns); blank lines are skipped.

    `first`: the line (from 0) with the first row.
    `parts`: numbers in each cell, with commas between them; the first cell, the time, has one.
    `gaps`: empty cells and missing cells at the end of a row become NaN, as "nan" always does.
    `further`: True: extra cells beyond the columns are ignored.
    Raises InputError: a row of another length, a cell that is not a number, or a file cut within a
    row.
    """
    plain = _plain_rows(text, first, columns) if parts == 1 else None
    if plain is not None:
        return plain
    buffer, numbers, most = array("d"), array("q"), 0
    for number, line in enumerate(text.lines[first:], start=first + 1):
        if not line.strip(_BLANK):
            continue
        row = _row_cells(line, columns, parts)
        if len(row) < columns and not text.whole and text.is_last(number - 1):
            problem = f"ends within row {number}: the file was cut"
            raise InputError(problem, file=text.file, expected="the whole file")
        if gaps:
            row += [""] * (columns - len(row))
        if further and len(row) > columns:
            most = max(most, len(row) - columns)
            row = row[:columns]
        if len(row) != columns:
            expected = f"{columns}, as in the header"
            raise InputError(f"{len(row)} cells", file=text.file, row=number, expected=expected)
        _extend(buffer, row, text.file, number, "_" in line, gaps)
        numbers.append(number)
    if not numbers:
        raise InputError("holds no rows", file=text.file, expected="one row per sample")
    values = np.array(buffer).reshape(-1, columns)
    return NumberRows(values, np.array(numbers, np.int64), most)


def _plain_rows(text: TextFile, first: int, columns: int) -> NumberRows | None:
    """Read all rows at once, several times faster; None if a cell is not a plain number."""
    numbers = [i for i, line in enumerate(text.lines[first:], first + 1) if line.strip(_BLANK)]
    if not numbers or "\t" not in text.lines[numbers[0] - 1].strip():
        return None
    lines = (text.lines[number - 1] for number in numbers)
    try:
        values = np.loadtxt(lines, delimiter="\t", comments=None, ndmin=2)
    except (ValueError, IndexError, OverflowError):
        return None
    if values.shape != (len(numbers), columns) or not np.isfinite(values).all():
        return None
    return NumberRows(values, np.array(numbers, np.int64))


def _row_cells(line: str, columns: int, parts: int) -> list[str]:
    """The cells of a row; cells of several numbers are split."""
    if parts > 1:
        time, *rest = line.split()
        split = [cell.split(",") for cell in rest]
        if any(len(cell) != parts for cell in split):
            return line.split()
        return [time, *(number for cell in split for number in cell)]
    row = cells(line)
    # some programs end a row with a tab, some begin it with one
    while len(row) > columns and not row[-1]:
        row.pop()
    while len(row) > columns and not row[0]:
        row.pop(0)
    if len(row) != columns and "," not in line and len(line.split()) == columns:
        return line.split()
    return row


def _extend(
    buffer: array[float], row: list[str], file: Path, number: int, odd: bool, gaps: bool
) -> None:
    """Append a row of numbers; cell by cell if one is not a plain number."""
    try:
        values = [float(cell) for cell in row]
        plain = not odd and math.isfinite(math.fsum(values))
    except (ValueError, OverflowError):
        plain = False
    if not plain:
        values = [_number(cell, file, number, gaps) for cell in row]
    buffer.extend(values)


def _number(cell: str, file: Path, row: int, gaps: bool) -> float:
    if cell.lower() in _NONE and (cell or gaps):
        return math.nan
    value = number_of(cell)
    if value is None or not math.isfinite(value):
        problem = f"not a finite number: {cell[:40]!r}"
        raise InputError(problem, file=file, row=row, expected="a number, with a decimal point")
    return value


def stated_count(stated: str | None, have: int, what: str, text: TextFile) -> tuple[str, ...]:
    """A sentence if the header states a wrong number of rows or columns.

    `stated`: the number as written in the header.
    `what`: such as "rows".
    Raises InputError: rows are missing and the last line has no end: the file was cut.
    """
    if stated is None or stated.strip() == str(have):
        return ()
    shown = stated.strip()[:20]
    is_number = shown.isascii() and shown.isdigit()
    if is_number and int(shown) > have and what == "rows" and not text.whole:
        problem = f"{have} of {shown} rows, the last without a line end: the file was cut"
        expected = f"the whole file, or {have} in its header and an end to the last line"
        raise InputError(problem, file=text.file, expected=expected)
    missing = is_number and int(shown) > have
    return (f"Its header states {shown} {what}, it holds {have}{': cut or edited' * missing}.",)


# The times of a table: increasing, each once, in equal steps.


def times(rows: NumberRows, column: int, file: Path) -> tuple[FloatArray, NumberRows, int]:
    """The times of rows, these rows, and the number of repeated rows that were left out.

    `column`: the index of the time's column.
    `file`: for messages.
    Raises InputError: a row has no time, or time decreases or repeats in different rows.
    """
    time = rows.values[:, column]
    if not np.isfinite(time).all():
        at = int(rows.numbers[np.flatnonzero(~np.isfinite(time))[0]])
        raise InputError("a row without a time", file=file, row=at, expected="a number")
    # columns before the time number the frames and keep counting where a row is repeated
    now, before = rows.values[1:, column:], rows.values[:-1, column:]
    same = (now == before) | (np.isnan(now) & np.isnan(before))
    twice = np.concatenate([[False], same.all(axis=1)])
    step = np.diff(time[~twice])
    if (step <= 0).any():
        i = int(np.flatnonzero(step <= 0)[0]) + 1
        at = int(rows.numbers[~twice][i])
        change = "stands still at" if step[i - 1] == 0 else "goes back to"
        problem = f"time does not rise: it {change} {time[~twice][i]:.9g} s"
        raise InputError(problem, file=file, row=at, expected="each time once, rising")
    kept = NumberRows(rows.values[~twice], rows.numbers[~twice], rows.further)
    return kept.values[:, column], kept, int(twice.sum())


def sample_rate(time_s: FloatArray, file: Path, stated_hz: float | None = None) -> float:
    """The sample rate of equally spaced times.

    Raises InputError: times do not increase in equal steps, or not with the stated rate.
    """
    if len(time_s) < 2:
        raise InputError(f"{len(time_s)} samples", file=file, expected="two or more")
    step = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    rate = stated_hz or (1.0 / step if step > 0 else math.nan)
    # times are often printed with few decimals
    wrong = np.flatnonzero(~(np.abs(np.diff(time_s) * rate - 1.0) < 0.5))
    if stated_hz and abs(step * rate - 1.0) > 0.01 and len(wrong) in (0, len(time_s) - 1):
        problem = f"time does not rise in steps of {1.0 / rate:.6g} s (1 / DataRate) but {step:.6g}"
        expected = "a rate and times that agree"
        raise InputError(problem, file=file, column="time", expected=expected)
    if len(wrong) or abs(step * rate - 1.0) > 0.01:
        at = float(time_s[wrong[0]]) if len(wrong) else float(time_s[0])
        problem = f"time does not rise in steps of {1.0 / rate:.6g} s after {at:.6g} s"
        expected = "equal steps; resample it first"
        raise InputError(problem, file=file, column="time", expected=expected)
    # a rate that was meant to be whole
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 * rate / len(time_s) else rate


#: The largest interpolation error relative to a column's range.
_MISSED: Final = 1e-3
#: The longest step relative to the usual one.
_LONGEST_STEP: Final = 20.0
#: The ratio of errors with half the samples: a cubic spline's error is proportional to step^4.
_HALF_AS_MANY: Final = 16.0


def in_even_steps(
    time_s: FloatArray, columns: dict[str, FloatArray], file: Path
) -> tuple[FloatArray, dict[str, FloatArray], float, tuple[str, ...]]:
    """Bring smooth columns with uneven steps to an even rate by interpolation.

    Integrators write uneven steps: small ones during fast changes. The error is estimated by cubic
    splines through every second sample, compared with the other samples.
    Returns: times, columns, rate, and a sentence if something was interpolated.
    Raises InputError: steps are uneven and the columns too rough, or a step is too long.
    """
    try:
        return time_s, columns, sample_rate(time_s, file), ()
    except InputError:
        full = {name: values for name, values in columns.items() if np.isfinite(values).all()}
        if not full or not _is_uneven(time_s):
            raise
        values = np.column_stack([*full.values()])
        missed = _missed(time_s, values)
        if missed > _MISSED:
            raise
    step = np.diff(time_s)
    rate = 1.0 / float(np.median(step))
    rate = float(round(rate)) if rate > _WHOLE_HZ else rate
    even_time = time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * rate) + 1) / rate
    interpolated = {name: np.interp(even_time, time_s, column) for name, column in columns.items()}
    interpolated |= dict(zip(full, CubicSpline(time_s, values)(even_time).T, strict=True))
    remark = (
        f"Steps of {1e3 * step.min():.3g} to {1e3 * step.max():.3g} ms: interpolated by cubic "
        f"splines to {rate:g} Hz, off by some {100 * missed:.1g} % of a column's range at most; "
        "derivatives lose more."
    )
    return even_time, {name: interpolated[name] for name in columns}, rate, (remark,)


def _is_uneven(time_s: FloatArray) -> bool:
    """True if steps differ throughout; an even clock with a gap has lost samples instead."""
    if len(time_s) < _FEWEST_UNEVEN:
        return False
    step = np.diff(time_s)
    usual = float(np.median(step))
    equal_share = float(np.mean(np.abs(step - usual) < 0.01 * usual))
    # a usual step far below the mean would create far more samples than there are
    return equal_share < _ALIKE and step.max() < _LONGEST_STEP * usual and step.mean() < 4.0 * usual


def _missed(time_s: FloatArray, values: FloatArray) -> float:
    """The largest error of splines relative to the range of the column."""
    spline = CubicSpline(time_s[::2], values[::2])
    inside = slice(1, len(time_s) - 1 - len(time_s) % 2, 2)
    off = np.abs(spline(time_s[inside]) - values[inside]).max(axis=0) / _HALF_AS_MANY
    span = np.ptp(values, axis=0)
    return float((off[span > 0] / span[span > 0]).max(initial=0.0))


#: The fewest samples for judging smoothness, and the largest part of equal steps if uneven.
_FEWEST_UNEVEN: Final = 20
_ALIKE: Final = 0.8
#: A faster rate is rounded to an integer.
_WHOLE_HZ: Final = 10.0
