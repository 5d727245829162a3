"""Design of a study: the commands for each session, and for the table of all."""

from __future__ import annotations

import shlex
import string
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import read_toml

#: The file beside the data, or in the folder of the data, that says what is done.
DESIGN_FILE: Final = "study.toml"
#: What stands in braces in a command, and becomes a word of one session.
PLACES: Final = ("recording", "study", "participant", "session")

#: What is done where no file says otherwise.
DEFAULT_STEPS: Final = (
    "inspect {recording} --out checks.csv",
    "estimate {recording} --out hand.csv",
    "report {recording} --out report.html",
)
_KEYS: Final = {"steps", "group_steps", "tables", "recordings"}


@dataclass(frozen=True)
class StudyStep:
    """One command of a chain.

    `words`: as typed after ``armimpedance``, with `PLACES` in braces.
    """

    words: tuple[str, ...]

    @property
    def command(self) -> str:
        """Name of the command."""
        return self.words[0]

    def __str__(self) -> str:
        return shlex.join(self.words)

    def filled(self, places: Mapping[str, str]) -> list[str]:
        """The words of one session.

        `places`: each of `PLACES` -> what stands for it.
        """
        return [word.format_map(places) for word in self.words]

    def names(self, place: str) -> bool:
        """Return True if a word holds ``{place}``."""
        return any(f"{{{place}}}" in word for word in self.words)


@dataclass(frozen=True)
class StudyDesign:
    """Steps for each session and for all of them together.

    Attributes
    ----------
    steps : tuple of StudyStep
        For each session, in this order, in the session's own folder.
    group_steps : tuple of StudyStep
        For the gathered tables, in the group's folder.
    tables : tuple of str
        Files that the steps write and that are gathered, each to one table of all sessions; empty:
        every CSV that steps write.
    recordings : str or None
        Pattern of the recordings' paths below the data's folder; None: whatever can be opened.
    folder : Path
        Where the design stands; ``{study}`` in a command.
    file : Path, optional
        The design itself, where there is one.
    named : bool
        Whether whoever runs the study named the file; one that lies with the data came with them.
    """

    steps: tuple[StudyStep, ...]
    group_steps: tuple[StudyStep, ...]
    tables: tuple[str, ...]
    recordings: str | None
    folder: Path
    file: Path | None = None
    named: bool = False


def read_design(file: Path | None, data: Path) -> StudyDesign:
    """The design in a file, or the one beside the data, or the default.

    Parameters
    ----------
    file : Path, optional
    data : Path
        Folder of the data; its ``study.toml`` is taken where no file is given.

    Returns
    -------
    StudyDesign

    Raises
    ------
    InputError
        The file cannot be read, or a field or command in it is not known.
    """
    own = data / DESIGN_FILE
    if file is None and not own.is_file():
        steps = tuple(map(_step, DEFAULT_STEPS))
        return StudyDesign(steps, (), (), None, data.resolve())
    where = file or own
    content, _ = read_toml(where, "a study.toml")
    for name in content:
        if name not in _KEYS:
            expected = f"one of {', '.join(sorted(_KEYS))}"
            raise InputError(f"no such field: {name!r}", file=where, expected=expected)
    return StudyDesign(
        steps=_steps(content, "steps", where) or tuple(map(_step, DEFAULT_STEPS)),
        group_steps=_steps(content, "group_steps", where),
        tables=tuple(_texts(content, "tables", where)),
        recordings=_pattern(content, where),
        folder=where.resolve().parent,
        file=where,
        named=file is not None,
    )


def _texts(content: Mapping[str, Any], name: str, file: Path) -> list[str]:
    value = content.get(name, [])
    if not isinstance(value, list) or not all(isinstance(one, str) and one for one in value):
        raise InputError(f"{name} is no list of texts", file=file, expected='such as ["..."]')
    return value


def _steps(content: Mapping[str, Any], name: str, file: Path) -> tuple[StudyStep, ...]:
    try:
        return tuple(map(_step, _texts(content, name, file)))
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(f"{name}: {error}", file=file) from None


def _pattern(content: Mapping[str, Any], file: Path) -> str | None:
    value = content.get("recordings")
    inside = isinstance(value, str) and value and not Path(value).is_absolute()
    if value is not None and (not inside or ".." in Path(value).parts):
        expected = 'a pattern below the data, such as "sub-*/ses-*/*.kinarm"'
        raise InputError("recordings is no pattern", file=file, expected=expected)
    return value


def _step(line: str) -> StudyStep:
    try:
        words = shlex.split(line)
        fields = [field for word in words for field in string.Formatter().parse(word)]
    except ValueError as error:
        raise InputError(f"the step {line!r}: {error}", expected="a command") from None
    if words[:1] == ["armimpedance"]:
        words = words[1:]
    if not words:
        raise InputError("an empty step", expected='a command such as "inspect {recording}"')
    for _, name, form, conversion in fields:
        if name is not None and (name not in PLACES or form or conversion):
            places = ", ".join(f"{{{place}}}" for place in PLACES)
            raise InputError(f"the step {line!r}: {{{name}}}", expected=f"one of {places} as it is")
    return StudyStep(tuple(words))
