"""What an engine is: it has named tasks done, wherever, and gives what each came to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar


class Named(Protocol):
    """What has a name of its own: a task, and what it came to."""

    @property
    def name(self) -> str:
        """Unlike that of any other task."""


Asked = TypeVar("Asked", bound=Named)
Given = TypeVar("Given", bound=Named)
_Asked = TypeVar("_Asked", bound=Named, contravariant=True)
_Given = TypeVar("_Given", bound=Named, covariant=True)


class Work(Protocol[_Asked, _Given]):
    """What is done with a task; it can be sent to another process or machine.

    Done twice, it comes to the same: where a worker was killed it is done again.
    """

    def __call__(self, task: _Asked) -> _Given:
        """What the task came to, under the task's name."""

    def failed(self, task: _Asked, problem: str) -> _Given:
        """What stands for a task that could not be ended, and why."""


class Engine(Protocol):
    """Processes of this machine, workers on many, ...: one file an engine."""

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """What each task came to, in any order.

        `tasks`: of names that differ.
        """
