"""A session as a MATLAB file: one struct array with an element a trial, or arrays of frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

from armimpedance.core.conventions import force_columns, position_columns
from armimpedance.core.records import Recording
from manipulandum_sim.lab_files.trial_columns import trials_of


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
    """What a column of the samples is called in the file of `write_frames`.

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
    for field, names in _fields(recording).items():
        if name in names:
            axis = f",{names.index(name) + 1}" if len(names) > 1 else ""
            return f"D.FrameData.{field}(*,:{axis})"
    return f"D.FrameData.{name}(*,:)"


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
    longest = max(len(trial.columns["time_s"]) for trial in trials)
    fields = _fields(recording)
    there = {name for names in fields.values() for name in names}
    fields |= {name: (name,) for name in trials[0].columns if name not in there}
    frames: dict[str, np.ndarray] = {"Frames": np.zeros((len(trials), 1))}
    for field, names in fields.items():
        axes = 3 if field in ("RobotPosition", "RobotForces") else len(names)
        frames[field] = np.zeros((len(trials), longest, axes))
        for i, trial in enumerate(trials):
            rows = len(trial.columns["time_s"])
            frames["Frames"][i] = rows
            for axis, name in enumerate(names):
                frames[field][i, :rows, axis] = trial.columns[name]
        if len(names) == 1:
            frames[field] = frames[field][:, :, 0]
    conditions = np.array([[trial.condition] for trial in trials], dtype=object)
    whole = {
        "Trials": float(len(trials)),
        "TrialNumber": np.array([[float(trial.number)] for trial in trials]),
        "Condition": conditions,
        **{
            name: np.array([[trial.facts[name]] for trial in trials])
            for name, value in trials[0].facts.items()
            if all(isinstance(trial.facts.get(name), float) for trial in trials)
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
    return fields
