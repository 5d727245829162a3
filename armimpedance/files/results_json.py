"""The results as JSON: the content of RESULTS.csv with nested matrices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armimpedance.arrays import FloatArray
from armimpedance.files.quantities import (
    FIELDS,
    antisymmetric,
    ellipse_values,
    half_widths,
    is_recording_of_joints,
)
from armimpedance.files.result_row import (
    group_cells,
    lower_triangle,
    quality_cells,
    require_results,
)
from armimpedance.json_text import json_text
from armimpedance.outputs import staged_file
from armimpedance.records import ImpedanceEstimate


def write_results_json(estimates: Sequence[ImpedanceEstimate], path: str | Path) -> None:
    """Write `results_json` through a temporary name.

    Raises
    ------
    InputError
        Without estimates, or when a group's column is named like a column of the results.
    """
    require_results(estimates, path)
    text = results_json(estimates)
    with staged_file(path) as staged:
        Path(staged).write_text(text, encoding="utf-8")


def results_json(estimates: Sequence[ImpedanceEstimate]) -> str:
    """A JSON list with one object per estimate; null where there is no finite value."""
    return json_text([_as_object(estimate) for estimate in estimates])


def _as_object(estimate: ImpedanceEstimate) -> dict[str, Any]:
    joints = is_recording_of_joints(estimate)
    return {
        "group": group_cells(estimate.keys),
        "n_trials": int(estimate.quality.n_trials),
        "method": estimate.method,
        "level": estimate.level,
        "position_rad" if joints else "position_m": _list(estimate.position),
        "force_Nm" if joints else "force_N": _list(estimate.force),
        "joint_angles_rad": _list(estimate.joint_angles),
        "torque_Nm": _list(estimate.torque),
        "activation": _list(estimate.activation),
        "sd_activation": _list(estimate.activation_sd),
        "muscles": list(estimate.muscles),
        "shoulder_m": _list(estimate.shoulder_m),
        **_matrices(estimate),
        **quality_cells(estimate),
        "covariance": lower_triangle(estimate.covariance),
        "warnings": list(estimate.warnings),
        "provenance": list(estimate.provenance),
    }


def _matrices(estimate: ImpedanceEstimate) -> dict[str, Any]:
    out: dict[str, Any] = {"M_with_handle": _list(estimate.inertia_with_handle)}
    half = half_widths(estimate)
    for i, (field, symbol) in enumerate(zip(FIELDS, "MBK", strict=True)):
        matrix = getattr(estimate, field)
        out[symbol] = _list(matrix)
        out[f"sd_{symbol}"] = _list(estimate.sd[i])
        out[f"ci_low_{symbol}"] = _list(matrix - half[i])
        out[f"ci_high_{symbol}"] = _list(matrix + half[i])
        efficiency = estimate.efficiency
        out[f"efficiency_{symbol}"] = None if efficiency is None else _list(efficiency[i])
        ellipse = ellipse_values(estimate, field)
        out[f"{symbol}_ellipse"] = _named(ellipse) if ellipse else None
        if estimate.k == 2:
            value, sd = antisymmetric(estimate, symbol)
            out[f"{symbol}_antisymmetric"], out[f"sd_{symbol}_antisymmetric"] = value, sd
    return out


def _named(values: dict[str, tuple[float, float, float]]) -> dict[str, float]:
    flat: dict[str, float] = {}
    for name, (value, low, high) in values.items():
        flat |= {name: value, f"ci_low_{name}": low, f"ci_high_{name}": high}
    return flat


def _list(array: FloatArray | None) -> Any:
    return None if array is None else array.tolist()
