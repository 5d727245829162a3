"""The tables of a study: cells.csv, changes.csv, sessions.parquet, and a short one to print."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.outputs import staged_file
from armimpedance.lab.simulate_study.blocks import Blocks, Cell
from armimpedance.lab.simulate_study.config import Config
from armimpedance.lab.simulate_study.rig import COLUMNS, Numbers
from armimpedance.lab.simulate_study.summary import ChangeSums, Sums, Z, wilson
from armimpedance.lab.simulate_study.work import Pair, Result, sessions_of

FULL: Final = "simulated"
DRAWN: Final = "drawn"
_SUMMARY: Final = (
    *("n", "failed", "truth", "bias", "bias_se", "rmse", "rmse_se", "mean_sd"),
    *("coverage", "coverage_low", "coverage_high", "efficiency"),
)
_CHANGE: Final = (
    *("n", "failed", "true_change", "mean_change"),
    *("power", "power_low", "power_high", "coverage", "coverage_low", "coverage_high"),
)
#: Lines of the printed table.
_MOST_LINES: Final = 40

Columns = Mapping[str, FloatArray]


def write_tables(results: Sequence[Result], config: Config, blocks: Blocks) -> None:
    """Write all tables of a study into its folder."""
    settings = list(dict.fromkeys(name for cell in config.cells for name in cell.shown))
    head = ["cell", *settings]
    tail = ["quantity", "unit", "source"]
    columns = [*head, "condition", *tail, *_SUMMARY]
    _write_csv(blocks.out / "cells.csv", columns, _cell_rows(results, settings))
    if config.power:
        columns = [*head, "first", "second", *tail, "kind", *_CHANGE]
        _write_csv(blocks.out / "changes.csv", columns, _change_rows(results, settings))
    _write_sessions(config, blocks)


def _cell_rows(results: Sequence[Result], settings: list[str]) -> Iterator[list[object]]:
    for number, result in enumerate(results, 1):
        shown = [number, *(result.cell.shown.get(name, "") for name in settings)]
        for condition in result.cell.conditions:
            for source, columns in _summaries(result, condition):
                for q, quantity in enumerate(result.cell.rig.quantities):
                    numbers = [columns[name][q] for name in _SUMMARY]
                    yield [*shown, condition, quantity.name, quantity.unit, source, *numbers]


def _summaries(result: Result, condition: str) -> Iterator[tuple[str, Columns]]:
    if condition in result.sums:
        yield FULL, summary(result.sums[condition])
    if result.drawn is not None:
        yield DRAWN, summary(result.drawn.sums[condition], result.drawn.errors[condition])


def summary(sums: Sums, errors: Columns | None = None) -> Columns:
    """Columns of cells.csv, each (Q,).

    `errors`: standard errors of drawn sessions' bias, rmse and coverage, which the number of
    sessions does not tell.
    """
    with np.errstate(all="ignore"):
        low, high = wilson(sums.held, sums.n)
        if errors is not None:
            low, high = _limits(sums.coverage, errors["coverage"])
        return {
            "n": sums.n,
            "failed": sums.failed,
            "truth": sums.truth / sums.n,
            "bias": sums.bias,
            "bias_se": sums.bias_se if errors is None else errors["bias"],
            "rmse": sums.rmse,
            "rmse_se": sums.rmse_se if errors is None else errors["rmse"],
            "mean_sd": sums.sd / sums.n,
            "coverage": sums.coverage,
            "coverage_low": low,
            "coverage_high": high,
            "efficiency": sums.efficiency,
        }


def _limits(share: FloatArray, error: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.maximum(share - Z * error, 0), np.minimum(share + Z * error, 1)


def _change_rows(results: Sequence[Result], settings: list[str]) -> Iterator[list[object]]:
    for number, result in enumerate(results, 1):
        shown = [number, *(result.cell.shown.get(name, "") for name in settings)]
        for source, pair, columns in _change_summaries(result):
            for q, quantity in enumerate(result.cell.rig.quantities):
                kind = "log ratio" if quantity.kind in ("ratio", "share") else "difference"
                unit = "1" if kind == "log ratio" else quantity.unit
                numbers = [columns[name][q] for name in _CHANGE]
                yield [*shown, *pair, quantity.name, unit, source, kind, *numbers]


def _change_summaries(result: Result) -> Iterator[tuple[str, Pair, Columns]]:
    for pair, sums in result.changes.items():
        yield FULL, pair, change_summary(sums)
    if result.drawn is not None:
        for pair, sums in result.drawn.changes.items():
            yield DRAWN, pair, change_summary(sums, result.drawn.change_errors[pair])


def change_summary(sums: ChangeSums, errors: Columns | None = None) -> Columns:
    """Columns of changes.csv, each (Q,); `errors` as for `summary`."""
    with np.errstate(all="ignore"):
        power, coverage = wilson(sums.found, sums.n), wilson(sums.held, sums.n)
        if errors is not None:
            power = _limits(sums.power, errors["power"])
            coverage = _limits(sums.coverage, errors["coverage"])
        return {
            "n": sums.n,
            "failed": sums.failed,
            "true_change": sums.truth / sums.n,
            "mean_change": sums.change / sums.n,
            "power": sums.power,
            "power_low": power[0],
            "power_high": power[1],
            "coverage": sums.coverage,
            "coverage_low": coverage[0],
            "coverage_high": coverage[1],
        }


def _write_csv(path: Path, columns: list[str], rows: Iterator[list[object]]) -> None:
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            writer.writerow([_cell_text(value) for value in row])


def _cell_text(value: object) -> str:
    """A number in as few digits as give it back; nothing for what is not known."""
    if not isinstance(value, float):
        return str(value)
    if not np.isfinite(value):
        return ""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(float(value))


def _write_sessions(config: Config, blocks: Blocks) -> None:
    """Every estimate, one row each; a block after the other, so that memory stays small."""
    import pyarrow as pa
    from pyarrow import parquet

    text = pa.dictionary(pa.int32(), pa.string())
    words = ((name, text) for name in ("condition", "quantity", "unit"))
    numbers = ((name, pa.float64()) for name in COLUMNS)
    schema = pa.schema([("cell", pa.int32()), ("session", pa.int64()), *words, *numbers])
    path = blocks.out / "sessions.parquet"
    # the writer's dictionaries end in bytes that nobody set; without them the same is the same
    options = {"use_dictionary": False, "compression": "zstd"}
    with staged_file(path) as staged, parquet.ParquetWriter(staged, schema, **options) as writer:
        for number, cell in enumerate(config.cells, 1):
            for start, found in sessions_of(cell, config, blocks):
                arrays = _session_columns(number, cell, start, found)
                writer.write_table(pa.Table.from_arrays(arrays, schema=schema))


def _session_columns(number: int, cell: Cell, start: int, numbers: Numbers) -> list[object]:
    """The columns of a block: a session's conditions stand together."""
    import pyarrow as pa

    conditions, sessions, quantities = numbers.values.shape[:3]
    rows = sessions * conditions * quantities
    values = numbers.values.transpose(1, 0, 2, 3).reshape(rows, -1)
    condition = np.tile(np.repeat(np.arange(conditions), quantities), sessions)
    quantity = np.tile(np.arange(quantities), sessions * conditions)
    return [
        pa.array(np.full(rows, number, dtype=np.int32)),
        pa.array(np.repeat(start + np.arange(sessions), conditions * quantities)),
        _words(condition, cell.conditions),
        _words(quantity, [one.name for one in cell.rig.quantities]),
        _words(quantity, [one.unit for one in cell.rig.quantities]),
        *(pa.array(column) for column in values.T),
    ]


def _words(index: np.ndarray, words: Sequence[str]) -> object:
    """A column of words, each kept once."""
    import pyarrow as pa

    return pa.DictionaryArray.from_arrays(pa.array(index.astype(np.int32)), pa.array(list(words)))


def differing(cells: Sequence[Cell]) -> list[str]:
    """Settings in which each cell differs from others, such as ``noise=sensor method=exact``."""
    shown = [cell.shown for cell in cells]
    rigs = {one["rig"] for one in shown}
    settings = []
    for one in shown:
        alike = [other for other in shown if other["rig"] == one["rig"]]
        apart = [name for name in one if len({other[name] for other in alike}) > 1]
        words = [*(["rig"] if len(rigs) > 1 else []), *apart]
        settings.append(" ".join(f"{name}={one[name]}" for name in words))
    return settings


def printed(results: Sequence[Result], config: Config) -> Iterator[str]:
    """Lines of a short table: coverage and efficiency of every cell and condition."""
    lines = list(_lines(results, config))
    yield "lowest and highest coverage (95 % intervals) and power of all; median efficiency"
    yield from lines[:_MOST_LINES]
    if len(lines) > _MOST_LINES:
        yield f"... and {len(lines) - _MOST_LINES} more lines: see cells.csv"
    reasons: dict[str, int] = {}
    for result in results:
        for reason, times in result.problems.items():
            reasons[reason] = reasons.get(reason, 0) + times
    for reason, times in sorted(reasons.items(), key=lambda one: -one[1])[:5]:
        yield f"  {times} without an estimate: {reason}"


def _lines(results: Sequence[Result], config: Config) -> Iterator[str]:
    for result, settings in zip(results, differing(config.cells), strict=True):
        names = [quantity.name for quantity in result.cell.rig.quantities]
        for condition in result.cell.conditions:
            for source, columns in _summaries(result, condition):
                title = " ".join(filter(None, (settings, condition)))
                yield f"{title}: {_line(names, columns)}" + (" (drawn)" * (source == DRAWN))
        for source, pair, columns in _change_summaries(result):
            title = " ".join(filter(None, (settings, " to ".join(pair))))
            words = f"{title}: power {_range(names, columns['power'])}"
            yield words + (" (drawn)" * (source == DRAWN))
        if result.undrawn:
            yield f"{settings or result.cell.rig_name}: nothing drawn: {result.undrawn}"


def _line(names: list[str], columns: Columns) -> str:
    count = f"{columns['n'].max():.0f} sessions"
    if columns["failed"].any():
        count += f", up to {columns['failed'].max():.0f} failed"
    if not np.isfinite(columns["coverage"]).any():
        return f"{count}, no estimate"
    words = f"{count}, coverage {_range(names, columns['coverage'])}"
    efficiencies = columns["efficiency"][np.isfinite(columns["efficiency"])]
    return words + (f", efficiency {np.median(efficiencies):.2f}" if len(efficiencies) else "")


def _range(names: list[str], shares: FloatArray) -> str:
    """The least and the largest share, and of what."""
    if not np.isfinite(shares).any():
        return "not known"
    ends = dict.fromkeys((int(np.nanargmin(shares)), int(np.nanargmax(shares))))
    return " to ".join(f"{100 * shares[at]:.1f} % {names[at]}" for at in ends)
