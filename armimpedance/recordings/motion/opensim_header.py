"""Headers of OpenSim's and SIMM's tables: keys, the names of the columns, the unit of angles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from armimpedance.core.errors import InputError
from armimpedance.recordings.motion.tabbed_text import TextFile, cells, stated_count

#: So many lines without `endheader` are no header.
_LONGEST_HEADER: Final = 200
#: What the cells of a table hold, by the header's DataType: numbers with commas between them.
_PARTS: Final = {
    "double": 1,
    "vec2": 2,
    "vec3": 3,
    "unitvec3": 3,
    "vec4": 4,
    "quaternion": 4,
    "vec5": 5,
    "vec6": 6,
    "spatialvec": 6,
}
#: Sentences by which older programs state the unit.
_SENTENCES: Final = {"angles are in degrees": True, "angles are in radians": False}


@dataclass(frozen=True)
class OpenSimHeader:
    """What stands above the rows.

    Attributes
    ----------
    names : tuple of str
        Of all columns but the first, which is the time; as in the file.
    parts : int
        Numbers in each of their cells.
    in_degrees : bool or None
        None where the header does not say, or says both.
    rows : str or None
        The number of rows that it states.
    first : int
        The line (from 0) after the names.
    remarks : tuple of str
    """

    names: tuple[str, ...]
    parts: int
    in_degrees: bool | None
    rows: str | None
    first: int
    remarks: tuple[str, ...]

    @property
    def columns(self) -> tuple[str, ...]:
        """A name for each column of numbers but the time; "" where it cannot be told by name.

        Parts of a cell are numbered as OpenSim does: ``marker_1, marker_2, marker_3``.
        """
        if self.parts == 1:
            flat = list(self.names)
        else:
            flat = [f"{n}_{i}" for n in self.names for i in range(1, self.parts + 1)]
        often = Counter(flat)
        return tuple(name if often[name] == 1 else "" for name in flat)

    @property
    def twice(self) -> tuple[str, ...]:
        """Names that stand over two columns or more."""
        return tuple(name for name, count in Counter(self.names).items() if name and count > 1)


def read_header(text: TextFile) -> OpenSimHeader:
    """Read what stands above the rows: either header in use, ending with `endheader`.

    Raises
    ------
    InputError
        No such header, the first column is no time, or what the header says of its angles or cells
        is not known.
    """
    end = _end_of_header(text)
    keys = _keys(text.lines[:end])
    at = next((i for i in range(end + 1, len(text.lines)) if text.lines[i].strip(' \t,"')), None)
    if at is None:
        expected = "time, …"
        raise InputError(
            "no columns after endheader", file=text.file, row=end + 1, expected=expected
        )
    stated = [keys[key] for key in ("ncolumns", "datacolumns") if key in keys]
    names = _names(text.lines[at], stated)
    if not names or names[0].lower() != "time":
        shown = names[0] if names else ""
        problem = f"the first column is {shown!r}"
        raise InputError(problem, file=text.file, row=at + 1, expected="time")
    degrees, remarks = _in_degrees(keys, text.lines[:end], text)
    for count in dict.fromkeys(stated):
        remarks += stated_count(count, len(names), "columns", text)
    rows = [keys[key] for key in ("nrows", "datarows") if key in keys]
    return OpenSimHeader(
        names=tuple(names[1:]),
        parts=_parts(keys.get("datatype", "double"), text),
        in_degrees=degrees,
        rows=rows[0] if rows else None,
        first=at + 1,
        remarks=(*text.remarks, *remarks),
    )


def _plain(line: str) -> str:
    """A line of a header without what a spreadsheet adds to it."""
    return line.strip(' \t\r,;"')


def _end_of_header(text: TextFile) -> int:
    for i, line in enumerate(text.lines[:_LONGEST_HEADER]):
        if _plain(line).lower() == "endheader":
            return i
    expected = "an OpenSim table (.mot or .sto)"
    raise InputError("no line 'endheader'", file=text.file, expected=expected)


def _keys(lines: list[str]) -> dict[str, str]:
    """Keys of the header: ``nRows=700`` and ``datarows 700``."""
    keys: dict[str, str] = {}
    for line in map(_plain, lines):
        parts = line.split("=", 1) if "=" in line else line.split(None, 1)
        if len(parts) == 2 and parts[1].strip():
            keys[parts[0].strip().lower()] = parts[1].strip()
    return keys


def _names(line: str, stated: list[str]) -> list[str]:
    names = cells(line)
    while names and not names[-1]:
        names.pop()
    while names and not names[0]:
        names.pop(0)
    # tabs here and blanks there, as files edited by hand have them
    apart = line.split()
    return apart if str(len(names)) not in stated and str(len(apart)) in stated else names


def _parts(kind: str, text: TextFile) -> int:
    parts = _PARTS.get(kind.lower())
    if parts is None:
        expected = "double, Vec3, Quaternion or SpatialVec"
        raise InputError(f"DataType={kind[:40]}", file=text.file, expected=expected)
    return parts


def _in_degrees(
    keys: Mapping[str, str], lines: list[str], text: TextFile
) -> tuple[bool | None, tuple[str, ...]]:
    """Whether angles are in degrees, as the key or a sentence says; None where both disagree."""
    plain = {_plain(line).rstrip(".").lower() for line in lines}
    said = {degrees for sentence, degrees in _SENTENCES.items() if sentence in plain}
    key = keys.get("indegrees")
    if key is not None:
        if key.lower() not in ("yes", "no"):
            raise InputError(f"inDegrees={key[:40]}", file=text.file, expected="yes or no")
        said.add(key.lower() == "yes")
    if len(said) > 1:
        return None, ("Its header says of its angles both degrees and radians.",)
    return (said.pop() if said else None), ()
