"""The benchmark's folder as it is written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from armimpedance.benchmark import (
    Key,
    Known,
    record_folder,
    record_names,
    write_index,
    write_task,
)
from armimpedance.cli.benchmark.task import TASKS, drawn, nameless
from armimpedance.cli.benchmark.texts import task_readme, write_texts
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
    """

    tasks: tuple[str, ...]
    count: int
    key: Key | None
    table: Literal["parquet", "csv"]

    @property
    def records(self) -> dict[str, Key | None]:
        """Names of a task's records -> what they are drawn with."""
        public = dict.fromkeys(record_names("public", self.count))
        sealed = dict.fromkeys(record_names("sealed", self.count), self.key)
        return public if self.key is None else public | sealed


def write_benchmark(wanted: Wanted, top: Path, progress: Callable[[int, int], None]) -> None:
    """Write everything into an empty folder."""
    done, total = 0, len(wanted.tasks) * len(wanted.records)
    for task in wanted.tasks:
        truth: list[Known] = []
        for record, key in wanted.records.items():
            truth += _write_record(top, task, record, key, wanted.table)
            done += 1
            progress(done, total)
        write_task(top, task, truth, wanted.key)
        first = [k.asked for k in truth if k.asked.record == truth[0].asked.record]
        readme = top / "tasks" / task / "README.md"
        readme.write_text(task_readme(task, first), encoding="utf-8")
    write_texts(top, wanted.tasks)
    write_index(top, {name: TASKS[name].line for name in wanted.tasks}, wanted.key)


def _write_record(
    top: Path, task: str, record: str, key: Key | None, table: Literal["parquet", "csv"]
) -> list[Known]:
    made, folder = drawn(task, record, key), record_folder(top, task, record)
    folder.mkdir(parents=True)
    for name, recording in made.recordings().items():
        write_recording(nameless(recording, made.body_told), folder / name, table)
    made.beside(folder)
    return [known for group in made.groups for known in group.known(task, record)]
