"""A mapping of columns: meaning, unit and sign of each column, and where trials begin."""

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

# Units in files and mappings, and their conversion to SI, which is exact for SI units.

Dimension = Literal["time", "length", "angle", "force", "torque", "emg", "any"]


@dataclass(frozen=True)
class Unit:
    """A unit of measurement.

    `multiply`, `divide`: a value in SI is ``value * multiply / divide``; a factor of 1 changes no
    bit. There are two numbers since 1/1000 is not a double: 12 mm are converted by 12/1000 to the
    nearest double.
    """

    symbol: str
    dimension: Dimension
    multiply: float = 1.0
    divide: float = 1.0

    def to_si(self, values: FloatArray) -> FloatArray:
        """Convert values (N,) to SI."""
        if self.multiply != 1.0:
            values = values * self.multiply
        return values / self.divide if self.divide != 1.0 else values

    @property
    def is_si(self) -> bool:
        """True if values in this unit are in SI already."""
        return self.multiply == self.divide == 1.0


_GRAVITY: Final = 9.80665

#: All units that a mapping can name. "%MVC" and "normalised" are shares of a maximal contraction.
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

#: Other spellings in files; letter case matters only for a prefix.
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
    """Return the unit that a text names, or None.

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
    """Return the unit that a mapping names, of one of these dimensions.

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
    """Return a unit defined by a scale: SI units per unit of the file.

    Raises InputError: the scale is zero or not finite.
    """
    if not np.isfinite(scale) or scale == 0.0:
        raise InputError(f"scale {scale}", expected="a number other than 0")
    return Unit(f"{scale:g} SI", "any", multiply=scale)


#: Ways to cut a run into trials.
CutBy = Literal["run", "column", "gap", "edge", "columns"]
CUTS: tuple[CutBy, ...] = get_args(CutBy)


@dataclass(frozen=True)
class ColumnQuantity:
    """Columns of one quantity, one per axis (or joint, or muscle).

    `columns`: names as in the file; ``*`` stands for the trial's number if trials are side by side.
    `signs`: +1 or -1 for each column; -1 if the file has the opposite sign.
    `time`: the column with the time of these columns, if they have their own clock in the file.
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
    """Begin and end of trials.

    `by`: "run": each file, or each part of it, is a trial. "column": a trial begins where this
    column changes. "gap": where time jumps. "edge": around each rise of a column through a
    threshold. "columns": trials are side by side, as columns with a number in their names.
    `between`: values of the column between trials; those samples are left out.
    `before_s`, `after_s`: time that belongs to a trial before and after its edge.
    `gap_s`: a longer step begins a trial; None: ten times the usual step.
    `pattern`: pattern of the file's name, such as ``"{condition}_{set}"``.
    `disturbance`: a column that is above `disturbance_threshold` during each disturbance.
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
    """A table with one row per trial whose columns are joined to the log.

    `file`: a file beside the log; None: a part of the log's own file.
    `log_key`, `table_key`: the columns of both with a trial's number or name.
    `between`: values of the log's column between trials.
    """

    file: str | None
    log_key: str
    table_key: str
    between: tuple[str, ...] = ()


@dataclass(frozen=True)
class TrialValue:
    """Source of a column of the trial table: a column of the file, or one value for all trials.

    `column`: a column that is constant within each trial or has one value per trial, or a fact of
    the run.
    `value`: value for all trials.
    `unit`: unit of the column; None: as in the name of the trial table's column, or no unit.
    `is_sample`: the column holds the number of a sample, from 1.
    """

    column: str | None = None
    value: float | str | None = None
    unit: Unit | None = None
    is_sample: bool = False


@dataclass(frozen=True)
class ColumnMapping:
    """A whole mapping, checked.

    `file`: the file of the mapping.
    `metadata`: properties of the recording; the sample rate is valid only if `rate_stated`.
    `files`: pattern of the files of a folder, such as ``"trial_*.csv"``; None: all of a known kind.
    `time`: one column; None: time from the file, or from the rate.
    `tables`: trial tables in other files, whose columns count as the log's.
    `position`, `force`: of the hand, or angle and torque of joints.
    `values`: column of the trial table -> its source.
    `keep`: further columns that are kept unchanged.
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
        """Quantities of the mapping by name, without the time."""
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
        """Names of all columns in the mapping, patterns included."""
        all_names = [c for q in self.quantities.values() for c in (*q.columns, q.time)]
        all_names += self.time.columns if self.time is not None else ()
        all_names += [v.column for v in self.values.values()]
        all_names += [self.trials.column, self.trials.disturbance, *self.keep]
        all_names += [name for table in self.tables for name in (table.log_key, table.table_key)]
        return tuple(dict.fromkeys(name for name in all_names if name is not None))

    def wants(self, name: str) -> bool:
        """Return True if the mapping names this column of a file."""
        return any(same_column(pattern, name) for pattern in self.names)


def same_column(pattern: str, name: str) -> bool:
    """Return True if a mapping's name refers to a column; ``*`` is a trial's number or name."""
    if pattern == name or "*" not in pattern:
        return pattern == name
    # brackets are part of MATLAB's names and of units, not sets of letters
    return fnmatchcase(name, pattern.replace("[", "[[]").replace("?", "[?]"))
