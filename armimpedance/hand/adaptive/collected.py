"""Collection of trials that arrive one by one into a recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject


@dataclass(frozen=True, eq=False)
class RecordedTrial(FrozenRecord):
    """Recorded samples of one push.

    `position`, `force` (S, d): of the hand (m), and by the limb on the handle (N).
    `onset_s`, `end_s`: of the disturbance, from the first sample.
    `direction` (d,): unit vector.
    `joint_angles` (S, n) or None: rad.
    """

    condition: str
    direction: Annotated[FloatArray, "d"]
    onset_s: float
    end_s: float
    position: Annotated[FloatArray, "s d"]
    force: Annotated[FloatArray, "s d"]
    joint_angles: FloatArray | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.position.shape != self.force.shape:
            raise InputError(
                f"a position of {self.position.shape} and a force of {self.force.shape}",
                expected="as many samples and axes of both",
            )
        if not self.onset_s < self.end_s:
            raise InputError(
                f"a disturbance from {self.onset_s:g} to {self.end_s:g} s", expected="an end later"
            )


@dataclass(frozen=True)
class Setup:
    """Facts that all trials of a session share."""

    sample_rate_hz: float = 1000.0
    handle_mass_kg: float = 0.0
    subject: Subject | None = None
    shoulder_m: tuple[float, ...] | None = None


def recording_of(trials: Sequence[RecordedTrial], setup: Setup) -> Recording:
    """Build a recording from trials, in their order.

    Parameters
    ----------
    trials : sequence of RecordedTrial
    setup : Setup

    Returns
    -------
    Recording
        Of returning disturbances of the hand.

    Raises
    ------
    InputError
        There is no trial, or they differ in axes.
    """
    if not trials:
        raise InputError("no trial", expected="one or more")
    for number, trial in enumerate(trials, 1):
        check_axes(trial, trials[0], number)
    lengths = np.array([len(trial.position) for trial in trials])
    angles = [trial.joint_angles for trial in trials if trial.joint_angles is not None]
    all_angles = np.concatenate(angles) if len(angles) == len(trials) else None
    return Recording(
        kind="hand",
        sample_rate_hz=setup.sample_rate_hz,
        trials=_table(trials),
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.concatenate([np.arange(n) / setup.sample_rate_hz for n in lengths]),
        position=np.concatenate([trial.position for trial in trials]),
        force=np.concatenate([trial.force for trial in trials]),
        joint_angles=all_angles,
        handle_mass_kg=setup.handle_mass_kg,
        subject=setup.subject or Subject(),
        shoulder_m=None if setup.shoulder_m is None else np.array(setup.shoulder_m),
        provenance=("trials that were chosen one after another",),
    )


def check_axes(trial: RecordedTrial, first: RecordedTrial, number: int) -> None:
    """Refuse a trial, of this number, whose axes differ from those of the first one.

    Raises InputError: they differ.
    """
    d = first.position.shape[1]
    if trial.position.shape[1] != d:
        raise InputError(f"trial {number}: other axes", expected=f"{d} as in the first")


def trials_of(recording: Recording) -> list[RecordedTrial]:
    """The trials of a recording whose table has direction, onset and end.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    list of RecordedTrial

    Raises
    ------
    InputError
        The table lacks one of them for a trial.
    """
    table = recording.trials
    for column in ("direction_deg", "onset_s", "end_s"):
        if column not in table or not np.isfinite(table[column].to_numpy(float)).all():
            raise InputError("a trial without it", column=column, expected="a number")
    around = np.deg2rad(table["direction_deg"].to_numpy(float))
    units = np.column_stack([np.cos(around), np.sin(around)])
    if recording.axes == 3:
        above = np.deg2rad(table["elevation_deg"].to_numpy(float))
        units = np.column_stack([units * np.cos(above)[:, None], np.sin(above)])
    trials = []
    for row in range(recording.n_trials):
        samples = recording.samples_of(row)
        angles = recording.joint_angles
        trials.append(
            RecordedTrial(
                str(table["condition"].iloc[row]),
                units[row],
                float(table["onset_s"].iloc[row]),
                float(table["end_s"].iloc[row]),
                recording.position[samples],
                recording.force[samples],
                None if angles is None else angles[samples],
            )
        )
    return trials


def _table(trials: Sequence[RecordedTrial]) -> pd.DataFrame:
    columns: dict[str, Any] = {
        "trial": np.arange(1, len(trials) + 1),
        "condition": [trial.condition for trial in trials],
        "onset_s": [trial.onset_s for trial in trials],
        "end_s": [trial.end_s for trial in trials],
    }
    units = np.stack([trial.direction for trial in trials])
    columns["direction_deg"] = np.round(np.rad2deg(np.arctan2(units[:, 1], units[:, 0])), 6) % 360
    if units.shape[1] == 3:
        columns["elevation_deg"] = np.round(np.rad2deg(np.arcsin(np.clip(units[:, 2], -1, 1))), 6)
    return pd.DataFrame(columns)
