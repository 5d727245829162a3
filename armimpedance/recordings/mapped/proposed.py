"""What is proposed for a file: columns with their units, trials, and questions that stay open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from numpy.typing import NDArray

from armimpedance.recordings.mapped.evidence import Found
from armimpedance.recordings.mapped.names import ReadName, Role, read_name
from armimpedance.recordings.mapped.raw_file import RawRun, RawTable


@dataclass(frozen=True)
class ProposedColumns:
    """Columns of one quantity, and their unit with its reason."""

    columns: tuple[str, ...]
    axes: tuple[str, ...]
    unit: Found


@dataclass(frozen=True)
class ProposedValue:
    """A column of the trial table: where it comes from; `unit` "?" where it has to be told."""

    column: str
    unit: str | None = None


@dataclass
class Proposal:
    """What was found; None or empty where nothing was.

    Attributes
    ----------
    kind : str or None
    rate_hz, rate_from : float or None, str
        The rate and the fact that states it, where no column is the time.
    evidence : tuple of str
        On the sign of the force.
    cannot_tell : list of str
        Questions that only the user can answer.
    others : tuple of str
        Columns without a meaning so far.
    """

    kind: str | None = None
    time: ProposedColumns | None = None
    rate_hz: float | None = None
    rate_from: str = ""
    position: ProposedColumns | None = None
    force: ProposedColumns | None = None
    joint_angles: ProposedColumns | None = None
    emg: ProposedColumns | None = None
    trials: dict[str, Any] = field(default_factory=dict)
    values: dict[str, ProposedValue] = field(default_factory=dict)
    evidence: tuple[str, ...] = ()
    cannot_tell: list[str] = field(default_factory=list)
    others: tuple[str, ...] = ()
    files: str | None = None

    def lines(self) -> tuple[str, ...]:
        """What the columns were taken for, one line each."""
        named = {"time": self.time, "position": self.position, "force": self.force}
        named |= {"joint angles": self.joint_angles, "EMG": self.emg}
        told = [
            f"{name}: {', '.join(s.columns)} in {s.unit.word or '?'} ({s.unit.why})"
            for name, s in named.items()
            if s is not None
        ]
        told += [f"sample rate: {self.rate_hz:g} Hz ({self.rate_from})"] if self.rate_hz else []
        told += [f"trials: by {self.trials['by']}"] if self.trials else []
        told[-1:] = (
            [f"{told[-1]} {self.trials['column']}"] if "column" in self.trials else told[-1:]
        )
        told += [f"{name} of a trial: {value.column}" for name, value in self.values.items()]
        return (*told, *([f"no meaning found: {', '.join(self.others)}"] if self.others else []))


class ReadColumns:
    """The columns of the first run with samples, read by name.

    Attributes
    ----------
    tables, values, names : mapping
        Name -> the table that it is part of, its values, what its name says.
    per_trial : tuple of str
        Columns that stay within each trial.
    """

    def __init__(self, run: RawRun, starred: Mapping[str, Sequence[str]]) -> None:
        self.tables: dict[str, RawTable] = {}
        self.values: dict[str, NDArray[Any]] = {}
        self.names: dict[str, ReadName] = {}
        self.per_trial: tuple[str, ...] = ()
        hidden = {name for names in starred.values() for name in names}
        for table in run.tables:
            for name, column in table.columns.items():
                if name not in hidden:
                    self._add(name, table, column.values, column.unit)
        for pattern, names in starred.items():
            table = next(t for t in run.tables if names[0] in t.columns)
            column = table.columns[names[0]]
            self._add(pattern, table, column.values, column.unit)

    def _add(self, name: str, table: RawTable, values: NDArray[Any], unit: str | None) -> None:
        self.tables[name], self.values[name] = table, values
        self.names[name] = read_name(name, unit)

    def of(self, *roles: Role) -> list[ReadName]:
        """The columns of these roles that hold numbers."""
        return [
            n
            for n in self.names.values()
            if n.role in roles
            and self.values[n.name].dtype.kind == "f"
            and n.name not in self.per_trial
        ]
