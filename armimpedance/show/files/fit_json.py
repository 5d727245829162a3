"""FIT.json: what a fit says of itself, for scripts; in every other format a row a parameter.

null stands in JSON where there is no finite value.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from armimpedance.core.described import Column, Meaning, cells, meaning_in, meanings
from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.json_text import read_json
from armimpedance.numerics.regression import PARAMETER_ROW, FitSummary, NamedParameter
from armimpedance.show.files.content import About, Content, Quantity
from armimpedance.show.files.tables import table_content
from armimpedance.show.files.words import number

_METHOD: Final = Column[Any]("method", "method of the fit")
#: A fitted number as a row: what the columns are.
FIT_COLUMNS: Final[tuple[Column[Any], ...]] = (*PARAMETER_ROW, _METHOD)


def fit_content(
    summary: FitSummary, told: Mapping[str, Any], known: Mapping[str, Meaning]
) -> Content:
    """The content of a fit's file: FIT.json itself, or one row per parameter in other formats.

    Parameters
    ----------
    summary : FitSummary
    told : mapping
        What FIT.json holds.
    known : mapping
        What the parameters are, by their names.

    Returns
    -------
    Content
    """
    rows = [{**cells(PARAMETER_ROW, one), "method": summary.method} for one in summary.parameters]
    check_sentences = {check.sentence for check in summary.checks}
    more = (Finding("", "warning", w) for w in summary.warnings if w not in check_sentences)
    return table_content(
        rows,
        described=meanings(FIT_COLUMNS),
        quantities=lambda: [_quantity(row, known) for row in rows],
        objects=lambda: told,
        structs=lambda: [{**told, "warnings": summary.warnings}],
        about=About(checks=(*summary.checks, *more)),
    )


def _quantity(row: Mapping[str, Any], known: Mapping[str, Meaning]) -> Quantity:
    keys = {name: row[name] for name in ("joint", "method") if name in row}
    more = {name: row[name] for name in ("rel_sd_percent", "well_identified")}
    name = row["parameter"]
    means = meaning_in(known, name)
    return Quantity(
        keys,
        name,
        name.replace("_", " ") if means is None else means.words,
        number(row["value"]),
        number(row["ci_low"]),
        number(row["ci_high"]),
        number(row["sd_robust"]),
        row["unit"],
        more=more,
    )


def read_parameter(path: str | Path, name: str, joint: int | None = None) -> NamedParameter:
    """One parameter of a FIT.json; its degrees of freedom are not in the file.

    Parameters
    ----------
    path : path
        The FIT.json.
    name : str
        Name of the parameter, for example ``k``.
    joint : int, optional
        Number of its joint, where several joints have a parameter of this name.

    Returns
    -------
    NamedParameter
        The value, its standard errors and its unit.

    Raises
    ------
    InputError
        Not such a file, no such parameter, or one of several joints and none was named.
    """
    content = _load(Path(path))
    named = [p for p in content if p.get("name") == name]
    matching = [p for p in named if joint is None or p.get("joint") == joint]
    if not matching:
        labels = ", ".join(_label(p) for p in content)
        wanted = name if joint is None else f"{name} of joint {joint}"
        raise InputError(f"no parameter {wanted}", file=path, expected=f"one of {labels}")
    if len(matching) > 1:
        joints = ", ".join(str(p.get("joint")) for p in matching)
        raise InputError(f"{name} of several joints", file=path, expected=f"a joint: {joints}")
    entry = matching[0]
    keys = ("value", "sd", "sd_robust")
    if any(type(entry.get(key)) not in (int, float) for key in keys):
        raise InputError(f"{name} has no finite value and standard errors", file=path)
    value, sd, robust = (float(entry[key]) for key in keys)
    return NamedParameter(name, value, sd, robust, str(entry.get("unit", "")), joint=joint)


def _load(path: Path) -> list[dict[str, Any]]:
    content = read_json(path, "a FIT.json")
    rows = content.get("parameters")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError("no list of parameters", file=path, expected="a FIT.json")
    return rows


def _label(parameter: Mapping[str, Any]) -> str:
    joint = parameter.get("joint")
    return str(parameter.get("name")) + ("" if joint is None else f" (joint {joint})")
