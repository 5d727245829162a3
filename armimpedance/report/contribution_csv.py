"""RESULT.csv: one row a movement; SAMPLES.csv: one row a sample. Empty where there is no value."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.contribution.metric import Contribution, SampleContribution
from armimpedance.contribution.torques import MovementTorques
from armimpedance.outputs import staged_file

COLUMNS: Final = (
    *("trial", "condition", "movement", "axis", "n_samples", "duration_s"),
    *("projection_percent", "sd_projection", "ci_low_projection", "ci_high_projection"),
    *("projection_valid", "ratio_percent", "sd_ratio", "sum_ratio", "ratio_valid"),
    *("reference_percent", "sd_reference", "reference_valid"),
    *("mean_support_Nm", "mean_reference_Nm", "lowering_share", "saturated_share", "notes"),
)

SAMPLE_COLUMNS: Final = (
    *("trial", "time_s", "q_rad", "qd_rad_s", "tau_motor_Nm", "tau_robot_Nm", "tau_arm_Nm"),
    *("tau_user_Nm", "contribution_percent", "sd_contribution", "valid"),
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
    low, high = result.projection_ci95
    return [
        *(result.trial, result.condition, result.movement, result.axis_name),
        *(str(result.n_samples), _text(result.duration_s)),
        *map(_text, (result.projection_percent, result.projection_sd, low, high)),
        _truth(result.projection_valid),
        *map(_text, (result.ratio_percent, result.ratio_sd, result.sum_ratio)),
        _truth(result.ratio_valid),
        *map(_text, (result.reference_percent, result.reference_sd)),
        _truth(result.reference_valid),
        *map(_text, (result.mean_support_Nm, result.mean_reference_Nm)),
        *map(_text, (result.lowering_share, result.saturated_share)),
        "; ".join(result.notes),
    ]


def _samples(torques: MovementTorques, samples: SampleContribution) -> Iterable[list[str]]:
    moved = (torques.time_s, torques.q, torques.qd, torques.motor, torques.robot, torques.arm)
    columns = (*moved, torques.user, samples.percent, samples.sd)
    for *values, valid in zip(*(c.tolist() for c in columns), samples.valid.tolist(), strict=True):
        yield [torques.trial, *map(_text, values), _truth(valid)]


def _text(value: float | None) -> str:
    return "" if value is None or not np.isfinite(value) else f"{value:.10g}"


def _truth(value: bool) -> str:
    return "True" if value else "False"
