"""RESULTS.csv: one row per estimate, written whole or not at all, and read back without loss."""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np

from armimpedance.core.arrays import LARGEST, FloatArray, require_covariance
from armimpedance.core.conventions import AXES, Level, parameter_names
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import ImpedanceEstimate, Quality
from armimpedance.hand.show.quantities import (
    group_cells,
    is_result_column,
    require_results,
    row_blocks,
)
from armimpedance.hand.show.results_json_and_mat import result_objects, result_structs
from armimpedance.numerics.regression import t_factor
from armimpedance.show.files import (
    Cells,
    Content,
    Quantity,
    TableRow,
    of_one_cell,
    quantities_of,
    table_rows,
    write_content,
)

_LINE_BREAKS = re.compile(r"[\r\n\x00]+")
_NUMBER = re.compile(r"-?(0|[1-9]\d*)(\.\d+)?([eE][+-]?\d+)?")


def write_results(estimates: Sequence[ImpedanceEstimate], path: str | os.PathLike[str]) -> None:
    """Write a table of results, under a temporary name that is then changed.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate
        Estimates of one, two and three axes, also mixed.
    path : path
        Its ending determines the format: .csv (RESULTS.csv, see `result_rows`), .json (nested
        matrices), .mat (structs), .parquet (the columns of RESULTS.csv) or .xlsx (a workbook).

    Raises
    ------
    InputError
        Without estimates, if a group's column is named like a column of the results, or for another
        ending.
    """
    require_results(estimates, path)
    write_content(results_content(estimates), path)


def results_content(estimates: Sequence[ImpedanceEstimate]) -> Content:
    """Content of a file of estimates, for any format.

    `estimates`: of one, two and three axes, also mixed.
    Raises InputError: a group's column is named like a column of the results.
    """
    columns, rows = result_rows(estimates)
    groups = dict.fromkeys(name for estimate in estimates for name in group_cells(estimate.keys))
    keys = (*groups, "level", "method", "n_trials")

    def quantities() -> list[Quantity]:
        pairs = zip(estimates, rows, strict=True)
        return [q for estimate, row in pairs for q in _quantities(estimate, columns, row, keys)]

    return Content(
        columns,
        rows,
        quantities,
        lambda: result_objects(estimates),
        lambda: result_structs(estimates),
        keys=keys,
    )


def _quantities(
    estimate: ImpedanceEstimate, columns: Sequence[str], row: Cells, keys: Sequence[str]
) -> list[Quantity]:
    """Quantities of one row; the antisymmetric parts, which lack columns, are given limits."""
    factor = t_factor(estimate.dof)
    return [
        replace(
            quantity,
            lower=quantity.value - factor * quantity.sd,
            upper=quantity.value + factor * quantity.sd,
        )
        if quantity.quantity.endswith("_antisymmetric")
        and quantity.value is not None
        and quantity.sd is not None
        else quantity
        for quantity in quantities_of(columns, [row], keys)
    ]


def result_rows(
    estimates: Sequence[ImpedanceEstimate],
) -> tuple[list[str], list[dict[str, Any]]]:
    """The columns of RESULTS.csv and the cells of each row.

    The columns are those of all estimates; a cell without a value is missing or None.
    `position_i_rad` and `force_i_Nm` are the columns of a recording of joints, `position_i_m` and
    `force_i_N` those of all others (`quantities.is_recording_of_joints`). Line breaks inside a text
    become spaces, since a row is a line.

    Raises InputError: a group's column is named like a column of the results.
    """
    rows = [row_blocks(e) for e in estimates]
    # most axes first: these columns include those of all others in the right order
    ordered = sorted(rows, key=lambda blocks: -len(blocks["matrices"]))
    columns = [
        name
        for block in (rows[0] if rows else ())
        for name in dict.fromkeys(name for blocks in ordered for name in blocks[block])
    ]
    cells = ({k: v for block in blocks.values() for k, v in block.items()} for blocks in rows)
    return columns, [{name: _as_cell(value) for name, value in row.items()} for row in cells]


def _as_cell(value: Any) -> Any:
    return _LINE_BREAKS.sub(" ", value) if isinstance(value, str) else value


#: Longest header (bytes), and columns that every RESULTS.csv has.
_LONGEST_HEAD: Final = 1_000_000
_OF_RESULTS: Final = {"level", "K_11"}


def is_results_file(path: str | os.PathLike[str]) -> bool:
    """True if a file is a table of estimates, not a table of samples with a mapping."""
    file = Path(path)
    if file.suffix != ".csv" or not file.is_file():
        return False
    with file.open("rb") as stream:
        head = stream.readline(_LONGEST_HEAD).decode("utf-8-sig", "replace")
    return set(next(csv.reader(head.splitlines()[:1]), [])) >= _OF_RESULTS


def read_rows(path: str | os.PathLike[str]) -> list[ImpedanceEstimate]:
    """Read the estimates in RESULTS.csv; see `estimates.read_results`."""
    return [_estimate(row) for row in table_rows(Path(path))]


def _estimate(row: TableRow) -> ImpedanceEstimate:
    k = _axes(row)
    quality = _quality(row)
    covariance, warnings = _covariance(row, k)
    places = _places(row, k)
    handle = row.cells.get("M_with_handle_11")
    try:
        return ImpedanceEstimate(
            level=row.text("level", get_args(Level)),  # type: ignore[arg-type]
            method=row.text("method"),
            inertia=row.matrix("M", k),
            viscosity=row.matrix("B", k),
            stiffness=row.matrix("K", k),
            covariance=covariance,
            dof=row.optional("dof", missing=max(quality.n_trials - 1, 1)),
            quality=quality,
            inertia_with_handle=row.matrix("M_with_handle", k) if handle else None,
            keys=_group(row),
            joint_angles=_joint_angles(row),
            torque=row.vector("torque_{}_Nm", range(1, 10)),
            activation=row.vector("alpha_{}", range(1, 100)),
            activation_sd=row.vector("sd_alpha_{}", range(1, 100)),
            muscles=_sentences(row, "muscles"),
            **places,
            shared_errors=row.shared_errors(k),
            warnings=(*_sentences(row, "warnings"), *warnings),
            provenance=_sentences(row, "provenance"),
        )
    except RecordError as error:
        raise InputError(
            error.problem, file=row.file, row=row.line, expected=error.expected
        ) from error


def _axes(row: TableRow) -> int:
    filled = [name for name, text in row.cells.items() if text and re.fullmatch(r"K_\d\d", name)]
    return max((int(digit) for name in filled for digit in name[2:]), default=1)


def _places(row: TableRow, k: int) -> dict[str, FloatArray | None]:
    """Position, force and shoulder, if known, with the same number of axes."""
    joints = row.cells.get("position_1_rad") or row.cells.get("force_1_Nm")
    templates = {
        "position": "position_{}_rad" if joints else "position_{}_m",
        "force": "force_{}_Nm" if joints else "force_{}_N",
        "shoulder_m": "shoulder_{}_m",
    }
    axes = k if row.cells.get("level") == "hand" else None
    places: dict[str, FloatArray | None] = {}
    for field, template in templates.items():
        names = AXES if field == "shoulder_m" else range(1, 10)
        places[field] = values = row.vector(template, names)
        if values is None:
            continue
        axes = len(values) if axes is None else axes
        if len(values) != axes:
            column = template.format(names[min(len(values), axes, len(names) - 1)])
            raise row.error(f"{len(values)} values", column, f"as many as axes: {axes}")
    return places


def _joint_angles(row: TableRow) -> FloatArray | None:
    named = row.vector("q_{}_rad", ("shoulder", "elbow"), row.angle)
    return row.vector("q_{}_rad", range(1, 10), row.angle) if named is None else named


def _quality(row: TableRow) -> Quality:
    return Quality(
        n_trials=row.count("n_trials", low=0),
        n_rows=row.count("n_rows") if row.cells.get("n_rows") else 0,
        multiple_correlation=row.optional("multiple_correlation", finite=True),
        vaf=row.optional("vaf"),
        cond_raw=row.optional("cond_raw"),
        cond_scaled=row.optional("cond_scaled"),
        rank=row.count("rank") if row.cells.get("rank") else 0,
        residual_sd=row.optional("residual_sd", finite=True),
        coherence=row.optional("coherence", missing=None, finite=True),
    )


def _covariance(row: TableRow, k: int) -> tuple[FloatArray, tuple[str, ...]]:
    """Covariance of M, B, K, and warnings about it."""
    if not row.cells.get("covariance"):
        sd = [row.number(f"sd_{name}", low=0) for name in parameter_names(k)]
        sentence = "no covariance in the file: the errors of the elements taken as independent"
        return np.diag(np.square(sd)), (sentence,)
    p = 3 * k * k
    count = p * (p + 1) // 2
    try:
        values = np.array(json.loads(row.cells["covariance"]), dtype=float)
    except (ValueError, TypeError, OverflowError, RecursionError):
        values = np.array([])
    if values.shape != (count,) or not np.isfinite(values).all():
        expected = f"a JSON list of {count} finite numbers (lower triangle)"
        raise row.error("not a covariance", "covariance", expected)
    covariance = np.zeros((p, p))
    covariance[np.tril_indices(p)] = values
    covariance += np.tril(covariance, -1).T
    _check_variances(row, covariance)
    return covariance, ()


def _check_variances(row: TableRow, covariance: FloatArray) -> None:
    if (np.abs(covariance) >= LARGEST).any():
        raise row.error("a variance too large to be measured", "covariance", "variances in SI")
    try:
        require_covariance(covariance, "it")
    except RecordError as error:
        raise row.error(
            f"no covariance: {error.problem}", "covariance", str(error.expected)
        ) from None


def _sentences(row: TableRow, column: str) -> tuple[str, ...]:
    return of_one_cell(row.cells.get(column))


def _group(row: TableRow) -> dict[str, Any]:
    return {
        name: text if name == "condition" else _plain(text)
        for name, text in row.cells.items()
        if name and text and not is_result_column(name)
    }


def _plain(text: str) -> int | float | str:
    """Convert a text to a number if it is one in its plain form (``007`` is not)."""
    match = _NUMBER.fullmatch(text)
    if not match:
        return text
    return float(text) if match[2] or match[3] else int(text)
