"""A simulated session as the columns that a laboratory's own program would write of each trial."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.records import Recording


@dataclass(frozen=True)
class TrialColumns:
    """One trial: the columns of its samples by name, and what is known of it as a whole."""

    number: int
    condition: str
    columns: Mapping[str, FloatArray]
    facts: Mapping[str, float | str]


def trials_of(recording: Recording) -> Iterator[TrialColumns]:
    """The trials of a session of the hand or of joints, in their order.

    Parameters
    ----------
    recording : Recording

    Yields
    ------
    TrialColumns
        Names of columns as in a recording's folder: ``time_s``, ``x_m``, ``fx_N``, ``emg_<muscle>``
        and further columns of the samples.
    """
    stacked = _columns(recording)
    for row, trial in enumerate(recording.trials.to_dict("records")):
        first, last = recording.offsets[row], recording.offsets[row + 1]
        facts = {str(name): _plain(value) for name, value in trial.items() if not pd.isna(value)}
        yield TrialColumns(
            number=int(facts.pop("trial")),
            condition=str(facts.pop("condition")),
            columns={name: values[first:last] for name, values in stacked.items()},
            facts=facts,
        )


def sample_names(recording: Recording) -> tuple[str, ...]:
    """The names of the columns of its samples.

    Parameters
    ----------
    recording : Recording

    Returns
    -------
    tuple of str
    """
    return tuple(_columns(recording))


def _plain(value: object) -> float | str:
    """A number as a float, whatever NumPy calls it; anything else as text."""
    number = isinstance(value, bool | int | float | np.number | np.bool_)
    return float(value) if number else str(value)  # type: ignore[arg-type]


def _columns(recording: Recording) -> dict[str, FloatArray]:
    kind, axes = recording.kind, recording.axes
    columns = {"time_s": recording.time_s}
    columns |= dict(zip(position_columns(kind, axes), recording.position.T, strict=True))
    columns |= dict(zip(force_columns(kind, axes), recording.force.T, strict=True))
    if recording.joint_angles is not None:
        names = ("q_shoulder_rad", "q_elbow_rad")[: recording.joint_angles.shape[1]]
        columns |= dict(zip(names, recording.joint_angles.T, strict=True))
    if recording.emg is not None:
        names = tuple(f"emg_{muscle}" for muscle in recording.muscles)
        columns |= dict(zip(names, recording.emg.T, strict=True))
    return columns | dict(recording.extra)
