"""What a mapping says: which column is what, in which unit and sign, where trials begin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Literal, get_args

from armimpedance.core.errors import InputError
from armimpedance.recordings.mapped.units import Unit
from armimpedance.recordings.tables.metadata import Metadata

#: How a stretch of recording falls into trials.
CutBy = Literal["run", "column", "gap", "edge", "columns"]
CUTS: tuple[CutBy, ...] = get_args(CutBy)


@dataclass(frozen=True)
class Quantity:
    """Columns of one quantity, one an axis (or joint, or muscle).

    Attributes
    ----------
    columns : tuple of str
        Names as the file has them; a ``*`` stands for the trial's number where trials stand side
        by side.
    unit : Unit
    signs : tuple of int
        +1 or -1 for each column: -1 where the file counts the other way round.
    time : str or None
        The column with the time of these, where they have a clock of their own in the file.
    """

    columns: tuple[str, ...]
    unit: Unit
    signs: tuple[int, ...]
    time: str | None = None

    def __post_init__(self) -> None:
        if not self.columns or len(set(self.columns)) < len(self.columns):
            raise InputError("columns are missing or stand twice", expected="different columns")
        if len(self.signs) != len(self.columns) or set(self.signs) - {1, -1}:
            raise InputError("sign", expected="1 or -1, or one of them for each column")


@dataclass(frozen=True)
class TrialCut:
    """Where trials begin and end.

    Attributes
    ----------
    by : str
        "run": each file, or each part of it, is a trial. "column": where this column changes.
        "gap": where time jumps. "edge": around each rise of a column through a threshold.
        "columns": trials stand side by side, as columns with a number in their names.
    column : str or None
    between : tuple of float or str
        Values of the column between trials; those samples are left out.
    threshold : float
    before_s, after_s : float
        How much of the record belongs to a trial before and after its edge.
    gap_s : float or None
        A longer step begins a trial; None: ten times the usual step.
    pattern : str or None
        What the file's name says, such as ``"{condition}_{set}"``.
    disturbance : str or None
        A column that is over `disturbance_threshold` from the onset of each disturbance to its end.
    """

    by: CutBy = "run"
    column: str | None = None
    between: tuple[float | str, ...] = ()
    threshold: float = 0.5
    before_s: float = 0.0
    after_s: float = 0.0
    gap_s: float | None = None
    pattern: str | None = None
    disturbance: str | None = None
    disturbance_threshold: float = 0.5

    def __post_init__(self) -> None:
        if self.by not in CUTS:
            raise InputError(f"by = {self.by!r}", expected=", ".join(CUTS))
        if (self.by in ("column", "edge")) != (self.column is not None):
            needed = "a column" if self.column is None else "no column"
            raise InputError(f"trials by {self.by}", expected=needed)
        if self.by == "edge" and not (self.before_s >= 0 and self.after_s > 0):
            raise InputError("trials by edge", expected="before_s from 0 and after_s above 0")
        if self.gap_s is not None and not self.gap_s > 0:
            raise InputError(f"gap_s = {self.gap_s}", expected="more than 0 s")


@dataclass(frozen=True)
class TrialValue:
    """What a column of the trial table holds: the value of a column, or the same for all trials.

    Attributes
    ----------
    column : str or None
        A column that is constant within each trial, holds one value a trial, or a fact of the run.
    value : float, str or None
        For all trials.
    unit : Unit or None
        Of the column; None: as the name of the trial table's column says, or none.
    is_sample : bool
        The column holds the number of a sample, from 1.
    """

    column: str | None = None
    value: float | str | None = None
    unit: Unit | None = None
    is_sample: bool = False


@dataclass(frozen=True)
class ColumnMapping:
    """A whole mapping, checked.

    Attributes
    ----------
    file : Path
        Where it was read.
    metadata : Metadata
        What holds for the recording; its sample rate counts only where `rate_stated`.
    rate_stated : bool
    files : str or None
        Which files of a folder are read, such as ``"trial_*.csv"``; None: all of a known kind.
    time : Quantity or None
        One column; None: the file knows it, or the rate tells.
    position, force : Quantity
        Of the hand, or angle and torque of joints.
    joint_angles, emg, commanded, added_torque : Quantity or None
    trials : TrialCut
    values : mapping
        Column of the trial table -> what it holds.
    keep : tuple of str
        Further columns that are kept as they are.
    """

    file: Path
    metadata: Metadata
    rate_stated: bool
    position: Quantity
    force: Quantity
    files: str | None = None
    time: Quantity | None = None
    joint_angles: Quantity | None = None
    emg: Quantity | None = None
    commanded: Quantity | None = None
    added_torque: Quantity | None = None
    trials: TrialCut = TrialCut()
    values: Mapping[str, TrialValue] = field(default_factory=dict)
    keep: tuple[str, ...] = ()

    @property
    def quantities(self) -> dict[str, Quantity]:
        """The quantities that are given, by name; not the time."""
        named = {
            "position": self.position,
            "force": self.force,
            "joint_angles": self.joint_angles,
            "emg": self.emg,
            "commanded": self.commanded,
            "added_torque": self.added_torque,
        }
        return {name: quantity for name, quantity in named.items() if quantity is not None}

    @property
    def names(self) -> tuple[str, ...]:
        """All columns that it names, patterns included."""
        found = [c for q in self.quantities.values() for c in (*q.columns, q.time)]
        found += self.time.columns if self.time is not None else ()
        found += [v.column for v in self.values.values()]
        found += [self.trials.column, self.trials.disturbance, *self.keep]
        return tuple(dict.fromkeys(name for name in found if name is not None))

    def wants(self, name: str) -> bool:
        """Whether it names this column of a file."""
        return any(same_column(pattern, name) for pattern in self.names)


def same_column(pattern: str, name: str) -> bool:
    """Whether a name of the mapping means a column; ``*`` stands for a trial's number or name."""
    if pattern == name or "*" not in pattern:
        return pattern == name
    # Brackets are part of MATLAB's and of units' names, no sets of letters.
    return fnmatchcase(name, pattern.replace("[", "[[]").replace("?", "[?]"))
