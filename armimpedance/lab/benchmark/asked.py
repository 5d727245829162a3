"""What a task asks of a record, and what is true there. Standard library only."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

#: Digits of a truth: far below any error, far above what rounding on another machine moves.
DIGITS = 9


class Asked(NamedTuple):
    """One number that a task asks for.

    Attributes
    ----------
    task, record : str
    group : str
        Quantities of one group are scored together, such as the four elements of a stiffness.
    quantity, unit : str
    """

    task: str
    record: str
    group: str
    quantity: str
    unit: str


class Known(NamedTuple):
    """One number that a task asks for, with its truth.

    Attributes
    ----------
    asked : Asked
    value : float
    scale : float
        What errors are told in parts of.
    """

    asked: Asked
    value: float
    scale: float


@dataclass(frozen=True)
class Group:
    """Quantities of one kind in one record, with their truth.

    Attributes
    ----------
    name, unit : str
    values : mapping
        Name of the quantity -> truth.
    scale : float or None
        What errors are told in parts of; None: the root mean square of the values, so that the
        error of a matrix is that of its Frobenius norm.
    """

    name: str
    unit: str
    values: Mapping[str, float]
    scale: float | None = None

    @classmethod
    def matrix(cls, name: str, unit: str, rows: Iterable[Iterable[float]]) -> Group:
        """The elements of a matrix, ``K_11`` to ``K_22``."""
        values = {
            f"{name}_{i}{j}": float(value)
            for i, row in enumerate(rows, 1)
            for j, value in enumerate(row, 1)
        }
        return cls(name, unit, values)

    @classmethod
    def course(
        cls, name: str, unit: str, times_s: Iterable[float], values: Iterable[float]
    ) -> Group:
        """A quantity at times, ``K@0.50``."""
        named = {f"{name}@{t:.2f}": float(v) for t, v in zip(times_s, values, strict=True)}
        return cls(name, unit, named)

    def known(self, task: str, record: str) -> list[Known]:
        """One `Known` a quantity, its numbers rounded as the files hold them."""
        squares = math.fsum(v * v for v in self.values.values())
        scale = math.sqrt(squares / len(self.values)) if self.scale is None else self.scale
        return [
            Known(Asked(task, record, self.name, name, self.unit), rounded(value), rounded(scale))
            for name, value in self.values.items()
        ]


def rounded(value: float) -> float:
    """A number of nine digits."""
    return float(f"{value:.{DIGITS}g}")
