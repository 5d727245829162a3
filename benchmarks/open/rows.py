"""From a method to a submission: every record that it takes, one row a number. Standard library."""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple


class Answer(NamedTuple):
    """What a method says of a record: (quantity, value, low, high), and whether it warns."""

    rows: Iterable[tuple[str, float, float | None, float | None]]
    warned: bool = False


#: The folder of a record -> what is said of it.
Method = Callable[[Path], Answer]


def records_of(benchmark: Path, task: str) -> list[Path]:
    """The folders of a task's records, both halves."""
    return sorted(p for p in (benchmark / "tasks" / task).glob("*/*") if p.parent.name in HALVES)


HALVES = ("public", "sealed")


def write_submission(benchmark: Path, out: Path, methods: Mapping[str, Method]) -> None:
    """Run one method a task on all records; what fails says nothing, and why goes to stderr."""
    with out.open("w", newline="", encoding="utf-8") as stream:
        table = csv.writer(stream)
        table.writerow(["task", "record", "quantity", "value", "low", "high", "warned", "time_s"])
        for task, method in methods.items():
            for record in records_of(benchmark, task):
                begun = time.process_time()
                try:
                    answer = method(record)
                    rows = list(answer.rows)
                except Exception as error:  # noqa: BLE001 - a peer may fail with anything
                    print(f"{out.stem} {task} {record.name}: {error!r}"[:300], file=sys.stderr)
                    # a row that says nothing: the task was attempted
                    rows, answer = [(_first(benchmark, task), None, None, None)], Answer([], True)
                spent = f"{time.process_time() - begun:.3f}"
                for quantity, *numbers in rows:
                    cells = ["" if n is None or n != n else repr(float(n)) for n in numbers]
                    if not (cells[1] and cells[2]):
                        cells[1:] = ["", ""]
                    warned = int(answer.warned)
                    table.writerow([task, record.name, quantity, *cells, warned, spent])
            stream.flush()


def _first(benchmark: Path, task: str) -> str:
    """A quantity of the task."""
    with (benchmark / "tasks" / task / "asked.csv").open(encoding="utf-8") as stream:
        return next(csv.DictReader(stream))["quantity"]
