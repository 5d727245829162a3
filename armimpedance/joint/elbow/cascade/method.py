"""What the table of methods for two pathways holds of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from armimpedance.joint.elbow.cascade.found import Found
from armimpedance.joint.elbow.cascade.task import Task


@dataclass(frozen=True)
class Courses:
    """What a method hands over: courses at the cells, the last noise, and what it says of them."""

    found: Found
    task: Task
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class CascadeMethod:
    """A method for I, B, K and the reflex's gain, given the pathway.

    Attributes
    ----------
    name, description, reference : str
    realizations : int
        Trials of the same course that it needs.
    estimate : function
    """

    name: str
    description: str
    reference: str
    realizations: int
    estimate: Callable[[Task], Courses]
