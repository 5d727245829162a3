"""A session as a MATLAB file: one struct array, an element a trial."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import savemat

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
