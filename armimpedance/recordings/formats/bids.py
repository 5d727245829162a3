"""Folders of BIDS: tracked points as markers, or anything else by a mapping of its columns."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armimpedance.errors import InputError
from armimpedance.recordings.bids.dataset import is_bids, person_at
from armimpedance.recordings.bids.markers import bids_markers
from armimpedance.recordings.bids.runs import runs_of
from armimpedance.recordings.formats import mapped
from armimpedance.recordings.mapped.columns_toml import MAPPING_FILE
from armimpedance.recordings.reading import AnyRecording, Format, ReadOptions

#: Where a mapping can lie in a dataset; validators pass over `code`.
_PLACES = ("code", ".")


def _read(path: Path, options: ReadOptions) -> AnyRecording:
    person = person_at(path)
    mapping = options.mapping or _mapping_in(person.root)
    if mapping is not None:
        for name in ("axes", "skeleton", "prefix", "emg_channels"):
            if name in options.given:
                problem = f"{name} beside a mapping"
                raise InputError(problem, file=mapping, expected="one or the other")
        return mapped.FORMAT.read(path, ReadOptions(mapping=mapping))
    markers = bids_markers(
        person,
        runs_of(person, emg=bool(options.emg_channels)),
        system=options.prefix,
        emg_channels=options.emg_channels,
        axes=options.axes,
    )
    return replace(markers, skeleton=options.skeleton)


def _mapping_in(root: Path) -> Path | None:
    places = [root / place / MAPPING_FILE for place in _PLACES]
    return next((place for place in places if place.is_file()), None)


FORMAT = Format(
    name="a folder of BIDS (motion, emg)",
    recognises=is_bids,
    read=_read,
    options=("prefix", "emg_channels", "axes", "skeleton", "mapping"),
)
