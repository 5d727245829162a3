"""Signals in EDF and BDF files: their header checked against the file, then read by edfio."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.extras import needed

_FIXED_BYTES: Final = 256
_MOST_SIGNALS: Final = 8192
_ROUNDING: Final = 1e-12
#: Bytes that a sample takes.
_WIDTH: Final = {".edf": 2, ".bdf": 3}


@dataclass(frozen=True)
class EdfFile:
    """The signals of a file, not read yet.

    Attributes
    ----------
    labels, units : tuple of str
        As the file has them.
    rates_hz : tuple of float
    lengths : tuple of int
        Samples of each signal.
    read : callable
        Values (N,) of the signal of an index, in its unit.
    """

    labels: tuple[str, ...]
    units: tuple[str, ...]
    rates_hz: tuple[float, ...]
    lengths: tuple[int, ...]
    read: Callable[[int], FloatArray]


def open_edf(file: Path) -> EdfFile:
    """Open a file whose name ends in .edf or .bdf.

    Raises
    ------
    InputError
        It is no such file, is shorter than its header says, or its records do not follow one
        another without gaps.
    """
    _check_sizes(file)
    edfio = needed("edfio", "bids", file)
    reader = edfio.read_bdf if file.suffix.lower() == ".bdf" else edfio.read_edf
    edf = _guarded(lambda: reader(file, header_encoding="latin-1"), file)
    signals = _guarded(lambda: list(edf.signals), file)

    def read(index: int) -> FloatArray:
        values = _guarded(lambda: np.asarray(signals[index].data, dtype=np.float64), file)
        if not np.isfinite(values).all():
            label = str(signals[index].label)
            raise InputError("not finite", file=file, column=label, expected="a range of values")
        return values

    described = _guarded(lambda: [_described(s, edf.num_data_records) for s in signals], file)
    labels, units, rates, lengths = zip(*described, strict=True) if described else ((),) * 4
    return EdfFile(labels, units, rates, lengths, read)


def _described(signal: Any, records: int) -> tuple[str, str, float, int]:
    rate = float(signal.sampling_frequency)
    if not (np.isfinite(rate) and rate > 0):
        raise ValueError(f"a rate of {rate} Hz")
    # 700 samples in the file's 1.4 s are 500 Hz, and not the double beside it
    whole = round(rate)
    rate = float(whole) if abs(rate - whole) <= _ROUNDING * rate else rate
    length = int(signal.samples_per_data_record) * int(records)
    return str(signal.label), str(signal.physical_dimension).strip(), rate, length


def _guarded(call: Callable[[], Any], file: Path) -> Any:
    """What a call of edfio gives; whatever goes wrong in it is wrong with the file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return call()
        except InputError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:120] or type(error).__name__
            raise InputError(f"cannot be read: {reason}", file=file, expected="EDF") from None


def _check_sizes(file: Path) -> None:
    """Compare the counts of a header with the file before anything is read by them."""
    width = _WIDTH.get(file.suffix.lower())
    if width is None:
        raise InputError("is neither .edf nor .bdf", file=file)
    try:
        with file.open("rb") as stream:
            fixed = stream.read(_FIXED_BYTES)
            signals = _count(fixed[252:256], "the number of signals", file)
            if not 0 < signals <= _MOST_SIGNALS:
                raise InputError(f"{signals} signals", file=file, expected="from 1 on")
            own = stream.read(signals * _FIXED_BYTES)
        size = file.stat().st_size
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    header = _FIXED_BYTES * (signals + 1)
    if len(own) < signals * _FIXED_BYTES or _count(fixed[184:192], "the header", file) != header:
        raise InputError("a broken header", file=file, expected=f"{header} bytes of header")
    if fixed[192:197] in (b"EDF+D", b"BDF+D"):
        expected = "records without gaps (EDF+C)"
        raise InputError("records with gaps between them", file=file, expected=expected)
    counts = [own[216 * signals + 8 * i :][:8] for i in range(signals)]
    record = sum(_count(text, "samples in a record", file) for text in counts) * width
    records = _count(fixed[236:244], "the number of records", file)
    if records < 0 or record <= 0 or header + records * record > size:
        problem = f"{records} records of {record} bytes in a file of {size}"
        raise InputError(problem, file=file, expected="a whole file")


def _count(text: bytes, what: str, file: Path) -> int:
    try:
        return int(text.decode("ascii").strip())
    except ValueError:
        raise InputError(f"{what} is {text!r}", file=file, expected="a whole number") from None


def same_rates(rates: Sequence[float], lengths: Sequence[int]) -> list[list[int]]:
    """The indices of the signals, grouped by rate and length: one clock a group."""
    groups: dict[tuple[float, int], list[int]] = {}
    for index, key in enumerate(zip(rates, lengths, strict=True)):
        groups.setdefault(key, []).append(index)
    return list(groups.values())
