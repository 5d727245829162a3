"""SAMPLES.csv: one row a sample of every movement. Empty where there is no value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Final

from armimpedance.core.json_text import finite
from armimpedance.joint.therapy.arm.torques import MovementTorques
from armimpedance.joint.therapy.share.result import SampleContribution
from armimpedance.show.files import Content, course_struct, table_content

SAMPLE_COLUMNS: Final = (
    *("trial", "time_s", "q_rad", "qd_rad_s", "tau_motor_Nm", "tau_robot_Nm", "tau_arm_Nm"),
    *("tau_user_Nm", "counts", "contribution_percent", "sd_contribution", "valid"),
)


def samples_content(
    movements: Iterable[tuple[MovementTorques, SampleContribution]],
) -> Content:
    """What a file holds of the samples of every movement: one row a sample.

    Parameters
    ----------
    movements : pairs of MovementTorques and SampleContribution
        A movement and (3) of its samples.

    Returns
    -------
    Content
        Without a long table: a sample is no estimate.
    """
    rows = [
        {name: finite(cell) for name, cell in row.items()}
        for pair in movements
        for row in _samples(*pair)
    ]
    return table_content(
        rows,
        SAMPLE_COLUMNS,
        quantities=lambda: (),
        structs=lambda: [course_struct(SAMPLE_COLUMNS, rows)],
        digits=10,
    )


def _samples(torques: MovementTorques, samples: SampleContribution) -> Iterator[dict[str, Any]]:
    moved = (torques.time_s, torques.q, torques.qd, torques.motor, torques.robot, torques.arm)
    columns = (*moved, torques.user, samples.counts, samples.percent, samples.sd, samples.valid)
    for values in zip(*(column.tolist() for column in columns), strict=True):
        yield dict(zip(SAMPLE_COLUMNS, (torques.trial, *values), strict=True))
