"""Results for JSON and MATLAB: nested matrices instead of columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import (
    FORCE_UNIT,
    MATRICES,
    POSITION_UNIT,
    UNITS,
    parameter_names,
)
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, Ellipsoid, ellipsoid_of
from armimpedance.hand.show.quantities import (
    antisymmetric,
    ellipse_values,
    group_cells,
    half_widths,
    is_recording_of_joints,
    lower_triangle,
    quality_cells,
    shared_lists,
)


def result_objects(estimates: Sequence[ImpedanceEstimate]) -> list[dict[str, Any]]:
    """One mapping per estimate, with nested lists of plain numbers.

    `estimates`: the estimates, one for each group.
    Returns: the mappings, in the order of the estimates.
    Raises InputError: a group's column is named like a column of the results.
    """
    return [_as_object(estimate) for estimate in estimates]


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
        "shared_errors": shared_lists(estimate),
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
        if estimate.k == 3:
            out[f"{symbol}_ellipsoid"] = _ellipsoid(ellipsoid_of(estimate, field))
        if estimate.k == 2:
            value, sd = antisymmetric(estimate, symbol)
            out[f"{symbol}_antisymmetric"], out[f"sd_{symbol}_antisymmetric"] = value, sd
    return out


def _ellipsoid(ellipsoid: Ellipsoid | None) -> dict[str, Any] | None:
    """Half-axes, volume and directions with their 95 % limits."""
    if ellipsoid is None:
        return None
    limits = ellipsoid.interval()
    return {
        "half_axes": ellipsoid.semi_axes.tolist(),
        "ci_half_axes": limits[:3].tolist(),
        "directions": ellipsoid.directions.tolist(),
        "turn_deg": np.degrees(ellipsoid.turns().max(axis=1)).tolist(),
        "size": ellipsoid.size,
        "ci_size": limits[3].tolist(),
    }


def _named(values: dict[str, tuple[float, float, float]]) -> dict[str, float]:
    flat: dict[str, float] = {}
    for name, (value, low, high) in values.items():
        flat |= {name: value, f"ci_low_{name}": low, f"ci_high_{name}": high}
    return flat


def _list(array: FloatArray | None) -> Any:
    return None if array is None else array.tolist()


# Estimates for MATLAB: one struct per group with whole matrices and their units.


def result_structs(estimates: Sequence[ImpedanceEstimate]) -> list[dict[str, Any]]:
    """One mapping per group: `stiffness`, `stiffness_lower`, ..., `covariance`, `keys`, `units`.

    Returns: mappings of plain values, arrays and, for lists of texts, tuples.
    """
    return [_struct(estimate) for estimate in estimates]


def _struct(estimate: ImpedanceEstimate) -> dict[str, Any]:
    return {
        "keys": group_cells(estimate.keys),
        "level": estimate.level,
        "method": estimate.method,
        "n_trials": estimate.quality.n_trials,
        **_matlab_matrices(estimate),
        "inertia_with_handle": estimate.inertia_with_handle,
        "covariance": estimate.covariance,
        "covariance_names": parameter_names(estimate.k),
        "shared_errors": dict(estimate.shared_errors),
        "position": estimate.position,
        "force": estimate.force,
        "joint_angles": estimate.joint_angles,
        "torque": estimate.torque,
        "activation": estimate.activation,
        "activation_sd": estimate.activation_sd,
        "muscles": tuple(estimate.muscles),
        "shoulder": estimate.shoulder_m,
        "ellipse": {field: _ellipse(estimate, field) for field in MATRICES},
        "quality": quality_cells(estimate),
        "units": _units(estimate),
        "warnings": tuple(estimate.warnings),
        "provenance": tuple(estimate.provenance),
    }


def _matlab_matrices(estimate: ImpedanceEstimate) -> dict[str, Any]:
    matrices: dict[str, Any] = {}
    for i, (field, half) in enumerate(zip(MATRICES, half_widths(estimate), strict=True)):
        value = getattr(estimate, field)
        matrices |= {
            field: value,
            f"{field}_lower": value - half,
            f"{field}_upper": value + half,
            f"{field}_sd": estimate.sd[i],
        }
    return matrices


def _ellipse(estimate: ImpedanceEstimate, field: Any) -> dict[str, float]:
    """Size, orientation and shape with their limits; nan without an ellipse."""
    limits = ellipse_values(estimate, field)
    cells: dict[str, float] = {}
    for name in ("size", "orientation_deg", "shape"):
        value, low, high = limits.get(name, (np.nan, np.nan, np.nan))
        cells |= {name: value, f"{name}_lower": low, f"{name}_upper": high}
    return cells


def _units(estimate: ImpedanceEstimate) -> dict[str, str]:
    place = "joint" if is_recording_of_joints(estimate) else "hand"
    units = {field: UNITS[estimate.level][symbol] for field, (symbol, _) in MATRICES.items()}
    return {
        **units,
        "inertia_with_handle": units["inertia"],
        "position": POSITION_UNIT[place],
        "force": FORCE_UNIT[place],
        "joint_angles": "rad",
        "torque": "N m",
        "activation": "1",
        "shoulder": "m",
    }
