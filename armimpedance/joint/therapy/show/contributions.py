"""Contributions of all movements of a session, as tables and files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Final, overload

from armimpedance.core.arrays import FrozenRecord
from armimpedance.core.described import Column, meanings
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import finite
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.core.shown import html_table
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.live_replay import LiveReport, replay
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.of_movement import sample_contribution
from armimpedance.joint.therapy.share.result import (
    CONTRIBUTION,
    Contribution,
    SampleContribution,
)
from armimpedance.show.files import (
    Content,
    WrittenResult,
    course_struct,
    table_content,
    write_content,
)

# SAMPLES.csv: one row per sample of every movement. A cell without a value is empty.

SAMPLES: Final[tuple[Column[Any], ...]] = (
    Column("trial", "number of the trial"),
    Column("time_s", "time on the trial's own clock", "s"),
    Column("q_rad", "angle of the moving axis", "rad"),
    Column("qd_rad_s", "velocity of the moving axis", "rad/s"),
    Column("tau_motor_Nm", "torque of the motor", "N m"),
    Column("tau_robot_Nm", "torque that the robot alone needs", "N m"),
    Column("tau_arm_Nm", "torque that the passive arm needs", "N m"),
    Column("tau_user_Nm", "torque of the person", "N m"),
    Column("counts", "whether the axis moves"),
    Column("contribution_percent", "contribution (3) of the sample", "%"),
    Column("sd_contribution", "standard error: contribution (3) of the sample", "%"),
    Column("valid", "whether the torque that the arm needs is well away from zero"),
)
SAMPLE_COLUMNS: Final = tuple(column.name for column in SAMPLES)


def samples_content(
    movements: Iterable[tuple[MovementTorques, SampleContribution]],
) -> Content:
    """Content of a file with the samples of every movement: one row per sample.

    `movements`: movements, each with the contributions (3) of its samples.
    Returns: content without a long table, since a sample is not an estimate.
    """
    rows = [
        {name: finite(cell) for name, cell in row.items()}
        for pair in movements
        for row in _samples(*pair)
    ]
    descriptions = meanings(SAMPLES)
    return table_content(
        rows,
        SAMPLE_COLUMNS,
        described=descriptions,
        quantities=lambda: (),
        structs=lambda: [course_struct(SAMPLE_COLUMNS, rows, descriptions)],
        digits=10,
    )


def _samples(torques: MovementTorques, samples: SampleContribution) -> Iterator[dict[str, Any]]:
    moved = (torques.time_s, torques.q, torques.qd, torques.motor, torques.robot, torques.arm)
    columns = (*moved, torques.user, samples.counts, samples.percent, samples.sd, samples.valid)
    for values in zip(*(column.tolist() for column in columns), strict=True):
        yield dict(zip(SAMPLE_COLUMNS, (torques.trial, *values), strict=True))


#: Largest number of movements in a short text.
_MOST_SHOWN: Final = 6
_METRICS: Final = ("share", "projection", "ratio", "reference")


@dataclass(frozen=True, repr=False, eq=False)
class Contributions(WrittenResult, FrozenRecord, Sequence[Contribution]):
    """Contributions of a session, one per movement, with the data that they were computed from.

    A sequence of `Contribution`.

    Attributes
    ----------
    results : tuple of Contribution
        In the order of the trial table.
    movements : tuple of MovementTorques
        Torques about the moving axis of each movement.
    recording : Recording
        Trials of these movements.
    robot : TherapyRobot
        The identified robot.
    arm : PassiveArm
        The person's relaxed arm.
    left_out : mapping of str to str
        Axes without a passive model, whose movements are left out, each with a sentence with the
        reason.
    notes : tuple of str
        Notes on the session.

    Examples
    --------
    A simulated session takes too long for an example; the tutorial on therapy runs these lines:

    >>> import armimpedance as ai
    >>> session = ai.contribution("session", robot="robot.json", arm="arm.json")  # doctest: +SKIP
    >>> session.to_frame()[["trial", "share_percent"]]  # doctest: +SKIP
    >>> session.to_csv("contribution.csv")  # doctest: +SKIP
    """

    DESCRIBED = meanings(CONTRIBUTION)

    results: tuple[Contribution, ...]
    movements: tuple[MovementTorques, ...]
    recording: Recording
    robot: TherapyRobot
    arm: PassiveArm
    left_out: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.results)

    def __iter__(self) -> Iterator[Contribution]:
        return iter(self.results)

    @overload
    def __getitem__(self, which: int) -> Contribution: ...
    @overload
    def __getitem__(self, which: slice) -> tuple[Contribution, ...]: ...
    def __getitem__(self, which: int | slice) -> Contribution | tuple[Contribution, ...]:
        """One movement by its position from 0, or several as a tuple."""
        return self.results[which]

    def samples(self) -> tuple[SampleContribution, ...]:
        """Contributions (3) of every sample, for each movement."""
        return tuple(sample_contribution(m, self.robot, self.arm) for m in self.movements)

    def replay(self, progress: Progress | None = None) -> LiveReport:
        """Run the recording through the live form, one sample at a time.

        Parameters
        ----------
        progress : function (done, all), optional
            Called after each trial.

        Returns
        -------
        LiveReport
            Duration of an update, and largest difference from the results of the recording.

        Raises
        ------
        InputError
            Samples are missing in the recording.
        """
        step = stepper(progress, len(self))
        return replay(self.recording, self.robot, self.arm, unrepeatable=True, step=step)

    @property
    def content(self) -> Content:
        """One row per movement, with the columns of RESULT.csv."""
        keys = ("trial", "condition", "movement", "axis", "n_samples")
        return table_content(self.to_dict(), keys=keys, digits=10, described=self.DESCRIBED)

    def to_dict(self) -> list[dict[str, Any]]:
        """One mapping per movement with the columns of RESULT.csv; None for an empty cell."""
        return [result.to_dict() for result in self.results]

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write RESULT.csv, as ``armimpedance therapy contribution --out`` does.

        Parameters
        ----------
        path : path
            File name that ends in .csv.

        Raises
        ------
        InputError
            The name has another ending, or the file cannot be written.
        """
        if Path(path).suffix != ".csv":
            raise InputError("not a CSV file's name", file=path, expected="one that ends in .csv")
        self.write(path)

    def write_samples(self, path: str | os.PathLike[str]) -> None:
        """Write one row per sample; the ending gives the format, as for `write`."""
        pairs = zip(self.movements, self.samples(), strict=True)
        write_content(samples_content(pairs), path)

    @property
    def _remarks(self) -> tuple[str, ...]:
        left_out = (f"left out: {sentence}" for sentence in self.left_out.values())
        return (*self.notes, *left_out)

    def __repr__(self) -> str:
        shown = list(map(repr, self.results[:_MOST_SHOWN]))
        hidden = len(self) - len(shown)
        more = [f"... and {hidden} more"] if hidden else []
        head = f"contribution of subject {self.arm.subject} to {len(self)} movements"
        return "\n".join([head, *shown, *more, *self._remarks])

    def _repr_html_(self) -> str:
        head = ["trial", "condition", "movement", *(f"{name} (%)" for name in _METRICS)]
        rows = [
            [r.trial, r.condition, r.movement, *(_text(getattr(r, name)) for name in _METRICS)]
            for r in self.results
        ]
        remarks = "".join(f"<li>{escape(sentence)}</li>" for sentence in self._remarks)
        return f"{html_table([head, *rows])}<ul>{remarks}</ul>"


def stepper(progress: Progress | None, total: int) -> Callable[[], None]:
    """Function that counts its calls and reports the number of finished steps."""
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, total)

    return step


def _text(metric: Any) -> str:
    if metric is None or not metric.valid:
        return "-"
    return f"{metric.percent:.1f} ± {metric.sd:.1f}"
