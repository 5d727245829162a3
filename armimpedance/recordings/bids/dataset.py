"""Files of one person in a BIDS dataset, and the metadata in its other files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from armimpedance.core.delimited import number_of
from armimpedance.core.errors import InputError
from armimpedance.core.json_text import read_json
from armimpedance.recordings.bids.tsv import BidsName, headed_rows, is_missing, parsed
from armimpedance.recordings.mapped.mapping import known_unit

DESCRIPTION: Final = "dataset_description.json"
_LARGEST_JSON_BYTES: Final = 5_000_000
#: Column of participants.tsv -> name of the fact in SI.
_SIZES: Final = {
    "weight": "mass_kg",
    "mass": "mass_kg",
    "body_weight": "mass_kg",
    "body_mass": "mass_kg",
    "height": "height_m",
    "body_height": "height_m",
}
_KG: Final = {"kg": 1.0, "kilogram": 1.0, "kilograms": 1.0, "g": 1e-3, "lb": 0.45359237}


def is_bids(path: Path) -> bool:
    """Return True for a dataset, a person's or session's folder in one, or one motion file."""
    if path.is_file():
        name = parsed(path)
        return bool(
            name
            and name.suffix == "motion"
            and name.ending == ".tsv"
            and {"sub", "task", "tracksys"} <= set(name.entities)
        )
    return path.is_dir() and ((path / DESCRIPTION).is_file() or _root_above(path) is not None)


def _root_above(path: Path) -> Path | None:
    """Dataset of a `sub-` or `ses-` folder; None if it is in no dataset."""
    folder = path.resolve()
    if folder.name.startswith("ses-"):
        folder = folder.parent
    inside = folder.name.startswith("sub-") and (folder.parent / DESCRIPTION).is_file()
    return folder.parent if inside else None


@dataclass(frozen=True)
class Person:
    """One person's recordings in a dataset, or a part of them.

    `root`: folder of the dataset.
    `folder`: the person's folder.
    `within`: the part that is read: the person's folder, a session's folder, or one file.
    """

    root: Path
    folder: Path
    within: Path

    @property
    def label(self) -> str:
        """The person's label, without ``sub-``."""
        return self.folder.name.removeprefix("sub-")

    @cached_property
    def files(self) -> tuple[BidsName, ...]:
        """All files with BIDS names that can apply to the person's recordings.

        From the top downwards; in a folder, names with fewer entities first.
        """
        sessions = [f for f in _folders(self.folder) if f.name.startswith("ses-")]
        levels = [self.root, self.folder, *sessions]
        kinds = [
            f for level in levels[1:] for f in _folders(level) if not f.name.startswith("ses-")
        ]
        files = []
        for folder in [*levels, *kinds]:
            named = [parsed(p) for p in _listed(folder) if not p.is_dir()]
            valid = [name for name in named if name is not None]
            files += sorted(valid, key=lambda n: (len(n.entities), n.path.name))
        return tuple(files)

    def data(self, suffix: str, endings: Sequence[str]) -> list[BidsName]:
        """Data files of one kind within the part that is read."""
        inside = [f for f in self.files if f.suffix == suffix and f.ending in endings]
        top = self.within.resolve()
        if self.within.is_file():
            return [f for f in inside if f.path.resolve() == top]
        return [f for f in inside if "sub" in f.entities and top in f.path.resolve().parents]

    def sidecar(self, data: BidsName, suffix: str | None = None) -> dict[str, Any]:
        """Merge the JSON files that describe a data file; those nearer to it take precedence."""
        merged: dict[str, Any] = {}
        for file in self.describing(data, suffix or data.suffix, ".json"):
            merged |= small_json(file.path)
        return merged

    def describing(self, data: BidsName, suffix: str, ending: str) -> list[BidsName]:
        """Files of one kind that describe a data file, from the top downwards."""
        above = {self.root.resolve(), *data.path.resolve().parents}
        return [
            f
            for f in self.files
            if (f.suffix, f.ending) == (suffix, ending)
            and f.describes(data)
            and f.path.resolve().parent in above
        ]

    @cached_property
    def facts(self) -> dict[str, float | str]:
        """Facts on the person from the table of participants; body sizes also in SI."""
        table = self.root / "participants.tsv"
        if not table.is_file():
            return {}
        rows = headed_rows(table, ["participant_id"])
        row = next((r for r in rows if r["participant_id"] == self.folder.name), {})
        facts = {k: number_or_text(v) for k, v in row.items() if k != "participant_id"}
        present = {k: v for k, v in facts.items() if not (isinstance(v, str) and is_missing(v))}
        sidecar = self.root / "participants.json"
        units = small_json(sidecar) if sidecar.is_file() else {}
        return {**present, **_sizes(present, units)}


def _sizes(facts: dict[str, float | str], units: dict[str, Any]) -> dict[str, float]:
    """Body sizes in SI, if the units of the table are stated."""
    sizes = {}
    for name, value in facts.items():
        fact, description = _SIZES.get(name.lower()), units.get(name)
        if fact is None or not isinstance(value, float) or not isinstance(description, dict):
            continue
        unit = str(description.get("Units", description.get("Unit", ""))).strip()
        if fact == "mass_kg" and unit.lower() in _KG:
            sizes[fact] = value * _KG[unit.lower()]
        length = known_unit(unit)
        if fact == "height_m" and length is not None and length.dimension == "length":
            sizes[fact] = value * length.multiply / length.divide
    return sizes


def person_at(path: Path) -> Person:
    """Return the person whose recordings a path holds.

    Raises InputError: the path holds several persons or none.
    """
    if path.is_file():
        parents = [p for p in path.resolve().parents if p.name.startswith("sub-")]
        folder = parents[-1] if parents else path.resolve().parent
        return Person(folder.parent, folder, path)
    root = _root_above(path)
    if root is not None:
        resolved = path.resolve()
        return Person(root, resolved.parent if resolved.name.startswith("ses-") else resolved, path)
    people = [f for f in _folders(path) if f.name.startswith("sub-")]
    if len(people) != 1:
        shown = ", ".join(p.name for p in people[:6]) + (", …" if len(people) > 6 else "")
        problem = f"a dataset of {len(people)} persons"
        expected = f"the folder of one ({shown})" if people else "folders sub-<label>"
        raise InputError(problem, file=path, expected=expected)
    return Person(path, people[0], people[0])


def small_json(file: Path) -> dict[str, Any]:
    """Read a JSON file of BIDS, which must be small."""
    try:
        if file.stat().st_size > _LARGEST_JSON_BYTES:
            raise InputError("is too large for such a file", file=file, expected="below 5 MB")
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file) from None
    return read_json(file)


def number_or_text(cell: str) -> float | str:
    """Return a cell as a number if it is a finite number, else as text."""
    value = number_of(cell)
    return cell if value is None or not math.isfinite(value) else value


def _listed(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=folder) from None


def _folders(folder: Path) -> list[Path]:
    return [entry for entry in _listed(folder) if entry.is_dir()]
