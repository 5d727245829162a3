"""The benchmark's folder as it is written."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from armimpedance.core.progress import Progress
from armimpedance.core.workers import crew
from armimpedance.lab.benchmark import (
    Key,
    Known,
    record_folder,
    record_names,
    write_index,
    write_task,
)
from armimpedance.lab.benchmark_command.task import TASKS, drawn, nameless
from armimpedance.lab.benchmark_command.texts import task_readme, write_texts
from armimpedance.recordings import write_recording


@dataclass(frozen=True)
class Wanted:
    """What is to be made.

    Attributes
    ----------
    tasks : tuple of str
    count : int
        Records of each half.
    key : Key or None
        None: a public half alone.
    table : {"parquet", "csv"}
    workers : int
        Processes.
    """

    tasks: tuple[str, ...]
    count: int
    key: Key | None
    table: Literal["parquet", "csv"]
    workers: int = 1

    @property
    def records(self) -> dict[str, Key | None]:
        """Names of a task's records -> what they are drawn with."""
        public = dict.fromkeys(record_names("public", self.count))
        sealed = dict.fromkeys(record_names("sealed", self.count), self.key)
        return public if self.key is None else public | sealed


def write_benchmark(wanted: Wanted, top: Path, progress: Progress) -> list[Known]:
    """Write everything into an empty folder; the truth of both halves."""
    calls = [(t, r, k) for t in wanted.tasks for r, k in wanted.records.items()]
    truths: dict[str, list[Known]] = {task: [] for task in wanted.tasks}
    # one record hangs on its own seed alone, so that the number of workers changes nothing
    with crew(wanted.workers) as working:
        work = [working.share(_write_record, top, *call, wanted.table) for call in calls]
        for piece in work:
            piece.add_done_callback(lambda _: progress(sum(p.done() for p in work), len(calls)))
        shared = [working.share(_share, top, task) for task in wanted.tasks]
        for (task, _, _), made in zip(calls, working.finish([*work, *shared]), strict=False):
            truths[task] += made
    for task, truth in truths.items():
        write_task(top, task, truth, wanted.key)
        first = [k.asked for k in truth if k.asked.record == truth[0].asked.record]
        readme = top / "tasks" / task / "README.md"
        readme.write_text(task_readme(task, first), encoding="utf-8")
    write_texts(top, wanted.tasks)
    write_index(top, {name: TASKS[name].line for name in wanted.tasks}, wanted.key)
    return [known for truth in truths.values() for known in truth]


def _share(top: Path, task: str) -> None:
    folder = top / "tasks" / task
    folder.mkdir(parents=True, exist_ok=True)
    TASKS[task].share(folder)


def _write_record(
    top: Path, task: str, record: str, key: Key | None, table: Literal["parquet", "csv"]
) -> list[Known]:
    made, folder = drawn(task, record, key), record_folder(top, task, record)
    folder.mkdir(parents=True)
    for name, recording in made.recordings().items():
        write_recording(nameless(recording, made.body_told), folder / name, table)
    made.beside(folder)
    return [known for group in made.groups for known in group.known(task, record)]
