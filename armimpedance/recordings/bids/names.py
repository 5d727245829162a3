"""Names of files in BIDS: entities such as `sub-01`, a suffix such as `motion`, an ending."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

#: What says which system recorded, not what was recorded.
OF_THE_SYSTEM: Final = ("tracksys", "recording", "space", "desc")


@dataclass(frozen=True)
class BidsName:
    """A file and what its name says.

    Attributes
    ----------
    path : Path
    entities : mapping
        Such as ``{"sub": "01", "task": "reach"}``, in the name's order.
    suffix : str
        Such as "motion".
    ending : str
        Such as ".tsv.gz".
    """

    path: Path
    suffix: str
    ending: str
    entities: Mapping[str, str] = field(default_factory=dict)

    def describes(self, data: BidsName, but: Collection[str] = ()) -> bool:
        """Whether what this file says holds for that one: each of its entities is that one's.

        Parameters
        ----------
        data : BidsName
        but : collection of str
            Entities that are not compared.
        """
        mine = {key: value for key, value in self.entities.items() if key not in but}
        return all(data.entities.get(key) == value for key, value in mine.items())


def parsed(path: Path) -> BidsName | None:
    """What the name of a file says; None where it is no name of BIDS."""
    stem, dot, ending = path.name.partition(".")
    *parts, suffix = stem.split("_")
    entities = {}
    for part in parts:
        key, dash, value = part.partition("-")
        if not (key and dash and value) or key in entities:
            return None
        entities[key] = value
    return BidsName(path, suffix, dot + ending, entities) if suffix and dot else None
