"""VARYING.csv: B and K of one joint over time, with their 95 % bands; I beside them."""

from __future__ import annotations

from pathlib import Path

from armimpedance.elbow import VaryingImpedance
from armimpedance.files.tables import write_table


def write_varying(varying: VaryingImpedance, path: str | Path) -> None:
    """One row per point of the result's grid, whole or not at all.

    Parameters
    ----------
    varying : VaryingImpedance
    path : path
        Its ending decides the format: .csv, .json or .parquet.

    Raises
    ------
    InputError
        Another ending, or the file cannot be written.
    """
    table = varying.to_frame()
    shown = _text if Path(path).suffix == ".csv" else lambda cell: cell
    rows = ({str(name): shown(c) for name, c in row.items()} for row in table.to_dict("records"))
    write_table(rows, path, list(table.columns))


def _text(cell: object) -> object:
    return f"{cell:.10g}" if isinstance(cell, float) else cell
