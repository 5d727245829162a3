"""Where the trials of a run begin and end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from armimpedance.core.arrays import BoolArray, FloatArray, IntArray
from armimpedance.recordings.mapped.clocks import OneClock
from armimpedance.recordings.mapped.mapping import TrialCut

#: A step of this many usual ones begins a trial, where the mapping does not say.
USUAL_GAP: Final = 10.0


@dataclass(frozen=True)
class Piece:
    """One trial of a run.

    Attributes
    ----------
    start, stop : int
        Its samples.
    name : float, str or None
        What the file calls it.
    onset, end : int or None
        The last sample before the disturbance and the first after it, where a column marks it.
    """

    start: int
    stop: int
    name: float | str | None = None
    onset: int | None = None
    end: int | None = None


def pieces_of(run: OneClock, cut: TrialCut, rate_hz: float | None) -> tuple[list[Piece], list[str]]:
    """The trials of a run, and sentences on what was left out.

    Raises
    ------
    InputError
        A column is missing or holds what it must not, or there is no trial.
    """
    left_out: list[str] = []
    if cut.by == "column":
        pieces = _by_column(run, cut)
    elif cut.by == "gap":
        pieces = _by_gap(run, cut)
    elif cut.by == "edge":
        pieces, left_out = _by_edge(run, cut, rate_hz)
    else:
        pieces = [Piece(0, run.rows)] if run.rows else []
    if not pieces:
        raise run.error("holds no trial", "samples of at least one", cut.column)
    if cut.disturbance is not None:
        pieces = [_with_disturbance(run, piece, cut) for piece in pieces]
    return pieces, left_out


def _by_column(run: OneClock, cut: TrialCut) -> list[Piece]:
    values = _marks(run, str(cut.column))
    outside = np.isin(values, _as(values, cut.between)) | _missing(values)
    changes = np.flatnonzero((values[1:] != values[:-1]) | (outside[1:] != outside[:-1])) + 1
    edges = [0, *changes.tolist(), run.rows] if run.rows else []
    pieces, seen = [], set()
    for start, stop in zip(edges[:-1], edges[1:], strict=True):
        if outside[start]:
            continue
        name = values[start].item()
        if name in seen:
            expected = "each trial in one piece, or what stands between trials as `between`"
            problem = f"trial {_plain(name)} goes on after others"
            raise run.error(problem, expected, cut.column, start)
        seen.add(name)
        pieces.append(Piece(start, stop, name))
    return pieces


def _by_gap(run: OneClock, cut: TrialCut) -> list[Piece]:
    if run.time_s is None:
        raise run.error("trials by gap without a time", "a column with the time")
    step = np.diff(run.time_s)
    forward = step[step > 0]
    usual = float(np.median(forward)) if len(forward) else 0.0
    longest = USUAL_GAP * usual if cut.gap_s is None else cut.gap_s
    # A missing time belongs to no step; the check of missing values names it.
    starts = np.flatnonzero((step < 0) | (step > longest)) + 1
    edges = [0, *starts.tolist(), run.rows] if run.rows else []
    return [Piece(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True)]


def _by_edge(run: OneClock, cut: TrialCut, rate_hz: float | None) -> tuple[list[Piece], list[str]]:
    onsets = _rises(run, str(cut.column), cut.threshold)
    if run.time_s is None and rate_hz is None:
        raise run.error(
            "trials by edge without a time", "a column with the time, or sample_rate_hz"
        )
    time = np.arange(run.rows) / rate_hz if run.time_s is None else run.time_s  # type: ignore[operator]
    pieces: list[Piece] = []
    cut_off = []
    for number, onset in enumerate(onsets.tolist(), start=1):
        inside = (time >= time[onset] - cut.before_s * (1 + 1e-9) - 1e-9) & (
            time <= time[onset] + cut.after_s * (1 + 1e-9) + 1e-9
        )
        rows = np.flatnonzero(inside)
        if (
            time[onset] - cut.before_s < time[0] - 1e-9
            or time[onset] + cut.after_s > time[-1] + 1e-9
        ):
            cut_off.append(str(number))
            continue
        piece = Piece(int(rows[0]), int(rows[-1]) + 1, float(number), onset)
        if pieces and piece.start < pieces[-1].stop:
            expected = "shorter before_s and after_s: trials must not overlap"
            raise run.error("edges too close to one another", expected, cut.column, onset)
        pieces.append(piece)
    which = f"Trial{'s' * (len(cut_off) > 1)} {', '.join(cut_off)}"
    told = f"{which} of {run.name} reach beyond the record and were left out."
    return pieces, [told] if cut_off else []


def _with_disturbance(run: OneClock, piece: Piece, cut: TrialCut) -> Piece:
    column, threshold = str(cut.disturbance), cut.disturbance_threshold
    over = run.numbers(column)[piece.start : piece.stop] > threshold
    rises = np.flatnonzero(over[1:] & ~over[:-1])
    if over[:1].any() or len(rises) != 1:
        count = "begins within it" if over[:1].any() else f"rises {len(rises)} times"
        problem = f"the disturbance of the trial {count}"
        raise run.error(problem, "one onset a trial", column, piece.start)
    onset = int(rises[0])
    falls = np.flatnonzero(~over[onset + 1 :])
    end = piece.start + onset + 1 + int(falls[0]) if len(falls) else None
    return replace(piece, onset=piece.start + onset, end=end)


def _rises(run: OneClock, column: str, threshold: float) -> IntArray:
    """The last samples before a column rises through a threshold."""
    over = run.numbers(column) > threshold
    return np.flatnonzero(over[1:] & ~over[:-1])


def _marks(run: OneClock, column: str) -> NDArray[Any]:
    """A column of trial numbers or names."""
    if column in run.columns:
        return run.columns[column]
    raise run.error(
        "no such column on the position's clock", ", ".join(list(run.columns)[:12]), column
    )


def _missing(values: NDArray[Any]) -> BoolArray:
    if values.dtype.kind == "U":
        return np.char.strip(values) == ""
    return np.isnan(values)


def _as(values: NDArray[Any], between: tuple[float | str, ...]) -> NDArray[Any]:
    """What stands between trials, in the type of the column."""
    if values.dtype.kind == "U":
        return np.array([_plain(v) for v in between], dtype=np.str_)
    numbers = [float(v) for v in between if not isinstance(v, str)]
    return np.array(numbers, dtype=np.float64)


def _plain(value: object) -> str:
    whole = isinstance(value, float) and value.is_integer()
    return str(int(value)) if whole and isinstance(value, float) else str(value)


def piece_time(run: OneClock, piece: Piece, rate_hz: float | None) -> FloatArray:
    """The time of a trial's samples: as the file has it, or from 0 in steps of the rate."""
    if run.time_s is not None:
        return run.time_s[piece.start : piece.stop]
    if rate_hz is None:
        expected = "a column with the time, or sample_rate_hz in the mapping"
        raise run.error("no time and no rate", expected)
    return np.arange(piece.stop - piece.start) / rate_hz
