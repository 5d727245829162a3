"""A session as a MATLAB file: one struct array with an element a trial, or arrays of frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.mapping_text import numeric_facts
from manipulandum_sim.lab_files.trial_columns import sample_names, trials_of


def write_matlab_trials(recording: Recording, path: Path) -> None:
    """Write ``trials(1..T)``, each with its columns, its condition and what is known of it.

    Parameters
    ----------
    recording : Recording
    path : Path
        The file, of MATLAB's version 5.
    """
    trials = [
        {
            "trial": float(trial.number),
            "condition": trial.condition,
            **trial.facts,
            **{name: values[:, None] for name, values in trial.columns.items()},
        }
        for trial in trials_of(recording)
    ]
    names = list(dict.fromkeys(name for trial in trials for name in trial))
    struct = np.empty((1, len(trials)), dtype=[(name, object) for name in names])
    for i, trial in enumerate(trials):
        struct[0, i] = tuple(trial.get(name, np.zeros((0, 0))) for name in names)
    content = {"trials": struct, "sample_rate_hz": float(recording.sample_rate_hz)}
    savemat(path, content, do_compression=True, long_field_names=True)


def frame_column(recording: Recording, name: str) -> str:
    """Name of a column of the samples in the file of `write_frames`.

    Parameters
    ----------
    recording : Recording
    name : str
        As in a recording's folder, such as ``x_m``.

    Returns
    -------
    str
        As a mapping names it, ``D.FrameData.RobotPosition(*,:,1)``.
    """
    field, names = next((f, n) for f, n in _fields(recording).items() if name in n)
    axis = f",{names.index(name) + 1}" if len(names) > 1 else ""
    return f"D.FrameData.{field}(*,:{axis})"


def write_frames(recording: Recording, path: Path) -> None:
    """Write one struct ``D`` with what holds for each trial, and ``D.FrameData`` with its samples.

    So the files of experiments at a vBOT are laid out, as analyses that their laboratories
    published read them: ``RobotPosition`` (trials, frames, 3), ``TrialTime`` (trials, frames) and
    so on are filled up with zeros behind the ``Frames`` of a trial, and have a third axis of zeros.

    Parameters
    ----------
    recording : Recording
        Two trials or more.
    path : Path
        The file, of MATLAB's version 5.
    """
    trials = list(trials_of(recording))
    rows = np.diff(recording.offsets)
    frames: dict[str, np.ndarray] = {"Frames": rows[:, None].astype(float)}
    for field, names in _fields(recording).items():
        axes = 3 if field in ("RobotPosition", "RobotForces") else len(names)
        block = np.zeros((len(trials), rows.max(), axes))
        for i, trial in enumerate(trials):
            for axis, name in enumerate(names):
                block[i, : rows[i], axis] = trial.columns[name]
        frames[field] = block[:, :, 0] if len(names) == 1 else block
    whole = {
        "Trials": float(len(trials)),
        "TrialNumber": np.array([[float(trial.number)] for trial in trials]),
        "Condition": np.array([[trial.condition] for trial in trials], dtype=object),
        **{
            name: np.array([[trial.facts[name]] for trial in trials])
            for name in numeric_facts(recording)
        },
        "FrameData": frames,
    }
    savemat(path, {"D": whole}, do_compression=True, long_field_names=True)


def _fields(recording: Recording) -> dict[str, tuple[str, ...]]:
    """Field of the frames -> its columns, one an axis or muscle."""
    kind, axes = recording.kind, recording.axes
    fields = {
        "TrialTime": ("time_s",),
        "RobotPosition": position_columns(kind, axes),
        "RobotForces": force_columns(kind, axes),
    }
    if recording.emg is not None:
        fields["EMG"] = tuple(f"emg_{muscle}" for muscle in recording.muscles)
    there = {name for names in fields.values() for name in names}
    return fields | {name: (name,) for name in sample_names(recording) if name not in there}
