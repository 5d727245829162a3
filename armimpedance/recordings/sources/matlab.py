"""MATLAB files: versions 4 to 7 with SciPy, 7.3 with h5py; nested structs, cells, arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.core.findings import told_not_taken
from armimpedance.recordings.channel_exports import exported_channels
from armimpedance.recordings.hdf5 import Mat73
from armimpedance.recordings.mapped.raw_file import RawFile, Source, Wanted
from armimpedance.recordings.mat5 import read_mat5
from armimpedance.recordings.matlab_tree import Node, runs_of_tree

_HDF5: Final = b"\x89HDF\r\n\x1a\n"


def _read(file: Path, wanted: Wanted) -> RawFile:
    if _is_hdf5(file):
        opened = Mat73(file)
        try:
            raw = _runs(opened.tree(), file, wanted)
        finally:
            opened.close()
    else:
        raw = _runs(read_mat5(file), file, wanted)
    if not any(table.columns for run in raw.runs for table in run.tables) and raw.not_taken:
        sentences = told_not_taken(raw.not_taken)
        objects = [t for t in sentences if "MATLAB class" in t or "a function" in t]
        if objects:
            problem = f"holds no plain arrays: {objects[0].strip('.')}"
            raise InputError(problem, file=file, expected="structs, cells and arrays")
    return raw


def _runs(tree: dict[str, Node], file: Path, wanted: Wanted) -> RawFile:
    try:
        channels = exported_channels(tree, wanted)
    except InputError as error:
        raise InputError(
            error.problem, file=file, column=error.column, expected=error.expected
        ) from None
    return runs_of_tree(tree, wanted) if channels is None else channels


def _is_hdf5(file: Path) -> bool:
    try:
        with file.open("rb") as stream:
            head = stream.read(1024)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    return any(head[at : at + 8] == _HDF5 for at in (0, 512))


SOURCE = Source(
    name="a MATLAB file (.mat)",
    recognises=lambda path: path.suffix.lower() == ".mat" and path.is_file(),
    read=_read,
)
