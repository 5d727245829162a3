"""A recording of markers as a folder: kind "markers"."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording
from armimpedance.recordings.motion.moving_folder import (
    TableForm,
    open_folder,
    read_tables,
    refuse_beyond,
    write_tables,
)
from armimpedance.recordings.motion.moving_metadata import LARGEST_PLACE_M
from armimpedance.recordings.motion.skeleton_json import SKELETON_FILE, read_skeleton
from armimpedance.recordings.tables.number_table import NumberTable, column_names

#: A column that means to be a marker's, but is not named as one.
_NEARLY: Final = re.compile(r"(.+)_([xyzXYZ])(_mm|_cm|_M)?")


def read_markers(path: str | os.PathLike[str]) -> MarkerRecording:
    """Read a recording of markers from a folder and check it.

    Samples: `trial`, `time_s` and of each marker ``<marker>_x_m, <marker>_y_m, <marker>_z_m``,
    empty where it was not seen; of each force plate in `recording.json` ``plate1_fx_N …
    plate1_mz_Nm``. `skeleton.json` is read where it is there.

    Raises
    ------
    InputError
        Which file, row and column is wrong, and what was expected.
    """
    folder = Path(path)
    metadata, file = open_folder(folder, "markers")
    markers = _marker_names(file, column_names(file))
    columns = marker_columns(markers)
    tables = read_tables(folder, metadata, columns, gaps=True)
    _check_places(tables.table, markers)
    skeleton = folder / SKELETON_FILE
    return MarkerRecording(
        sample_rate_hz=metadata.sample_rate_hz,
        trials=tables.trials,
        offsets=tables.offsets,
        time_s=tables.columns["time_s"],
        positions=tables.stack(columns).reshape(-1, len(markers), 3),
        names=markers,
        skeleton=read_skeleton(skeleton) if skeleton.is_file() else None,
        wrenches=tables.wrenches,
        plate_origins_m=metadata.plate_origins_m,
        emg=tables.emg,
        subject=metadata.subject,
        provenance=(*metadata.provenance, *tables.remarks),
    )


def write_markers(
    recording: MarkerRecording, path: str | os.PathLike[str], table: TableForm = "parquet"
) -> None:
    """Write a recording of markers to a folder that appears only when it is complete.

    `read_markers` gives the same recording back, bit by bit.

    Raises
    ------
    InputError
        The folder cannot be written, or a marker's name has no form on disk.
    """
    names = marker_columns(recording.names)
    flat = recording.positions.reshape(len(recording.time_s), -1)
    columns: dict[str, FloatArray] = dict(zip(names, flat.T, strict=True))
    write_tables(recording, Path(path), columns, table)


def marker_columns(markers: tuple[str, ...]) -> tuple[str, ...]:
    """Columns of these markers: three each."""
    return tuple(f"{marker}_{axis}_m" for marker in markers for axis in AXES)


def _marker_names(file: Path, names: tuple[str, ...]) -> tuple[str, ...]:
    """The markers of a table in the order of their first columns; each with all three."""
    markers: list[str] = []
    for name in names:
        marker, _, axis = name.removesuffix("_m").rpartition("_")
        if name.endswith("_m") and axis in AXES and marker:
            if marker not in markers:
                markers.append(marker)
        elif _NEARLY.fullmatch(name):
            expected = "<marker>_x_m, in metres"
            raise InputError(
                "is no marker's column", file=file, row=1, column=name, expected=expected
            )
    if not markers:
        raise InputError("no marker's column", file=file, row=1, expected="<marker>_x_m, …")
    return tuple(markers)


def _check_places(table: NumberTable, markers: tuple[str, ...]) -> None:
    """A marker is seen in all three axes or in none, and within the room."""
    refuse_beyond(table, marker_columns(markers), LARGEST_PLACE_M, "millimetres", "metres")
    for marker in markers:
        names = marker_columns((marker,))
        lost = np.isnan(np.column_stack([table.columns[n] for n in names]))
        part = np.flatnonzero(lost.any(axis=1) & ~lost.all(axis=1))
        if len(part):
            i = int(part[0])
            raise InputError(
                "empty, but not in all three axes",
                file=table.file,
                row=table.row(i),
                column=names[int(np.argmax(lost[i]))],
                expected="a marker is seen in all axes or in none",
            )
