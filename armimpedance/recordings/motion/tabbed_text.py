"""Tables of numbers in text, as biomechanics writes them: tabs, blanks or commas, short rows."""

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

#: A larger table in text is taken for something else; three times as much memory is needed.
_LARGEST_BYTES: Final = 250_000_000
#: How programs write a number that is none.
_NONE: Final = frozenset(
    ("", "nan", "-nan", "+nan", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind")
)
#: What stands around cells, and alone in rows that a spreadsheet left empty.
_BLANK: Final = ' \t\r\n,;"'


@dataclass(frozen=True)
class TextFile:
    """A table's file in lines.

    `lines`: without their ends.
    `whole`: whether the last line has its end; where it has none the file may have been cut.
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
        """Whether nothing but blank lines follows."""
        return not any(line.strip(_BLANK) for line in self.lines[index + 1 :])


@dataclass(frozen=True)
class NumberRows:
    """Rows of numbers and the lines of the file (from 1) that they stand in.

    `values` (rows, columns), `numbers` (rows,) int.
    `further`: the most cells beyond the columns that a row has.
    """

    values: FloatArray
    numbers: IntArray
    further: int = 0


def text_file(file: Path) -> TextFile:
    """Read a text file with the line ends of any system.

    It is UTF-8, UTF-16 with its mark, or else Windows-1252, which a remark then says.

    Raises InputError: it is missing, empty, too large or no text.
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
        # names of folders with accents, written by programs of another age
        text = data.decode("cp1252", errors="replace")
        remarks = ("Not UTF-8: read as Windows-1252.",)
    if "\0" in text:
        raise InputError("is no text", file=file, expected="a table")
    return text, remarks


def cells(line: str) -> list[str]:
    """The cells of a line, without blanks and quotation marks around them.

    They are separated by tabs if there is one, else by commas if there is one, else by blanks.
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
    """Rows of numbers (rows, columns); blank lines are passed over.

    `first`: the line (from 0) with the first row.
    `parts`: numbers in each cell, with commas between them; the first cell, the time, has one.
    `gaps`: empty cells and cells that a row lacks at its end are NaN, as "nan" always is.
    `further`: whether cells beyond the columns may be passed over.
    Raises InputError: a row of another length, a cell that is no number, or the file was cut within
    a row.
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
    """The rows all at once, several times faster; None where a cell is not plainly a number."""
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
    """The cells of a row, those of several numbers taken apart."""
    if parts > 1:
        time, *rest = line.split()
        taken = [cell.split(",") for cell in rest]
        if any(len(cell) != parts for cell in taken):
            return line.split()
        return [time, *(number for cell in taken for number in cell)]
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
    """Append a row of numbers; cell by cell where one is not plainly a number."""
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
    """A sentence where the header states another number of rows or columns than there are.

    `stated`: the number as it stands in the header.
    `what`: such as "rows".
    Raises InputError: rows are missing and the last line has no end: the file was cut.
    """
    if stated is None or stated.strip() == str(have):
        return ()
    shown = stated.strip()[:20]
    known = shown.isascii() and shown.isdigit()
    if known and int(shown) > have and what == "rows" and not text.whole:
        problem = f"{have} of {shown} rows, the last without a line end: the file was cut"
        expected = f"the whole file, or {have} in its header and an end to the last line"
        raise InputError(problem, file=text.file, expected=expected)
    missing = known and int(shown) > have
    return (f"Its header states {shown} {what}, it holds {have}{': cut or edited' * missing}.",)


# Times of a table in text: rising, each once, in equal steps.


def times(rows: NumberRows, column: int, file: Path) -> tuple[FloatArray, NumberRows, int]:
    """The times of rows, those rows, and how many were left out because they stand there twice.

    `column`: where the time stands.
    `file`: for messages.
    Raises InputError: a row has no time, time goes back, or it stands still though the rows differ.
    """
    time = rows.values[:, column]
    if not np.isfinite(time).all():
        at = int(rows.numbers[np.flatnonzero(~np.isfinite(time))[0]])
        raise InputError("a row without a time", file=file, row=at, expected="a number")
    # the columns before the time number the frames, and count on where a row is repeated
    now, before = rows.values[1:, column:], rows.values[:-1, column:]
    same = (now == before) | (np.isnan(now) & np.isnan(before))
    twice = np.concatenate([[False], same.all(axis=1)])
    step = np.diff(time[~twice])
    if (step <= 0).any():
        i = int(np.flatnonzero(step <= 0)[0]) + 1
        at = int(rows.numbers[~twice][i])
        how = "stands still at" if step[i - 1] == 0 else "goes back to"
        problem = f"time does not rise: it {how} {time[~twice][i]:.9g} s"
        raise InputError(problem, file=file, row=at, expected="each time once, rising")
    kept = NumberRows(rows.values[~twice], rows.numbers[~twice], rows.further)
    return kept.values[:, column], kept, int(twice.sum())


def sample_rate(time_s: FloatArray, file: Path, stated_hz: float | None = None) -> float:
    """The rate of equally spaced times.

    Raises InputError: times do not rise in equal steps, or not with the stated rate.
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


#: Interpolation may miss this part of a column's range.
_MISSED: Final = 1e-3
#: No step may be so many times the usual one.
_LONGEST_STEP: Final = 20.0
#: Half as many samples are missed by so much more, for the error of a cubic spline goes by step^4.
_HALF_AS_MANY: Final = 16.0


def in_even_steps(
    time_s: FloatArray, columns: dict[str, FloatArray], file: Path
) -> tuple[FloatArray, dict[str, FloatArray], float, tuple[str, ...]]:
    """Times, columns and their rate; uneven steps of smooth columns are interpolated.

    So integrators write their results: small steps where much happens. The other half of the
    samples says how far cubic splines through every second one are off.
    Returns: a sentence where something was interpolated.
    Raises InputError: steps are uneven and the columns too rough, or a step is far too long.
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
    even = time_s[0] + np.arange(int((time_s[-1] - time_s[0]) * rate) + 1) / rate
    made = {name: np.interp(even, time_s, column) for name, column in columns.items()}
    made |= dict(zip(full, CubicSpline(time_s, values)(even).T, strict=True))
    told = (
        f"Steps of {1e3 * step.min():.3g} to {1e3 * step.max():.3g} ms: interpolated by cubic "
        f"splines to {rate:g} Hz, off by some {100 * missed:.1g} % of a column's range at most; "
        "derivatives lose more."
    )
    return even, {name: made[name] for name in columns}, rate, (told,)


def _is_uneven(time_s: FloatArray) -> bool:
    """Whether steps differ throughout; an even clock with a gap has lost samples instead."""
    if len(time_s) < _FEWEST_UNEVEN:
        return False
    step = np.diff(time_s)
    usual = float(np.median(step))
    alike = float(np.mean(np.abs(step - usual) < 0.01 * usual))
    # a usual step far below the mean would make many more samples than there are
    return alike < _ALIKE and step.max() < _LONGEST_STEP * usual and step.mean() < 4.0 * usual


def _missed(time_s: FloatArray, values: FloatArray) -> float:
    """How far splines are off at most, a part of the range of the column."""
    spline = CubicSpline(time_s[::2], values[::2])
    inside = slice(1, len(time_s) - 1 - len(time_s) % 2, 2)
    off = np.abs(spline(time_s[inside]) - values[inside]).max(axis=0) / _HALF_AS_MANY
    span = np.ptp(values, axis=0)
    return float((off[span > 0] / span[span > 0]).max(initial=0.0))


#: Fewer samples tell nothing of how smooth they are; more steps alike are those of an even clock.
_FEWEST_UNEVEN: Final = 20
_ALIKE: Final = 0.8
#: A faster rate is made a whole number.
_WHOLE_HZ: Final = 10.0
