"""FIT.json: what a fit says of itself, for scripts. null stands where there is no finite value."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armimpedance.errors import InputError
from armimpedance.outputs import staged_file
from armimpedance.regression import FitSummary, NamedParameter


def write_fit(summary: FitSummary, path: str | Path, **more: Any) -> None:
    """Write the summary and what the command adds, whole or not at all."""
    write_json({**summary_object(summary), **more}, path)


def write_json(content: Any, path: str | Path) -> None:
    """Write plain values as JSON through a temporary name."""
    text = json.dumps(finite(content), indent=1, allow_nan=False, ensure_ascii=False)
    with staged_file(path) as staged:
        staged.write_text(text + "\n", encoding="utf-8")


def summary_object(summary: FitSummary) -> dict[str, Any]:
    """The contract's fields, in its order."""
    return {
        "method": summary.method,
        "n": int(summary.n),
        "cond_raw": float(summary.cond_raw),
        "cond_scaled": float(summary.cond_scaled),
        "rank": int(summary.rank),
        "r2": float(summary.r2),
        "vaf": float(summary.vaf),
        "warnings": list(summary.warnings),
        "parameters": [_parameter(p) for p in summary.parameters],
    }


def _parameter(parameter: NamedParameter) -> dict[str, Any]:
    joint = {} if parameter.joint is None else {"joint": parameter.joint}
    return {
        "name": parameter.name,
        **joint,
        "value": parameter.value,
        "sd": parameter.sd,
        "sd_robust": parameter.sd_robust,
        "ci95": list(parameter.ci95),
        "rel_sd_percent": parameter.relative_sd_percent,
        "well_identified": parameter.well_identified,
        "unit": parameter.unit,
    }


def finite(value: Any) -> Any:
    """Plain numbers, lists and mappings for JSON; None for what is not finite."""
    if isinstance(value, Mapping):
        return {str(name): finite(v) for name, v in value.items()}
    if isinstance(value, np.ndarray):
        return finite(value.tolist())
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, np.generic):
        return finite(value.item())
    return None if isinstance(value, float) and not np.isfinite(value) else value


def read_parameter(path: str | Path, name: str, joint: int | None = None) -> NamedParameter:
    """One parameter of a FIT.json; its degrees of freedom are not in the file.

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
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, UnicodeDecodeError) as error:
        raise InputError(f"not JSON: {error}", file=path, expected="a FIT.json") from error
    rows = content.get("parameters") if isinstance(content, dict) else None
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise InputError("no list of parameters", file=path, expected="a FIT.json")
    return rows


def _label(parameter: Mapping[str, Any]) -> str:
    joint = parameter.get("joint")
    return str(parameter.get("name")) + ("" if joint is None else f" (joint {joint})")
