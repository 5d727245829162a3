"""Joint motion of a skeleton from a table of OpenSim."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
from armimpedance.core.not_taken import not_taken
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.motion.opensim_table import read_opensim_table


def opensim_motion(
    path: str | os.PathLike[str],
    skeleton: Skeleton,
    names: Mapping[str, str] | None = None,
    *,
    in_degrees: bool | None = None,
) -> MotionRecording:
    """Joint motion of a skeleton from a table of angles.

    Parameters
    ----------
    path : path
    skeleton : Skeleton
        Its root's coordinates are 0 where the table has none: the table's own root is another
        model's.
    names : mapping, optional
        Coordinate -> column of the table, where the names differ; ``-column`` turns the sign. The
        skeleton's other coordinates have their own names, also as paths
        (``/jointset/elbow/elbow_flexion/value``), or are 0, which the provenance tells.
    in_degrees : bool, optional
        Unit of the angles where the file does not state it.

    Raises
    ------
    InputError
        See `OpenSimTable.angles`; or none of the skeleton's coordinates is in the table.
    """
    table = read_opensim_table(path)
    given = dict(names or {})
    for coordinate in given:
        skeleton.coordinate(coordinate)
    hinges = [c for c in skeleton.coordinates if c not in skeleton.root_coordinates]
    plain = {name: name for name in (*table.columns, *table.twice)}
    known = {**_by_path(table.columns), **plain, **given}
    chosen = {c: known[c] for c in hinges if c in known}
    if not chosen:
        expected = f"one of {', '.join(hinges)}, or names"
        raise InputError("none of the skeleton's angles", file=path, expected=expected)
    columns = tuple(column.removeprefix("-") for column in chosen.values())
    angles = table.angles(columns, in_degrees)
    q = np.zeros((len(table.time_s), len(skeleton.coordinates)))
    for i, (coordinate, column) in enumerate(chosen.items()):
        q[:, skeleton.coordinate(coordinate)] = angles[:, i] * (-1 if column.startswith("-") else 1)
    absent = [c for c in skeleton.coordinates if c not in chosen]
    remarks = ["Read from an OpenSim table.", *table.remarks]
    if absent:
        remarks.append(f"Not in the table, set to 0: {', '.join(absent)}.")
    remarks += not_taken(
        [name for name in table.columns if name not in columns], "no coordinate of the skeleton"
    )
    return MotionRecording(
        sample_rate_hz=table.sample_rate_hz,
        trials=pd.DataFrame({"trial": [1], "condition": [Path(path).stem]}),
        offsets=np.array([0, len(q)]),
        time_s=table.time_s,
        coordinates=q,
        skeleton=skeleton,
        provenance=tuple(remarks),
    )


def _by_path(columns: Iterable[str]) -> dict[str, str]:
    """Coordinate -> column, where columns are named by their path in a model."""
    paths = [name.split("/") for name in columns]
    return {path[-2]: "/".join(path) for path in paths if len(path) > 2 and path[-1] == "value"}
