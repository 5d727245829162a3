"""`columns.toml`: a mapping as a text that a user can edit, checked key by key."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final, cast

from armimpedance.core.errors import InputError
from armimpedance.core.inputs import read_toml
from armimpedance.core.json_text import Fields, is_number
from armimpedance.recordings.mapped.mapping import (
    CUTS,
    ColumnMapping,
    ColumnQuantity,
    CutBy,
    Dimension,
    JoinedTable,
    TrialCut,
    TrialValue,
    Unit,
    known_unit,
    scaled,
    unit_of,
)
from armimpedance.recordings.mapped.raw_file import plain
from armimpedance.recordings.tables.metadata import metadata_of
from armimpedance.recordings.tables.trial_table import NUMBER_COLUMNS

MAPPING_FILE: Final = "columns.toml"
#: Placeholder for a word that the user must still decide.
UNDECIDED: Final = "?"

_OF_THE_RECORDING: Final = {
    *("kind", "sample_rate_hz", "perturbation", "torque", "imposed", "handle_mass_kg"),
    *("force_lowpass_hz", "force_lowpass_order"),
    *("shoulder_m", "gravity", "subject", "provenance"),
}
_SECTIONS: Final = {
    *("time", "position", "force", "joint_angles", "emg", "commanded", "added_torque", "trials"),
    "subject",
}
_OF_COLUMNS: Final = {"columns", "unit", "scale", "sign", "time"}
_OF_TABLES: Final = {"file", "key"}
_OF_TRIALS: Final = {
    *("by", "column", "between", "threshold", "before_s", "after_s", "gap_s", "pattern"),
    *("disturbance", "disturbance_threshold", "columns"),
}
#: Ending of a trial column's name -> symbol of its unit.
_UNIT_OF_ENDING: Final = {"_s": "s", "_deg": "deg", "_rad": "rad", "_m": "m", "_N": "N"}


def read_mapping(file: Path) -> ColumnMapping:
    """Read and check a mapping.

    Raises InputError: the file is missing or no TOML, or a key is unknown, missing, undecided or
    wrong; the message names the line and the key.
    """
    values, text = read_toml(file, "a mapping; `armimpedance map-columns` proposes one")
    return mapping_of_values(values, file, text)


def mapping_of_values(values: dict[str, Any], file: Path, text: str = "") -> ColumnMapping:
    """Build a mapping from the values of a `columns.toml`.

    `file`, `text`: file and text, for the names and lines in messages.
    Raises InputError: as `read_mapping`.
    """
    reader = _Reader(file, text)
    reader.refuse_undecided(values)
    reader.refuse_unknown(values, _OF_THE_RECORDING | _SECTIONS | {"files", "keep", "tables"})
    for name in _SECTIONS & set(values):
        if not isinstance(values[name], dict):
            raise reader.wrong("", name, f"a section [{name}]")
    return reader.mapping(values)


class _Reader:
    """Reader of the values of a mapping; its errors name the line of a key."""

    def __init__(self, file: Path, text: str) -> None:
        self.file, self.lines = file, text.splitlines()

    def row(self, section: str, key: str) -> int | None:
        """Return the line of a key, or of its section."""
        current, section_line = "", None
        for number, line in enumerate(self.lines, start=1):
            head = re.match(r"\s*\[+\s*([^\]]+?)\s*\]+", line)
            if head:
                current = head.group(1).replace('"', "")
                section_line = (
                    number if current == section and section_line is None else section_line
                )
            elif current == section and re.match(rf'\s*"?{re.escape(key)}"?\s*[=.]', line):
                return number
        return section_line

    def error(self, problem: str, section: str, key: str, expected: str) -> InputError:
        """Return the error of a key, with its line."""
        return InputError(
            problem,
            file=self.file,
            row=self.row(section, key),
            column=f"{section}.{key}" if section else key,
            expected=expected,
        )

    def wrong(self, section: str, key: str, expected: str, value: object = None) -> InputError:
        """Return the error of a value that is missing or wrong."""
        shown = json.dumps(value, default=str, ensure_ascii=False)[:40]
        problem = "is missing" if value is None else f"is {shown}"
        return self.error(problem, section, key, expected)

    def refuse_unknown(
        self, values: Mapping[str, Any], known: Collection[str], at: str = ""
    ) -> None:
        for key in values:
            if key not in known:
                raise self.error("unknown key", at, key, ", ".join(sorted(known)))

    def refuse_undecided(self, values: Mapping[str, Any], at: str = "") -> None:
        """Refuse a "?" in any value."""
        for key, value in values.items():
            inside = value if isinstance(value, list) else [value]
            if UNDECIDED in [v for v in inside if isinstance(v, str)]:
                raise self.error("is not decided yet", at, key, "your word in place of the ?")
            if isinstance(value, dict):
                self.refuse_undecided(value, f"{at}.{key}" if at else key)

    def mapping(self, values: dict[str, Any]) -> ColumnMapping:
        """Build the whole mapping."""
        kind = values.get("kind")
        if kind not in ("hand", "joint"):
            raise self.wrong("", "kind", '"hand" or "joint"', kind)
        dimension: Dimension = "length" if kind == "hand" else "angle"
        push: Dimension = "force" if kind == "hand" else "torque"
        emg, muscles, emg_unit = self.emg(values)
        metadata = self.metadata(values, muscles, emg_unit)
        try:
            return ColumnMapping(
                file=self.file,
                metadata=metadata,
                rate_stated="sample_rate_hz" in values,
                position=self.quantity(values, "position", dimension),
                force=self.quantity(values, "force", push, {"by"}),
                files=self.text("", "files", values),
                time=self.time(values),
                joint_angles=self.optional(values, "joint_angles", "angle"),
                emg=emg,
                commanded=self.optional(values, "commanded", dimension),
                added_torque=self.optional(values, "added_torque", "torque"),
                tables=self.tables(values.get("tables", []), values.get("trials", {})),
                trials=self.trials(values.get("trials", {})),
                values=self.trial_values(values.get("trials", {}).get("columns", {})),
                keep=self.texts("", "keep", values) or (),
            )
        except InputError as error:
            if error.file is not None:
                raise
            raise InputError(error.problem, file=self.file, expected=error.expected) from None

    def metadata(self, values: dict[str, Any], muscles: tuple[str, ...], emg_unit: str) -> Any:
        """Read the data of the recording as a whole, with the checks of `recording.json`."""
        by = values.get("force", {}).get("by")
        if by not in ("limb", "device"):
            expected = (
                '"limb" (the limb\'s force on the device) or "device" (the device\'s on the limb)'
            )
            raise self.wrong("force", "by", expected, by)
        fields = {k: v for k, v in values.items() if k in _OF_THE_RECORDING}
        self.refuse_unknown(
            values.get("subject", {}),
            ("id", "mass_kg", "height_m", "upper_arm_m", "forearm_hand_m", "mass_sd_kg")
            + ("length_sd_m",),
            "subject",
        )
        fields |= {"force_by": by, "muscles": list(muscles), "emg_unit": emg_unit}
        fields.setdefault("sample_rate_hz", 1.0)
        try:
            return metadata_of(_TomlFields(self.file, fields))
        except InputError as error:
            section, _, key = (error.column or "").rpartition(".")
            raise self.error(error.problem, section, key, error.expected or "") from None

    def optional(
        self, values: dict[str, Any], name: str, dimension: Dimension
    ) -> ColumnQuantity | None:
        """Read a quantity that is optional."""
        return self.quantity(values, name, dimension) if name in values else None

    def quantity(
        self,
        values: dict[str, Any],
        name: str,
        dimension: Dimension,
        further: Collection[str] = (),
    ) -> ColumnQuantity:
        """Read a section with columns, unit or scale, and signs."""
        section = values.get(name)
        if section is None:
            raise self.wrong("", name, f"a section [{name}] with its columns")
        self.refuse_unknown(section, _OF_COLUMNS | set(further), name)
        columns = self.texts(name, "columns", section, required=True) or ()
        return self.made(name, section, columns, dimension)

    def made(
        self, name: str, section: dict[str, Any], columns: tuple[str, ...], *dimensions: Dimension
    ) -> ColumnQuantity:
        """Build the quantity of these columns."""
        sign = section.get("sign", 1)
        signs = tuple(sign) if isinstance(sign, list) else (sign,) * len(columns)
        if any(isinstance(s, bool) or s not in (1, -1) for s in signs):
            raise self.wrong(name, "sign", "1 or -1, or a list of them, one a column", sign)
        unit = self.unit(name, section, *dimensions)
        time = self.text(name, "time", section)
        try:
            return ColumnQuantity(columns, unit, tuple(int(s) for s in signs), time)
        except InputError as error:
            key = "sign" if error.problem == "sign" else "columns"
            raise self.error(error.problem, name, key, error.expected or "") from None

    def unit(self, name: str, section: dict[str, Any], *dimensions: Dimension) -> Unit:
        """Read the unit of a section, or its scale."""
        scale, text = section.get("scale"), section.get("unit")
        if (scale is None) == (text is None):
            problem = "is missing" if text is None else "and scale are both there"
            expected = 'a unit such as "mm", or a scale (SI units per unit of the file)'
            raise self.error(problem, name, "unit", expected)
        try:
            if text is None:
                return scaled(float(cast(float, scale))) if is_number(scale) else scaled(0.0)
            return unit_of(str(text), *dimensions)
        except InputError as error:
            key = "unit" if text is not None else "scale"
            raise self.error(error.problem, name, key, error.expected or "") from None

    def time(self, values: dict[str, Any]) -> ColumnQuantity | None:
        """Read the column with the time; None without this section."""
        section = values.get("time")
        if section is None:
            return None
        self.refuse_unknown(section, {"column", "unit", "scale"}, "time")
        column = self.text("time", "column", section, required=True)
        return self.made("time", section, (str(column),), "time")

    def emg(self, values: dict[str, Any]) -> tuple[ColumnQuantity | None, tuple[str, ...], str]:
        """Read the EMG, its muscles, and its unit, "V" or "normalised"."""
        section = values.get("emg")
        if section is None:
            return None, (), "V"
        self.refuse_unknown(section, {"muscles", "unit", "scale", "sign", "time"}, "emg")
        muscles = section.get("muscles")
        if not isinstance(muscles, dict) or not all(isinstance(v, str) for v in muscles.values()):
            raise self.wrong("emg", "muscles", 'such as { biceps_long = "EMG 1" }', muscles)
        quantity = self.made("emg", section, tuple(muscles.values()), "emg")
        normalised = quantity.unit.symbol in ("normalised", "%MVC")
        return quantity, tuple(muscles), "normalised" if normalised else "V"

    def tables(self, sections: Any, trials: dict[str, Any]) -> tuple[JoinedTable, ...]:
        """Read the tables with one row per trial: file, and the columns that join them."""
        expected = '[[tables]] with file = "trials.csv" and key = "trial"'
        if not isinstance(sections, list) or not all(
            isinstance(section, dict) for section in sections
        ):
            raise self.wrong("", "tables", expected, sections)
        between = trials.get("between", [])
        between = between if isinstance(between, list) else [between]
        return tuple(self.table(section, tuple(map(plain, between))) for section in sections)

    def table(self, section: dict[str, Any], between: tuple[str, ...]) -> JoinedTable:
        """Read one table to join."""
        self.refuse_unknown(section, _OF_TABLES, "tables")
        file, key = self.text("tables", "file", section), section.get("key")
        if file is not None and (Path(file).is_absolute() or ".." in Path(file).parts):
            raise self.wrong("tables", "file", "a file beside the log, or in a folder there", file)
        keys = {"log": key, "table": key} if isinstance(key, str) else key
        if not isinstance(keys, dict) or set(keys) != {"log", "table"}:
            expected = 'a column of both, or { log = "TrialNr", table = "trial" }'
            raise self.wrong("tables", "key", expected, key)
        names = [self.text("tables", name, keys, required=True) for name in ("log", "table")]
        return JoinedTable(file, str(names[0]), str(names[1]), between)

    def trials(self, section: dict[str, Any]) -> TrialCut:
        """Read where trials begin and end."""
        self.refuse_unknown(section, _OF_TRIALS, "trials")
        by = section.get("by", "run")
        if by not in CUTS:
            raise self.wrong("trials", "by", " or ".join(f'"{c}"' for c in CUTS), by)
        numbers = ("threshold", "before_s", "after_s", "gap_s", "disturbance_threshold")
        settings: dict[str, Any] = {}
        for key in numbers:
            if key in section and not is_number(section[key]):
                raise self.wrong("trials", key, "a number", section[key])
            settings |= {key: float(section[key])} if key in section else {}
        for key in ("column", "pattern", "disturbance"):
            settings[key] = self.text("trials", key, section)
        between = section.get("between", [])
        between = between if isinstance(between, list) else [between]
        if not all(isinstance(v, str) or is_number(v) for v in between):
            raise self.wrong("trials", "between", "values of the column, such as [0]", between)
        try:
            return TrialCut(by=cast(CutBy, by), between=tuple(between), **settings)
        except InputError as error:
            raise self.error(error.problem, "trials", "by", error.expected or "") from None

    def trial_values(self, section: Any) -> dict[str, TrialValue]:
        """Read the columns of the trial table."""
        if not isinstance(section, dict):
            raise self.wrong("trials", "columns", 'such as { condition = "cond" }', section)
        return {name: self.trial_value(name, entry) for name, entry in section.items()}

    def trial_value(self, name: str, entry: Any) -> TrialValue:
        """Read one column of the trial table: a column's name, or a table with column or value."""
        key = f"trials.columns.{name}"
        inner = {"column": entry} if isinstance(entry, str) else entry
        expected = 'a column\'s name, { column = "dir", unit = "deg" } or { value = "relaxed" }'
        if not isinstance(inner, dict) or ("column" in inner) == ("value" in inner):
            raise self.wrong("trials.columns", name, expected, entry)
        self.refuse_unknown(inner, {"column", "value", "unit"}, key)
        value, column, unit = inner.get("value"), inner.get("column"), inner.get("unit")
        is_name = isinstance(column, str) and column != ""
        is_valid = is_name if value is None else isinstance(value, str) or is_number(value)
        if not is_valid:
            raise self.wrong("trials.columns", name, expected, entry)
        if name in NUMBER_COLUMNS and isinstance(value, str):
            raise self.wrong("trials.columns", name, "a number", value)
        is_sample = unit == "sample" and name.endswith("_s")
        return TrialValue(
            column=column,
            value=value if isinstance(value, str) or value is None else float(value),
            unit=None if unit is None or is_sample else self.value_unit(name, unit),
            is_sample=is_sample,
        )

    def value_unit(self, name: str, unit: object) -> Unit:
        """Read the unit of a trial's value, which must fit the ending of its name."""
        endings = [e for e in _UNIT_OF_ENDING if name.endswith(e)]
        stated = known_unit(unit) if isinstance(unit, str) else None
        expected_unit = UNITS_OF_ENDINGS[endings[0]] if endings else None
        if stated is None or expected_unit is None or stated.dimension != expected_unit.dimension:
            expected = (
                f"a unit of {expected_unit.dimension}"
                if expected_unit
                else "none: the name has no unit"
            )
            raise self.wrong("trials.columns", name, expected, unit)
        return stated

    def text(
        self, section: str, key: str, values: Mapping[str, Any], required: bool = False
    ) -> str | None:
        """Read a text that is not empty."""
        value = values.get(key)
        if (value is None and required) or not (
            value is None or (isinstance(value, str) and value.strip())
        ):
            raise self.wrong(section, key, "a text", value)
        return value

    def texts(
        self, section: str, key: str, values: Mapping[str, Any], required: bool = False
    ) -> tuple[str, ...] | None:
        """Read a list of texts; a single text counts as a list."""
        value = values.get(key)
        if isinstance(value, str):
            value = [value]
        if value is None and not required:
            return None
        if not isinstance(value, list) or not value or not all(isinstance(v, str) for v in value):
            raise self.wrong(section, key, "names of columns", value)
        return tuple(value)


class _TomlFields(Fields):
    """Fields of a TOML table, whose values may be other types than JSON's."""

    def wrong(self, key: str, expected: str) -> InputError:
        shown = json.dumps(self.values.get(key), default=str, ensure_ascii=False)[:40]
        problem = f"is {shown}" if key in self.values else "is missing"
        return InputError(problem, file=self.file, column=self.prefix + key, expected=expected)


#: Ending of a trial column's name -> its unit in a recording.
UNITS_OF_ENDINGS: Final = {
    ending: unit for ending, symbol in _UNIT_OF_ENDING.items() if (unit := known_unit(symbol))
}
