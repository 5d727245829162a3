"""Protocols of an engine: it has named tasks done anywhere, and yields their outcomes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar


class Named(Protocol):
    """A task, or its outcome, with a name of its own."""

    @property
    def name(self) -> str:
        """Unlike that of any other task."""


Asked = TypeVar("Asked", bound=Named)
Given = TypeVar("Given", bound=Named)
_Asked = TypeVar("_Asked", bound=Named, contravariant=True)
_Given = TypeVar("_Given", bound=Named, covariant=True)


class Work(Protocol[_Asked, _Given]):
    """Work to be done on a task; it can be sent to another process or machine.

    Done twice, it comes to the same: where a worker was killed it is done again.
    """

    def __call__(self, task: _Asked) -> _Given:
        """Do the task; the outcome has the task's name."""

    def failed(self, task: _Asked, problem: str) -> _Given:
        """The outcome of a task that could not be completed, with the reason."""


class Engine(Protocol):
    """Processes of this machine, workers on many, ...: one file an engine."""

    def __call__(self, work: Work[Asked, Given], tasks: Iterable[Asked]) -> Iterator[Given]:
        """Yield the outcome of each task, in any order.

        `tasks`: of names that differ.
        """
