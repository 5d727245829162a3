"""What a task is: drawn people, their truth, their recordings. One file a task, the record TASK."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from armimpedance.core.method_table import MethodTable
from armimpedance.lab.benchmark import VERSION, Group, Key, Known, seed_of

if TYPE_CHECKING:
    from armimpedance.recordings import AnyRecording


def _nothing(_folder: Path) -> None:
    """No files beside the recordings."""


@dataclass(frozen=True)
class Made:
    """One record of a task.

    Attributes
    ----------
    groups : tuple of Group
        What is asked, with its truth.
    recordings : callable
        -> name of the folder -> recording; simulated only when they are asked for.
    beside : callable
        Writes further files into the record's folder.
    body_told : bool
        Whether the recordings tell the person's mass and height: where the limb's inertia is asked
        they would give the answer, to the last digit; of a person they do not.
    """

    groups: tuple[Group, ...]
    recordings: Callable[[], Mapping[str, AnyRecording]]
    beside: Callable[[Path], None] = _nothing
    body_told: bool = False


@dataclass(frozen=True)
class Task:
    """A task.

    Attributes
    ----------
    line : str
        What it is, in one sentence.
    asks : str
        What is asked, and what may be known, for its README.
    draw : callable
        A seed -> Made. Everything that is true of a record hangs on its seed: subjects that are
        built in would be known to everybody.
    share : callable
        Writes into the task's folder what is the same for all records.
    """

    line: str
    asks: str
    draw: Callable[[int], Made] = field(repr=False)
    share: Callable[[Path], None] = _nothing


TASKS: Final[MethodTable[Task]] = MethodTable(
    "armimpedance.lab.benchmark_command.tasks", "TASK", "task"
)


def drawn(task: str, record: str, key: Key | None) -> Made:
    """A record of the public half, or with a key of the sealed one."""
    return TASKS[task].draw(seed_of(VERSION, task, record, key))


def truth_of(task: str, records: Iterable[str], key: Key | None) -> list[Known]:
    """The truth of some records of one half, made anew."""
    return [
        known
        for record in records
        for group in drawn(task, record, key).groups
        for known in group.known(task, record)
    ]


def nameless(recording: Any, body_told: bool) -> Any:
    """A recording that tells neither its seed nor how it was simulated, as a laboratory's."""
    subject = recording.subject
    if subject is not None:
        told = {} if body_told else {"mass_kg": None, "height_m": None}
        subject = replace(subject, id="person", **told)
    return replace(recording, provenance=("armimpedance benchmark",), subject=subject)
