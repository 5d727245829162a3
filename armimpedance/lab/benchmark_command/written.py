"""The benchmark's folder as it is written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final, Literal

from armimpedance.core.progress import Progress
from armimpedance.core.workers import crew
from armimpedance.lab.benchmark import (
    VERSION,
    AskedQuantity,
    Key,
    KnownTruth,
    record_folder,
    record_names,
    write_index,
    write_task,
)
from armimpedance.lab.benchmark_command.task import nameless
from armimpedance.lab.benchmark_command.tasks import TASKS, drawn
from armimpedance.recordings import write_recording

# What stands in the benchmark's folder for people: README, licence, citation, datasheet.

_LICENCE: Final = "CC-BY-4.0"
_LICENCE_TEXT: Final = """\
The data of this benchmark, its truths and its texts are licensed under the Creative Commons
Attribution 4.0 International licence (CC-BY-4.0):

https://creativecommons.org/licenses/by/4.0/legalcode

You may share and adapt them for any purpose if you name the source (CITATION.cff) and say what
you changed. The program armimpedance that made them has a licence of its own, BSD-3-Clause.
"""
_CITATION: Final = f"""\
cff-version: 1.2.0
message: "If you use this benchmark, please cite it with its version."
title: "armimpedance benchmark: mechanical impedance of simulated human arms"
version: "{VERSION}"
type: dataset
license: {_LICENCE}
authors:
  - name: "The armimpedance developers"
"""
_README: Final = f"""\
# armimpedance benchmark {VERSION}

Simulated recordings of human arms whose mechanical properties are known. Estimate what each task
asks, write one CSV, have it scored.

- `tasks/<task>/README.md`: what is asked, in which units, what lies in a record.
- `tasks/<task>/public/<record>`: recordings with `truth.csv`, to build a method on.
- `tasks/<task>/sealed/<record>`: recordings alone. Their truth was fixed beforehand:
  `sealed_truth.sha256` is its SHA-256 behind a salt, `benchmark.json` has that of the key.
- `tasks/<task>/asked.csv`: every number that is asked.
- `SHA256SUMS`: `sha256sum -c SHA256SUMS` checks the folder.

A submission is a CSV with the columns `task, record, quantity, value`, and if you have them `low,
high` (95 % interval), `unit`, `warned` (1: the method itself says not to trust this), `time_s` (of
the record). Then:

    armimpedance benchmark score . mine.csv --out mine.json
    armimpedance benchmark table mine.json --out table.md

A recording is a folder of `recording.json` (sample rate, whose force, masses), `trials.csv` and
`samples.parquet` or `samples.csv`, one row a sample.
"""
_PURPOSE: Final = (
    "To compare methods that estimate the mechanical impedance of the human arm, in any language, "
    "on records whose truth is known and in part sealed."
)
#: Answers to what the datasheet's writer leaves to the owner of data, question by question.
_ANSWERS: Final = {
    "Who paid for it?": "Nobody.",
    "Who are the people in it, and could they be recognised?": "There are none: all is simulated.",
    "Is anything missing, or known to be wrong?": (
        "A simulator knows less than a laboratory: what no task holds (fatigue, slipping grips, "
        "learning) says nothing of a method. Masses and heights are left out on purpose."
    ),
    "How were the data measured, and with which devices?": (
        "By `manipulandum_sim` of armimpedance: rigid links, muscles or springs, servos, sensors' "
        "noise and steps, and the unsteadiness of people."
    ),
    "Who took part, when, and how were they chosen and paid?": (
        "Nobody. Simulated persons are drawn at random from ranges that each task's code states."
    ),
    "Did an ethics committee agree, and the participants?": "Not needed: no persons.",
    "What have they been used for?": "The table of methods in armimpedance's documentation.",
    "What should they not be used for?": (
        "To say how accurate a method is on people, or to tune a method on the sealed half."
    ),
    "Who answers questions, and corrects errors?": (
        "The armimpedance developers; a corrected benchmark has another version."
    ),
    "Where are they, under which identifier?": "Where this folder was published.",
}


def task_readme(task: str, asked: Sequence[AskedQuantity]) -> str:
    """README of a task's folder: its questions."""
    rows = [
        f"| {group} | {', '.join(f'`{a.quantity}`' for a in own)} | {own[0].unit} |"
        for group, own in ((g, list(a)) for g, a in groupby(asked, key=lambda a: a.group))
    ]
    table = "\n".join(["| group | quantities | unit |", "| --- | --- | --- |", *rows])
    return f"# {task}\n\n{TASKS[task].line}\n\n{TASKS[task].asks.strip()}\n\n{table}\n"


def write_texts(top: Path, tasks: Sequence[str]) -> None:
    """Write all but the tasks' own."""
    for name, text in {
        "VERSION": f"{VERSION}\n",
        "README.md": _README,
        "LICENSE": _LICENCE_TEXT,
        "CITATION.cff": _CITATION,
    }.items():
        (top / name).write_text(text, encoding="utf-8")
    _write_datasheet(top, tasks)


def _write_datasheet(top: Path, tasks: Sequence[str]) -> None:
    """The datasheet of every task's first record, its open questions answered."""
    from armimpedance import __version__
    from armimpedance.recordings import open_recording
    from armimpedance.show.command.options import SHARED_FORMS

    file = top / "datasheet.md"
    record = record_names("public", 1)[0]
    folders = [
        place.parent
        for task in tasks
        for place in sorted(record_folder(top, task, record).rglob("recording.json"))
    ]
    facts = {
        "name": f"armimpedance benchmark {VERSION}",
        "description": _PURPOSE,
        "creators": ("The armimpedance developers",),
        "licence": _LICENCE,
    }
    recordings = [(folder, open_recording(folder)) for folder in folders]
    SHARED_FORMS["datasheet"].share(recordings, [], file, said=facts, version=__version__)
    lines = file.read_text(encoding="utf-8").split("\n")
    for question, answer in _ANSWERS.items():
        lines[lines.index(f"**{question}**") + 2] = answer
    lines.insert(2, "Recordings, variables and files are those of each task's first record.\n")
    file.write_text("\n".join(lines), encoding="utf-8")


@dataclass(frozen=True)
class Wanted:
    """Specification of the benchmark to be written.

    `count`: records of each half.
    `key`: None: a public half alone.
    `workers`: processes.
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


def write_benchmark(wanted: Wanted, top: Path, progress: Progress) -> list[KnownTruth]:
    """Write everything into an empty folder; the truth of both halves."""
    calls = [(t, r, k) for t in wanted.tasks for r, k in wanted.records.items()]
    truths: dict[str, list[KnownTruth]] = {task: [] for task in wanted.tasks}
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
) -> list[KnownTruth]:
    made, folder = drawn(task, record, key), record_folder(top, task, record)
    folder.mkdir(parents=True)
    for name, recording in made.recordings().items():
        write_recording(nameless(recording, made.body_told), folder / name, table)
    made.beside(folder)
    return [known for group in made.groups for known in group.known(task, record)]
