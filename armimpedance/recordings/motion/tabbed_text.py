"""Tables of numbers in text, as biomechanics writes them: tabs, blanks or commas, short rows."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError


def text_lines(file: Path) -> list[str]:
    """The lines of a text file.

    Raises
    ------
    InputError
        It is missing, empty or no text.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError("is not UTF-8 text", file=file, expected="a table") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    if not text.strip():
        raise InputError("is empty", file=file, expected="a header and rows of numbers")
    return text.splitlines()


def cells(line: str, separator: str | None = None) -> list[str]:
    """The cells of a line, without blanks around them.

    Parameters
    ----------
    line : str
    separator : str or None
        None: tabs if there is one, else commas if there is one, else blanks.
    """
    mark = separator or ("\t" if "\t" in line.strip() else "," if "," in line else None)
    return [cell.strip() for cell in line.strip(" \r\n").split(mark)]


def number_rows(
    lines: list[str], first: int, columns: int, file: Path, *, gaps: bool = False
) -> FloatArray:
    """Rows of numbers (rows, columns); blank lines are passed over.

    Parameters
    ----------
    lines : list of str
    first : int
        The line (from 0) with the first row.
    columns : int
    file : Path
        For messages.
    gaps : bool
        Empty cells and cells that a row lacks at its end are NaN.

    Raises
    ------
    InputError
        A row of another length, or a cell that is no finite number.
    """
    rows = []
    for number, line in enumerate(lines[first:], start=first + 1):
        if not line.strip():
            continue
        parts = cells(line)
        while len(parts) > columns and not parts[-1]:
            parts.pop()
        while parts and len(parts) > columns and not parts[0]:
            parts.pop(0)
        if gaps:
            parts += [""] * (columns - len(parts))
        if len(parts) != columns:
            expected = f"{columns}, as in the header"
            raise InputError(f"{len(parts)} cells", file=file, row=number, expected=expected)
        rows.append([_number(part, file, number, gaps) for part in parts])
    if not rows:
        raise InputError("holds no rows", file=file, expected="one row per sample")
    return np.array(rows)


def _number(cell: str, file: Path, row: int, gaps: bool) -> float:
    if gaps and cell.lower() in ("", "nan"):
        return math.nan
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "_" in cell:
        problem = f"not a finite number: {cell[:40]!r}"
        raise InputError(problem, file=file, row=row, expected="a number")
    return value


def sample_rate(time_s: FloatArray, file: Path, stated_hz: float | None = None) -> float:
    """The rate of equally spaced times.

    Raises
    ------
    InputError
        Times do not rise in equal steps, or not with the stated rate.
    """
    if len(time_s) < 2:
        raise InputError(f"{len(time_s)} samples", file=file, expected="two or more")
    step = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    rate = stated_hz or (1.0 / step if step > 0 else math.nan)
    # times are often printed with few decimals
    wrong = np.flatnonzero(~(np.abs(np.diff(time_s) * rate - 1.0) < 0.5))
    if len(wrong) or abs(step * rate - 1.0) > 0.01:
        at = float(time_s[wrong[0]]) if len(wrong) else float(time_s[0])
        problem = f"time does not rise in steps of {1.0 / rate:.6g} s after {at:.6g} s"
        raise InputError(problem, file=file, column="time", expected="equal steps")
    # a rate that was meant to be whole
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 * rate / len(time_s) else rate
