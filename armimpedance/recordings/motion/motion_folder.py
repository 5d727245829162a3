"""A recording of joint motion as a folder: kind "motion"."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Final

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import LARGEST_ANGLE_RAD
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MotionRecording
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

#: Somebody who walks in circles turns further than any joint does.
LARGEST_HEADING_RAD: Final = 20.0 * math.pi


def read_motion(path: str | os.PathLike[str]) -> MotionRecording:
    """Read a recording of joint motion from a folder and check it.

    Samples: `trial`, `time_s` and the columns of the skeleton's coordinates (``<coordinate>_rad``,
    ``_m`` for the root's place); optional ``tau_<coordinate>_Nm`` (``_N``) of all of them, and
    force plates as in `read_markers`. `skeleton.json` must be there.

    Raises
    ------
    InputError
        Which file, row and column is wrong, and what was expected.
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

    `read_motion` gives the same recording back, bit by bit.

    Raises
    ------
    InputError
        The folder cannot be written, or a coordinate's name has no form on disk.
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
            given = f"{coordinate}_deg"
            raise InputError(
                "an angle in degrees", file=file, row=1, column=given, expected=f"{column}"
            )


def _check_units(table: NumberTable, skeleton: Skeleton) -> None:
    places, roots = _places(skeleton), len(skeleton.root_coordinates)
    columns = skeleton.columns
    refuse_beyond(table, columns[:places], LARGEST_PLACE_M, "millimetres", "metres")
    refuse_beyond(table, columns[places:roots], LARGEST_HEADING_RAD, "degrees", "radians")
    refuse_beyond(table, columns[roots:], LARGEST_ANGLE_RAD, "degrees", "radians")
