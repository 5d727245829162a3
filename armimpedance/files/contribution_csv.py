"""RESULT.csv: one row a movement; SAMPLES.csv: one row a sample. Empty where there is no value."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.outputs import staged_file
from armimpedance.therapy import PARTS, Contribution, MovementTorques, SampleContribution

COLUMNS: Final = (
    *("trial", "condition", "movement", "axis", "n_samples", "duration_s", "still_share"),
    *("share_percent", "sd_share", "ci_low_share", "ci_high_share", "share_valid"),
    *("robot_inertia_percent",),
    *("projection_percent", "sd_projection", "ci_low_projection", "ci_high_projection"),
    *("projection_valid", "ratio_percent", "sd_ratio", "ci_low_ratio", "ci_high_ratio"),
    *("ratio_valid", "sum_ratio", "ratio_all_samples_percent"),
    *("reference_percent", "sd_reference", "reference_valid"),
    *("mean_support_Nm", "mean_arm_Nm", "mean_reference_Nm"),
    *("lowering_share", "saturated_share"),
    *(f"variance_from_{part}" for part in PARTS),
    "notes",
)

SAMPLE_COLUMNS: Final = (
    *("trial", "time_s", "q_rad", "qd_rad_s", "tau_motor_Nm", "tau_robot_Nm", "tau_arm_Nm"),
    *("tau_user_Nm", "counts", "contribution_percent", "sd_contribution", "valid"),
)


def write_contributions(results: Sequence[Contribution], path: str | Path) -> None:
    """One row per movement, whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    _write(path, COLUMNS, map(_row, results))


def write_samples(
    movements: Sequence[tuple[MovementTorques, SampleContribution]], path: str | Path
) -> None:
    """One row per sample of every movement, whole or not at all.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    _write(path, SAMPLE_COLUMNS, (row for pair in movements for row in _samples(*pair)))


def _write(path: str | Path, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    with staged_file(path) as staged, open(staged, "w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def _row(result: Contribution) -> list[str]:
    r = result
    return [
        *(r.trial, r.condition, r.movement, r.axis_name),
        *(str(r.n_samples), _text(r.duration_s), _text(r.still_share)),
        *map(_text, (r.share_percent, r.share_sd, *r.share_ci95)),
        *(_truth(r.share_valid), _text(r.inertia_percent)),
        *map(_text, (r.projection_percent, r.projection_sd, *r.projection_ci95)),
        _truth(r.projection_valid),
        *map(_text, (r.ratio_percent, r.ratio_sd, *r.ratio_ci95)),
        *(_truth(r.ratio_valid), _text(r.sum_ratio), _text(r.ratio_all_percent)),
        *map(_text, (r.reference_percent, r.reference_sd)),
        _truth(r.reference_valid),
        *map(_text, (r.mean_support_Nm, r.mean_arm_Nm, r.mean_reference_Nm)),
        *map(_text, (r.lowering_share, r.saturated_share)),
        *(_text(getattr(r.share_variance, part)) for part in PARTS),
        "; ".join(r.notes),
    ]


def _samples(torques: MovementTorques, samples: SampleContribution) -> Iterable[list[str]]:
    moved = (torques.time_s, torques.q, torques.qd, torques.motor, torques.robot, torques.arm)
    columns = (*moved, torques.user, samples.counts, samples.percent, samples.sd, samples.valid)
    for *values, counts, percent, sd, valid in zip(*(c.tolist() for c in columns), strict=True):
        shown = (_truth(counts), _text(percent), _text(sd), _truth(valid))
        yield [torques.trial, *map(_text, values), *shown]


def _text(value: float | None) -> str:
    return "" if value is None or not np.isfinite(value) else f"{value:.10g}"


def _truth(value: bool) -> str:
    return "True" if value else "False"
