"""RESULT.csv: one row a movement; SAMPLES.csv: one row a sample. Empty where there is no value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from armimpedance.files.tables import write_table
from armimpedance.json_text import finite
from armimpedance.therapy import Contribution, MovementTorques, SampleContribution

SAMPLE_COLUMNS: Final = (
    *("trial", "time_s", "q_rad", "qd_rad_s", "tau_motor_Nm", "tau_robot_Nm", "tau_arm_Nm"),
    *("tau_user_Nm", "counts", "contribution_percent", "sd_contribution", "valid"),
)


def write_contributions(results: Sequence[Contribution], path: str | Path) -> None:
    """One row per movement, whole or not at all.

    Parameters
    ----------
    results : sequence of Contribution
        Of all movements.
    path : path
        Its ending decides the format: .csv, .json or .parquet.

    Raises
    ------
    InputError
        Another ending, or the file cannot be written.
    """
    _write([result.to_dict() for result in results], path)


def write_samples(
    movements: Iterable[tuple[MovementTorques, SampleContribution]], path: str | Path
) -> None:
    """One row per sample of every movement, whole or not at all.

    Parameters
    ----------
    movements : pairs of MovementTorques and SampleContribution
        A movement and (3) of its samples.
    path : path
        Its ending decides the format: .csv, .json or .parquet.

    Raises
    ------
    InputError
        Another ending, or the file cannot be written.
    """
    _write((row for pair in movements for row in _samples(*pair)), path)


def _samples(torques: MovementTorques, samples: SampleContribution) -> Iterator[dict[str, Any]]:
    moved = (torques.time_s, torques.q, torques.qd, torques.motor, torques.robot, torques.arm)
    columns = (*moved, torques.user, samples.counts, samples.percent, samples.sd, samples.valid)
    for values in zip(*(column.tolist() for column in columns), strict=True):
        yield dict(zip(SAMPLE_COLUMNS, (torques.trial, *values), strict=True))


def _write(rows: Iterable[Mapping[str, Any]], path: str | Path) -> None:
    digits = Path(path).suffix == ".csv"
    write_table(({name: _cell(v, digits) for name, v in row.items()} for row in rows), path)


def _cell(value: Any, ten_digits: bool) -> Any:
    value = finite(value)
    return f"{value:.10g}" if ten_digits and isinstance(value, float) else value
