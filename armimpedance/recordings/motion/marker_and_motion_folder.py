"""Folders that hold recordings of markers or of joint motion."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES, LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from armimpedance.core.skeleton import ROOT_TRANSLATIONS, Skeleton
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

#: Names that resemble a marker's column but are not valid.
_NEARLY: Final = re.compile(r"(.+)_([xyzXYZ])(_mm|_cm|_M)?")


def read_markers(path: str | os.PathLike[str]) -> MarkerRecording:
    """Read a recording of markers from a folder and check it.

    Samples: `trial`, `time_s` and of each marker ``<marker>_x_m, <marker>_y_m, <marker>_z_m``,
    empty where it was not seen; of each force plate in `recording.json` ``plate1_fx_N …
    plate1_mz_Nm``. `skeleton.json` is read where it is there.

    Raises InputError: the recording is wrong; the error names file, row and column.
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

    `read_markers` returns exactly the same recording.

    Raises InputError: the folder cannot be written, or a marker's name has no form on disk.
    """
    names = marker_columns(recording.names)
    flat = recording.positions.reshape(len(recording.time_s), -1)
    columns: dict[str, FloatArray] = dict(zip(names, flat.T, strict=True))
    write_tables(recording, Path(path), columns, table)


def marker_columns(markers: tuple[str, ...]) -> tuple[str, ...]:
    """The three columns of each of these markers."""
    return tuple(f"{marker}_{axis}_m" for marker in markers for axis in AXES)


def _marker_names(file: Path, names: tuple[str, ...]) -> tuple[str, ...]:
    """The markers of a table in the order of their first columns; all three must be there."""
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
    """Check that markers are seen in all three axes or in none, and lie within the room."""
    refuse_beyond(table, marker_columns(markers), LARGEST_PLACE_M, "millimetres", "metres")
    for marker in markers:
        names = marker_columns((marker,))
        lost = np.isnan(np.column_stack([table.columns[n] for n in names]))
        partial = np.flatnonzero(lost.any(axis=1) & ~lost.all(axis=1))
        if len(partial):
            i = int(partial[0])
            raise InputError(
                "empty, but not in all three axes",
                file=table.file,
                row=table.row(i),
                column=names[int(np.argmax(lost[i]))],
                expected="a marker is seen in all axes or in none",
            )


# A recording of joint motion as a folder: kind "motion".

#: A person who walks in circles turns further than any joint.
LARGEST_HEADING_RAD: Final = 20.0 * math.pi


def read_motion(path: str | os.PathLike[str]) -> MotionRecording:
    """Read a recording of joint motion from a folder and check it.

    Samples: `trial`, `time_s` and the columns of the skeleton's coordinates (``<coordinate>_rad``,
    ``_m`` for the root's place); optional ``tau_<coordinate>_Nm`` (``_N``) of all of them, and
    force plates as in `read_markers`. `skeleton.json` must be there.

    Raises InputError: the recording is wrong; the error names file, row and column.
    """
    folder = Path(path)
    metadata, file = open_folder(folder, "motion")
    names = column_names(file)
    skeleton = _skeleton(folder)
    _refuse_degrees(file, names, skeleton)
    torques = torque_columns(skeleton)
    if not set(torques) & set(names):
        torques = ()
    tables = read_tables(folder, metadata, (*skeleton.columns, *torques), gaps=False)
    _check_units(tables.table, skeleton)
    return MotionRecording(
        sample_rate_hz=metadata.sample_rate_hz,
        trials=tables.trials,
        offsets=tables.offsets,
        time_s=tables.columns["time_s"],
        coordinates=tables.stack(skeleton.columns),
        skeleton=skeleton,
        wrenches=tables.wrenches,
        plate_origins_m=metadata.plate_origins_m,
        torque=tables.stack(torques) if torques else None,
        emg=tables.emg,
        subject=metadata.subject,
        provenance=(*metadata.provenance, *tables.remarks),
    )


def write_motion(
    recording: MotionRecording, path: str | os.PathLike[str], table: TableForm = "parquet"
) -> None:
    """Write a recording of joint motion to a folder that appears only when it is complete.

    `read_motion` returns exactly the same recording.

    Raises InputError: the folder cannot be written, or a coordinate's name has no form on disk.
    """
    names = recording.skeleton.columns
    columns: dict[str, FloatArray] = dict(zip(names, recording.coordinates.T, strict=True))
    if recording.torque is not None:
        columns |= dict(zip(torque_columns(recording.skeleton), recording.torque.T, strict=True))
    write_tables(recording, Path(path), columns, table)


def torque_columns(skeleton: Skeleton) -> tuple[str, ...]:
    """Columns of the generalised forces: ``tau_<coordinate>_N`` (root's place) or ``_Nm``."""
    places = _places(skeleton)
    units = ["N" if i < places else "Nm" for i in range(len(skeleton.coordinates))]
    return tuple(f"tau_{c}_{u}" for c, u in zip(skeleton.coordinates, units, strict=True))


def _places(skeleton: Skeleton) -> int:
    return len(ROOT_TRANSLATIONS) if skeleton.floating else 0


def _skeleton(folder: Path) -> Skeleton:
    file = folder / SKELETON_FILE
    if not file.is_file():
        raise InputError("no such file", file=file, expected="the skeleton whose joints these are")
    return read_skeleton(file)


def _refuse_degrees(file: Path, names: tuple[str, ...], skeleton: Skeleton) -> None:
    for coordinate, column in zip(skeleton.coordinates, skeleton.columns, strict=True):
        if column not in names and f"{coordinate}_deg" in names:
            in_degrees = f"{coordinate}_deg"
            raise InputError(
                "an angle in degrees", file=file, row=1, column=in_degrees, expected=f"{column}"
            )


def _check_units(table: NumberTable, skeleton: Skeleton) -> None:
    places, roots = _places(skeleton), len(skeleton.root_coordinates)
    columns = skeleton.columns
    refuse_beyond(table, columns[:places], LARGEST_PLACE_M, "millimetres", "metres")
    refuse_beyond(table, columns[places:roots], LARGEST_HEADING_RAD, "degrees", "radians")
    refuse_beyond(table, columns[roots:], LARGEST_ANGLE_RAD, "degrees", "radians")
