"""FIT.json: what a fit says of itself, for scripts. null stands where there is no finite value."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armimpedance.outputs import staged_file
from armimpedance.regression.summary import FitSummary, NamedParameter


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
