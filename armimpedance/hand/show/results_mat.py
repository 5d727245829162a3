"""Estimates as MATLAB has them: one struct a group, its matrices whole, each with its unit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from armimpedance.core.conventions import (
    FORCE_UNIT,
    MATRICES,
    POSITION_UNIT,
    UNITS,
    parameter_names,
)
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.show.quantities import ellipse_values, half_widths, is_recording_of_joints
from armimpedance.hand.show.result_row import group_cells, quality_cells


def result_structs(estimates: Sequence[ImpedanceEstimate]) -> list[dict[str, Any]]:
    """One mapping a group: `stiffness`, `stiffness_lower`, ..., `covariance`, `keys`, `units`.

    Parameters
    ----------
    estimates : sequence of ImpedanceEstimate

    Returns
    -------
    list of mappings
        Of plain values, arrays and, where texts are listed, tuples.
    """
    return [_struct(estimate) for estimate in estimates]


def _struct(estimate: ImpedanceEstimate) -> dict[str, Any]:
    return {
        "keys": group_cells(estimate.keys),
        "level": estimate.level,
        "method": estimate.method,
        "n_trials": estimate.quality.n_trials,
        **_matrices(estimate),
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


def _matrices(estimate: ImpedanceEstimate) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for i, (field, half) in enumerate(zip(MATRICES, half_widths(estimate), strict=True)):
        value = getattr(estimate, field)
        made |= {
            field: value,
            f"{field}_lower": value - half,
            f"{field}_upper": value + half,
            f"{field}_sd": estimate.sd[i],
        }
    return made


def _ellipse(estimate: ImpedanceEstimate, field: Any) -> dict[str, float]:
    """Size, orientation and shape with their limits; not a number where there is no ellipse."""
    found = ellipse_values(estimate, field)
    cells: dict[str, float] = {}
    for name in ("size", "orientation_deg", "shape"):
        value, low, high = found.get(name, (np.nan, np.nan, np.nan))
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
