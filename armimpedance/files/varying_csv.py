"""VARYING.csv: B and K of one joint over time, with their 95 % bands; I beside them."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Final

from armimpedance.elbow import VaryingImpedance
from armimpedance.outputs import staged_file

COLUMNS: Final = (
    *("time_s", "B", "K", "ci_low_B", "ci_high_B", "ci_low_K", "ci_high_K", "sd_B", "sd_K"),
    *("I", "ci_low_I", "ci_high_I", "trial", "method", "warnings"),
)


def write_varying(varying: VaryingImpedance, path: str | Path) -> None:
    """One row per point of the result's grid, whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(_rows(varying))


def _rows(varying: VaryingImpedance) -> list[list[str]]:
    bands = [varying.band(name)[:, side] for name in "BK" for side in (0, 1)]
    numbers = (varying.time_s, varying.B, varying.K, *bands, varying.sd_B, varying.sd_K)
    inertia = [_text(v) for v in (varying.inertia.value, *varying.inertia.ci95)]
    said = [varying.method, "; ".join(varying.warnings)]
    rows = []
    for t, trial in enumerate(varying.trials):
        points = varying.points_of(t)
        for values in zip(*(n[points].tolist() for n in numbers), strict=True):
            rows.append([*map(_text, values), *inertia, trial, *said])
    return rows


def _text(value: float) -> str:
    return f"{value:.10g}"
