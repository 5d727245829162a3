"""Choices that a person made on the page, and the script that does the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pandas as pd

from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.recordings import (
    ExamLook,
    is_recording,
    look_at_exam,
    propose_mapping,
    with_where,
)

#: Columns of a trial table that no group is made of: one value a trial, or a number of the robot's.
_NO_GROUPS = ("trial", "onset_s", "end_s", "file")

# What has to be asked of a file before it can be read.


@dataclass(frozen=True)
class Questions:
    """Questions that a file leaves open.

    Attributes
    ----------
    exam : ExamLook or None
        What a Kinarm exam holds, where the file is one.
    mapping : str or None
        A mapping of the columns, to be read and edited, where the file is a table of any layout.
    cannot_tell : tuple of str
        What the columns' names, units and numbers leave open.
    """

    exam: ExamLook | None = None
    mapping: str | None = None
    cannot_tell: tuple[str, ...] = ()


def questions_of(path: Path) -> Questions:
    """Questions to ask of a file: events of an exam, columns of a table, or none.

    A table that has its mapping beside it shows that one.
    """
    exam = _or_none(lambda: look_at_exam(path))
    if exam is not None:
        return Questions(exam=exam)
    place = (path if path.is_dir() else path.parent) / "columns.toml"
    if place.exists():
        return Questions(mapping=place.read_text(encoding="utf-8"))
    if is_recording(path):
        return Questions()
    proposed = _or_none(lambda: propose_mapping(path))
    if proposed is None:
        return Questions()
    return Questions(mapping=proposed.text, cannot_tell=proposed.cannot_tell)


def _or_none(work: Callable[[], Any]) -> Any:
    try:
        return work()
    except InputError:
        return None


# Which trials, in which groups.


@dataclass(frozen=True)
class ChosenAnalysis:
    """The file, how it is read, which of its trials are taken, and how they are grouped.

    Attributes
    ----------
    path : Path
    reading : mapping
        Options of `read` and their values.
    handle_mass_kg : float or None
        The mass between force sensor and hand; None: what the file says.
    by : tuple of str
        Columns of the trial table whose groups are estimated.
    conditions : tuple
        Conditions that stay; empty: all.
    left_out : tuple of int
        Numbers of trials that are left out.
    """

    path: Path
    reading: Mapping[str, Any] = field(default_factory=dict)
    handle_mass_kg: float | None = None
    by: tuple[str, ...] = ("condition",)
    conditions: tuple[Any, ...] = ()
    left_out: tuple[int, ...] = ()

    @property
    def kept(self) -> str | None:
        """Which trials stay of those that were read, as `read` takes it; None: all."""
        parts = []
        if self.conditions:
            parts.append(f"condition in {_one_of(self.conditions)}")
        if self.left_out:
            parts.append(f"trial not in {_one_of(self.left_out)}")
        return " and ".join(parts) or None

    def keep(self, recording: Recording) -> Recording:
        """The recording with the trials that stay.

        Raises InputError: none stays.
        """
        kept = recording if self.kept is None else with_where(recording, self.kept, self.path)
        assert isinstance(kept, Recording)  # noqa: S101 - what is cut stays of its kind
        if self.handle_mass_kg is None:
            return kept
        return replace(kept, handle_mass_kg=self.handle_mass_kg)

    def script(self, compared: bool = True) -> str:
        """The same analysis in Python; a mapping is looked for where the script runs.

        `compared`: whether the groups are compared, too.
        """
        by = repr(self.by[0] if len(self.by) == 1 else list(self.by))
        lines = [
            f'"""Impedance of the hand from {self.path.name}."""',
            "",
            *(["from dataclasses import replace", ""] if self.handle_mass_kg is not None else []),
            "import armimpedance as ai",
            "",
            *self.read_lines(str(self.path)),
            "print(ai.inspect(recording))",
            "",
            f"hand = ai.estimate(recording, by={by})",
            "print(hand)",
            'hand.write("hand.csv")',
            'ai.save(ai.plot_ellipses(hand).figure, "ellipses")',
        ]
        if compared:
            lines += [
                "",
                f"differences = ai.compare(recording, by={by})",
                "print(differences)",
                'differences.write("differences.csv")',
            ]
        lines += ["", f'ai.write_report(recording, "report.html", by={by})', ""]
        return "\n".join(lines)

    def read_lines(self, path: str) -> list[str]:
        """Lines of Python that read the recording; reports for other people name the file alone."""
        both = [part for part in (self.reading.get("where"), self.kept) if part]
        reading = dict(self.reading)
        if "mapping" in reading:
            reading["mapping"] = "columns.toml"
        if both:
            reading["where"] = both[0] if len(both) == 1 else " and ".join(f"({p})" for p in both)
        words = [repr(path), *(f"{name}={value!r}" for name, value in reading.items())]
        lines = [f"recording = ai.read({', '.join(words)})"]
        if self.handle_mass_kg is not None:
            lines += [f"recording = replace(recording, handle_mass_kg={self.handle_mass_kg!r})"]
        return lines


def _one_of(values: Sequence[Any]) -> str:
    """``(3,)`` or ``('far', 'near')``."""
    return repr(tuple(values))


def groupings(trials: pd.DataFrame) -> list[str]:
    """Columns of a trial table that make groups: two or more values, each of several trials."""
    columns = [name for name in trials.columns if name not in _NO_GROUPS]
    several = [n for n in columns if 1 < trials[n].nunique(dropna=False) <= len(trials) / 2]
    return list(dict.fromkeys(["condition", *several]))


def written(write: Callable[[Path], object], name: str) -> bytes:
    """Bytes that a function writes into a file of this name."""
    with TemporaryDirectory() as folder:
        path = Path(folder, name)
        write(path)
        return path.read_bytes()
