"""Folders of BIDS: points as markers, joint angles, or other columns by a mapping."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armimpedance.core.errors import InputError
from armimpedance.core.skeleton import Skeleton
from armimpedance.recordings.bids.angles import bids_angles, has_angles
from armimpedance.recordings.bids.dataset import is_bids, person_at
from armimpedance.recordings.bids.markers import bids_markers, has_points
from armimpedance.recordings.bids.runs import runs_of
from armimpedance.recordings.formats import mapped
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE
from armimpedance.recordings.motion.skeleton_json import read_skeleton
from armimpedance.recordings.reading import AnyRecording, Format, ReadOptions

#: Folders of a dataset that may hold a mapping; validators skip `code`.
_PLACES = ("code", ".")


def _read(path: Path, options: ReadOptions) -> AnyRecording:
    person = person_at(path)
    mapping = options.mapping or _mapping_in(person.root)
    if mapping is not None:
        for name in ("axes", "skeleton", "prefix", "emg_channels", "angles", "in_degrees"):
            if name in options.given:
                problem = f"{name} beside a mapping"
                raise InputError(problem, file=mapping, expected="one or the other")
        return mapped.FORMAT.read(path, ReadOptions(mapping=mapping))
    skeleton = options.skeleton or _skeleton_in(person.root)
    runs = runs_of(person, emg=bool(options.emg_channels))
    if options.angles or (has_angles(runs) and not has_points(runs)):
        return bids_angles(
            person,
            runs,
            skeleton,
            options.angles,
            system=options.prefix,
            in_degrees=options.in_degrees,
        )
    markers = bids_markers(
        person,
        runs,
        system=options.prefix,
        emg_channels=options.emg_channels,
        axes=options.axes,
    )
    return replace(markers, skeleton=skeleton)


def _mapping_in(root: Path) -> Path | None:
    places = [root / place / MAPPING_FILE for place in _PLACES]
    return next((place for place in places if place.is_file()), None)


def _skeleton_in(root: Path) -> Skeleton | None:
    """Read the skeleton that `armimpedance share` wrote into a dataset, if there is one."""
    place = root / "code" / "skeleton.json"
    return read_skeleton(place) if place.is_file() else None


FORMAT = Format(
    name="a folder of BIDS",
    recognises=is_bids,
    read=_read,
    options=("prefix", "emg_channels", "axes", "skeleton", "angles", "in_degrees", "mapping"),
)
