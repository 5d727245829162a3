"""The table of tasks, and what is drawn of one."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from armimpedance.core.method_table import RecordTable
from armimpedance.lab.benchmark import VERSION, Key, KnownTruth, seed_of
from armimpedance.lab.benchmark_command.hand_tasks import HAND_TASKS
from armimpedance.lab.benchmark_command.joint_tasks import JOINT_TASKS
from armimpedance.lab.benchmark_command.muscle_tasks import MUSCLE_TASKS
from armimpedance.lab.benchmark_command.task import Made

TASKS: Final = RecordTable({**HAND_TASKS, **JOINT_TASKS, **MUSCLE_TASKS}, "task")


def drawn(task: str, record: str, key: Key | None) -> Made:
    """A record of the public half, or with a key of the sealed one."""
    return TASKS[task].draw(seed_of(VERSION, task, record, key))


def truth_of(task: str, records: Iterable[str], key: Key | None) -> list[KnownTruth]:
    """The truth of some records of one half, made anew."""
    return [
        known
        for record in records
        for group in drawn(task, record, key).groups
        for known in group.known(task, record)
    ]
