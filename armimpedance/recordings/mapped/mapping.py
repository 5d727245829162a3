"""What a mapping says: which column is what, in which unit and sign, where trials begin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from math import pi
from pathlib import Path
from typing import Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError, check_number
from armimpedance.recordings.tables.metadata import Metadata

# Units as files and mappings write them, and how values come to SI without losing a bit in SI.

Dimension = Literal["time", "length", "angle", "force", "torque", "emg", "any"]


@dataclass(frozen=True)
class Unit:
    """A unit of measurement.

    `multiply`, `divide`: a value in SI is ``value * multiply / divide``; a factor of 1 leaves every
    bit as it is. Two numbers, because 1/1000 has no double: 12 mm are 12/1000 m, the double next to
    it.
    """

    symbol: str
    dimension: Dimension
    multiply: float = 1.0
    divide: float = 1.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """The values in SI, (N,)."""
        if self.multiply != 1.0:
            values = values * self.multiply
        return values / self.divide if self.divide != 1.0 else values

    @property
    def is_si(self) -> bool:
        """Whether values in it stand as they are."""
        return self.multiply == self.divide == 1.0


_GRAVITY: Final = 9.80665

#: All units that a mapping can name. "%MVC" and "normalised" are parts of a maximal contraction.
UNITS: Final = {
    unit.symbol: unit
    for unit in (
        Unit("s", "time"),
        Unit("ms", "time", divide=1e3),
        Unit("us", "time", divide=1e6),
        Unit("ns", "time", divide=1e9),
        Unit("min", "time", multiply=60.0),
        Unit("m", "length"),
        Unit("dm", "length", divide=10.0),
        Unit("cm", "length", divide=100.0),
        Unit("mm", "length", divide=1e3),
        Unit("um", "length", divide=1e6),
        Unit("in", "length", multiply=254.0, divide=1e4),
        Unit("rad", "angle"),
        Unit("mrad", "angle", divide=1e3),
        Unit("deg", "angle", multiply=pi, divide=180.0),
        Unit("rev", "angle", multiply=2.0 * pi),
        Unit("N", "force"),
        Unit("mN", "force", divide=1e3),
        Unit("kN", "force", multiply=1e3),
        Unit("kgf", "force", multiply=_GRAVITY),
        Unit("gf", "force", multiply=_GRAVITY, divide=1e3),
        Unit("lbf", "force", multiply=4.4482216152605),
        Unit("N m", "torque"),
        Unit("N cm", "torque", divide=100.0),
        Unit("N mm", "torque", divide=1e3),
        Unit("mN m", "torque", divide=1e3),
        Unit("kgf m", "torque", multiply=_GRAVITY),
        Unit("in lbf", "torque", multiply=4.4482216152605 * 0.0254),
        Unit("V", "emg"),
        Unit("mV", "emg", divide=1e3),
        Unit("uV", "emg", divide=1e6),
        Unit("normalised", "emg"),
        Unit("%MVC", "emg", divide=100.0),
    )
}

#: Other ways in which files write them; letter case counts only where a prefix needs it.
_OTHERS: Final = {
    "s": "sec secs second seconds sekunde sekunden seconde secondes",
    "ms": "msec msecs millisecond milliseconds millisekunden",
    "us": "usec µs μs microsecond microseconds",
    "min": "minute minutes",
    "m": "meter meters metre metres",
    "cm": "centimeter centimeters centimetre centimetres",
    "mm": "millimeter millimeters millimetre millimetres",
    "um": "µm μm",
    "in": "inch inches",
    "rad": "rads radian radians radiant",
    "deg": "degs degree degrees ° grad_deg degrés",
    "rev": "revs turn turns",
    "N": "newton newtons",
    "kgf": "kp kg-f kgforce",
    "lbf": "lb lbs",
    "N m": "nm n·m n*m n.m n-m newtonmeter newtonmeters newton-meters",
    "N cm": "ncm n·cm n*cm n.cm",
    "N mm": "nmm n·mm n*mm n.mm",
    "mN m": "mnm",
    "V": "volt volts",
    "mV": "millivolt millivolts",
    "uV": "µv μv microvolt microvolts",
    "normalised": "normalized mvc norm",
    "%MVC": "%mvc percentmvc",
}
_BY_NAME: Final = {
    **{other: symbol for symbol, others in _OTHERS.items() for other in others.split()},
    **{symbol.lower().replace(" ", ""): symbol for symbol in UNITS},
}


def known_unit(text: str) -> Unit | None:
    """The unit that a text names, or None.

    `text`: such as ``"mm"``, ``"[Nm]"``, ``"N*m"``, ``"Rad"``, ``"µV"``.
    """
    bare = text.strip().strip("[](){}<>").strip()
    if bare in UNITS:
        return UNITS[bare]
    compact = bare.replace(" ", "")
    if compact[:1] == "M" and compact not in ("MVC", "Meter", "Meters", "Metre", "Metres"):
        return None  # mega is not milli
    symbol = _BY_NAME.get(compact.lower())
    return None if symbol is None else UNITS[symbol]


def unit_of(text: str, *dimensions: Dimension) -> Unit:
    """The unit that a mapping names, of one of these dimensions.

    Raises InputError: there is no such unit, or it measures something else.
    """
    unit = known_unit(text)
    expected = ", ".join(u.symbol for u in UNITS.values() if u.dimension in dimensions)
    if unit is None:
        raise InputError(f"unknown unit {text!r}", expected=f"one of {expected}, or a scale")
    if unit.dimension not in dimensions:
        wanted = " or ".join(dimensions)
        raise InputError(f"{text!r} is no unit of {wanted}", expected=f"one of {expected}")
    return unit


def scaled(scale: float) -> Unit:
    """A unit of the user's own: SI units per unit of the file.

    Raises InputError: zero or not finite.
    """
    if not np.isfinite(scale) or scale == 0.0:
        raise InputError(f"scale {scale}", expected="a number other than 0")
    return Unit(f"{scale:g} SI", "any", multiply=scale)


#: How a stretch of recording falls into trials.
CutBy = Literal["run", "column", "gap", "edge", "columns"]
CUTS: tuple[CutBy, ...] = get_args(CutBy)


@dataclass(frozen=True)
class ColumnQuantity:
    """Columns of one quantity, one an axis (or joint, or muscle).

    `columns`: names as the file has them; a ``*`` stands for the trial's number where trials stand
    side by side.
    `signs`: +1 or -1 for each column: -1 where the file counts the other way round.
    `time`: the column with the time of these, where they have a clock of their own in the file.
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

    `by`: "run": each file, or each part of it, is a trial. "column": where this column changes.
    "gap": where time jumps. "edge": around each rise of a column through a threshold. "columns":
    trials stand side by side, as columns with a number in their names.
    `between`: values of the column between trials; those samples are left out.
    `before_s`, `after_s`: how much of the record belongs to a trial before and after its edge.
    `gap_s`: a longer step begins a trial; None: ten times the usual step.
    `pattern`: what the file's name says, such as ``"{condition}_{set}"``.
    `disturbance`: a column that is over `disturbance_threshold` from the onset of each disturbance
    to its end.
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
        if self.gap_s is not None:
            check_number(self.gap_s, f"gap_s = {self.gap_s}", above=0, unit="s")


@dataclass(frozen=True)
class JoinedTable:
    """A table with one row a trial whose columns join those of the log.

    `file`: beside the log; None: a part of the log's own file.
    `log_key`, `table_key`: the columns of both that hold a trial's number or name.
    `between`: what stands in the log's between trials.
    """

    file: str | None
    log_key: str
    table_key: str
    between: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrialValue:
    """What a column of the trial table holds: the value of a column, or the same for all trials.

    `column`: a column that is constant within each trial, holds one value a trial, or a fact of the
    run.
    `value`: for all trials.
    `unit`: of the column; None: as the name of the trial table's column says, or none.
    `is_sample`: the column holds the number of a sample, from 1.
    """

    column: str | None = None
    value: float | str | None = None
    unit: Unit | None = None
    is_sample: bool = False


@dataclass(frozen=True)
class ColumnMapping:
    """A whole mapping, checked.

    `file`: where it was read.
    `metadata`: what holds for the recording; its sample rate counts only where `rate_stated`.
    `files`: which files of a folder are read, such as ``"trial_*.csv"``; None: all of a known kind.
    `time`: one column; None: the file knows it, or the rate tells.
    `tables`: trial tables of other files, whose columns count as the log's.
    `position`, `force`: of the hand, or angle and torque of joints.
    `values`: column of the trial table -> what it holds.
    `keep`: further columns that are kept as they are.
    """

    file: Path
    metadata: Metadata
    rate_stated: bool
    position: ColumnQuantity
    force: ColumnQuantity
    files: str | None = None
    time: ColumnQuantity | None = None
    joint_angles: ColumnQuantity | None = None
    emg: ColumnQuantity | None = None
    commanded: ColumnQuantity | None = None
    added_torque: ColumnQuantity | None = None
    tables: tuple[JoinedTable, ...] = ()
    trials: TrialCut = TrialCut()
    values: Mapping[str, TrialValue] = field(default_factory=dict)
    keep: tuple[str, ...] = ()

    @property
    def quantities(self) -> dict[str, ColumnQuantity]:
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
        found += [name for table in self.tables for name in (table.log_key, table.table_key)]
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
