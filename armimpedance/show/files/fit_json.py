"""FIT.json: what a fit says of itself, for scripts. null stands where there is no finite value."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from armimpedance.core.errors import InputError
from armimpedance.core.findings import Finding
from armimpedance.core.json_text import json_text, read_json
from armimpedance.core.outputs import staged_file
from armimpedance.numerics.regression import FitSummary, NamedParameter
from armimpedance.show.files.tables import table_content
from armimpedance.show.files.written.content import About, Content, Quantity
from armimpedance.show.files.written.long import number
from armimpedance.show.files.written.words import meaning_of


def write_fit(summary: FitSummary, path: str | Path, **more: Any) -> None:
    """Write the summary and what the command adds, whole or not at all.

    Parameters
    ----------
    summary : FitSummary
        What was fitted.
    path : path
        Where the file is written.
    **more : Any
        Further fields of the file, as plain values.
    """
    write_json({**summary.to_dict(), **more}, path)


def fit_content(told: Mapping[str, Any]) -> Content:
    """What a file holds of a fit: FIT.json as it is, a row a parameter in every other format.

    Parameters
    ----------
    told : mapping
        What FIT.json holds, with its `parameters`.

    Returns
    -------
    Content
    """
    rows = [_cells(one, str(told.get("method", ""))) for one in told["parameters"]]
    columns = dict.fromkeys(name for row in rows for name in row)
    checks = [Finding(c["check"], c["verdict"], c["message"], c["smallest"]) for c in _checks(told)]
    known = {check.sentence for check in checks}
    more = (w for w in told.get("warnings", ()) if w not in known)
    about = About(checks=(*checks, *(Finding("", "warning", sentence) for sentence in more)))
    return table_content(
        rows,
        list(columns),
        quantities=lambda: [_quantity(row) for row in rows],
        objects=lambda: told,
        structs=lambda: [{**told, "warnings": tuple(told.get("warnings", ()))}],
        about=about,
    )


def _checks(told: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return list(told.get("checks", ()))


def _cells(parameter: Mapping[str, Any], method: str) -> dict[str, Any]:
    """A parameter of FIT.json as a row."""
    low, high = parameter["ci95"]
    joint = {"joint": parameter["joint"]} if "joint" in parameter else {}
    names = ("value", "sd", "sd_robust", "rel_sd_percent", "well_identified", "unit")
    row = {"parameter": parameter["name"], **joint, **{n: parameter[n] for n in names}}
    return {**row, "ci_low": low, "ci_high": high, "method": method}


def _quantity(row: Mapping[str, Any]) -> Quantity:
    keys = {name: row[name] for name in ("joint", "method") if name in row}
    more = {name: row[name] for name in ("rel_sd_percent", "well_identified")}
    return Quantity(
        keys,
        row["parameter"],
        meaning_of(row["parameter"]).words,
        number(row["value"]),
        number(row["ci_low"]),
        number(row["ci_high"]),
        number(row["sd_robust"]),
        row["unit"],
        more=more,
    )


def write_json(content: Any, path: str | Path) -> None:
    """Write plain values as JSON through a temporary name.

    Parameters
    ----------
    content : Any
        Plain values: mappings, lists, numbers, text and None.
    path : path
        Where the file is written.
    """
    with staged_file(path) as staged:
        staged.write_text(json_text(content), encoding="utf-8")


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
    found = [p for p in named if joint is None or p.get("joint") == joint]
    if not found:
        known = ", ".join(_label(p) for p in content)
        wanted = name if joint is None else f"{name} of joint {joint}"
        raise InputError(f"no parameter {wanted}", file=path, expected=f"one of {known}")
    if len(found) > 1:
        joints = ", ".join(str(p.get("joint")) for p in found)
        raise InputError(f"{name} of several joints", file=path, expected=f"a joint: {joints}")
    given = found[0]
    keys = ("value", "sd", "sd_robust")
    if any(type(given.get(key)) not in (int, float) for key in keys):
        raise InputError(f"{name} has no finite value and standard errors", file=path)
    value, sd, robust = (float(given[key]) for key in keys)
    return NamedParameter(name, value, sd, robust, str(given.get("unit", "")), joint=joint)


def _load(path: Path) -> list[dict[str, Any]]:
    content = read_json(path, "a FIT.json")
    rows = content.get("parameters")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError("no list of parameters", file=path, expected="a FIT.json")
    return rows


def _label(parameter: Mapping[str, Any]) -> str:
    joint = parameter.get("joint")
    return str(parameter.get("name")) + ("" if joint is None else f" (joint {joint})")
