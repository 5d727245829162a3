"""Files of odd layouts with a known content, as labs save them; used by several tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import scipy.io

from armimpedance.core.records import Recording

#: A mapping's lines for the columns of `long_table`.
ONSETS = 'onset_s = "onset"\nend_s = "end"\ncondition = "cond"'
BY_TRIAL = 'by = "column"\ncolumn = "trial"'
XY, FXY = ["x", "y"], ["fx", "fy"]

HAND = """
kind = "hand"
{more}
{time}
[position]
columns = {position}
unit = "m"

[force]
columns = {force}
unit = "N"
by = "{by}"

[trials]
{trials}

[trials.columns]
{values}
"""


def hand_mapping(
    position: list[str],
    force: list[str],
    *,
    time: str | None = None,
    by: str = "limb",
    trials: str = 'by = "run"',
    values: str = "",
    more: str = "",
) -> str:
    """The text of a mapping of a hand's recording in SI."""
    return HAND.format(
        more=more,
        time=f'[time]\ncolumn = "{time}"\nunit = "s"\n' if time else "",
        position=str(position).replace("'", '"'),
        force=str(force).replace("'", '"'),
        by=by,
        trials=trials,
        values=values,
    )


def long_table(recording: Recording, names: list[str] | None = None) -> pd.DataFrame:
    """All trials below each other, with what the trial table says repeated in each row."""
    lengths = np.diff(recording.offsets)
    columns = {
        "trial": np.repeat(recording.trials["trial"].to_numpy(), lengths),
        "cond": np.repeat(recording.trials["condition"].to_numpy(), lengths),
        "t": recording.time_s,
        "x": recording.position[:, 0],
        "y": recording.position[:, 1],
        "fx": recording.force[:, 0],
        "fy": recording.force[:, 1],
        "onset": np.repeat(recording.trials["onset_s"].to_numpy(), lengths),
        "end": np.repeat(recording.trials["end_s"].to_numpy(), lengths),
    }
    table = pd.DataFrame(columns)
    return table if names is None else table.set_axis(names, axis=1)


def trials_of(recording: Recording) -> list[dict[str, Any]]:
    """One dictionary a trial: time (N,), pos (N, 2), force (N, 2), and what holds for it."""
    return [
        {
            "t": recording.time_s[s],
            "pos": recording.position[s],
            "force": recording.force[s],
            "cond": str(recording.trials["condition"].iloc[i]),
            "trial": float(recording.trials["trial"].iloc[i]),
            "onset": float(recording.trials["onset_s"].iloc[i]),
            "ending": float(recording.trials["end_s"].iloc[i]),
        }
        for i in range(recording.n_trials)
        for s in [recording.samples_of(i)]
    ]


def struct_array(trials: list[dict[str, Any]]) -> np.ndarray:
    """The trials as an array of MATLAB structs."""
    array = np.zeros((1, len(trials)), dtype=[(name, "O") for name in trials[0]])
    for i, trial in enumerate(trials):
        array[0, i] = tuple(trial.values())
    return array


def cells(parts: list[Any]) -> np.ndarray:
    """Parts as a MATLAB cell array."""
    array = np.empty((1, len(parts)), dtype=object)
    for i, part in enumerate(parts):
        array[0, i] = part
    return array


def mat5_bytes(path: Path, *, compressed: bool = False) -> bytes:
    """A small valid file of version 5: structs, cells, text, numbers of several types."""
    n = 60
    trial = {"pos": np.random.default_rng(1).normal(size=(n, 2)), "name": "relaxed"}
    content = {
        "trials": struct_array([trial, trial]),
        "emg": cells([np.arange(n, dtype=np.int16), np.arange(n, dtype=np.float32)]),
        "fs": 1000.0,
        "notes": {"who": "A", "deep": {"x": np.arange(4.0)}},
    }
    scipy.io.savemat(path, content, do_compression=compressed)
    return path.read_bytes()


def write_mat73(path: Path, content: dict[str, Any]) -> Path:
    """Write a file as MATLAB 7.3 does: turned arrays, classes as attributes, references."""
    path.unlink(missing_ok=True)
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")
        for name, value in content.items():
            _put73(file, refs, name, value)
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124, b" ") + b"\x00\x02IM"
    with path.open("r+b") as stream:
        stream.write(head)
    return path


def _put73(group: h5py.Group, refs: h5py.Group, name: str, value: Any) -> h5py.HLObject:
    if isinstance(value, dict):
        made = group.create_group(name)
        made.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, part in value.items():
            _put73(made, refs, field, part)
        return made
    if isinstance(value, list) and value and isinstance(value[0], dict):
        made = group.create_group(name)
        made.attrs["MATLAB_class"] = np.bytes_("struct")
        for field in value[0]:
            made.create_dataset(field, data=_references(refs, [part[field] for part in value]))
        return made
    if isinstance(value, list):
        made = group.create_dataset(name, data=_references(refs, value))
        made.attrs["MATLAB_class"] = np.bytes_("cell")
        return made
    if isinstance(value, str):
        codes = np.array([[ord(c)] for c in value], dtype=np.uint16)
        made = group.create_dataset(name, data=codes)
        made.attrs["MATLAB_class"] = np.bytes_("char")
        return made
    array = np.atleast_2d(np.asarray(value, dtype=np.float64).T).T
    made = group.create_dataset(name, data=array.T, compression="gzip" if array.size > 9 else None)
    made.attrs["MATLAB_class"] = np.bytes_("double")
    return made


def _references(refs: h5py.Group, parts: list[Any]) -> np.ndarray:
    made = [_put73(refs, refs, f"r{len(refs)}", part).ref for part in parts]
    array = np.empty((len(made), 1), dtype=h5py.ref_dtype)
    array[:, 0] = made
    return array
