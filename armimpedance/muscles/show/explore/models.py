"""What the page's script needs of a fitted model to predict as `predict` does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.errors import InputError
from armimpedance.muscles.models import (
    ActivationModel,
    FittedModel,
    MuscleModel,
    PostureModel,
    Region,
    kind_of,
)
from armimpedance.numerics.regression import t_factor


def model_data(model: FittedModel, title: str) -> dict[str, Any]:
    """A model as plain values, its covariances as lower triangles.

    Parameters
    ----------
    model : FittedModel
    title : str
        What the page calls it.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        The model is of a kind that the page cannot compute.
    """
    kind = kind_of(model).name
    if kind not in _KINDS:
        raise InputError(f"a {kind} model cannot be explored", expected=" or ".join(_KINDS))
    return {
        "kind": kind,
        "title": title,
        "t": t_factor(model.dof),
        "warnings": list(model.warnings),
        "muscles": [],
        **_KINDS[kind](model),
    }


def lower_triangle(covariance: ArrayLike) -> list[float]:
    """The lower triangle of a symmetric matrix (n, n), row by row."""
    C = np.asarray(covariance, dtype=float)
    rows: list[float] = ((C + C.T) / 2)[np.tril_indices(len(C))].tolist()
    return rows


def _posture(model: PostureModel) -> dict[str, Any]:
    degree = 2 * model.order
    return {
        "box": model.scaling.box.tolist(),
        # the monomials' powers, the lowest degree first, as the model has them
        "exponents": [[d - i, i] for d in range(degree + 1) for i in range(d + 1)],
        "region": _region(model.region),
        **{
            name: {
                "coefficients": made.coefficients.tolist(),
                "covariance": lower_triangle(made.covariance),
            }
            for name, made in (("stiffness", model.stiffness), ("viscosity", model.viscosity))
        },
    }


def _activation(model: ActivationModel) -> dict[str, Any]:
    symmetric = ("stiffness_covariance", "viscosity_covariance", "muscle_covariance", "leverage")
    plain = ("patterns", "viscous_patterns", "stiffness", "viscosity", "joint_angles")
    return {
        "muscles": list(model.muscles),
        "order": model.order,
        "range": model.activation_range.tolist(),
        "leverage_limit": model.leverage_limit,
        **{name: getattr(model, name).tolist() for name in plain},
        **{name: lower_triangle(getattr(model, name)) for name in symmetric},
    }


def _muscles(model: MuscleModel) -> dict[str, Any]:
    plain = ("box", "exponents", "base", "muscle", "change", "highest", "values")
    return {
        "muscles": list(model.muscles),
        "order": model.order,
        "range": [[0.0, high] for high in model.highest.tolist()],
        "curvature": model.curvature,
        "stiffness_per_tension": model.stiffness_per_tension,
        "region": _region(Region(model.measured)),
        **{name: getattr(model, name).tolist() for name in plain},
        "covariance": lower_triangle(model.covariance),
    }


def _region(region: Region) -> dict[str, Any]:
    return {"vertices": region.vertices.tolist(), "tolerance": region.tolerance}


_KINDS: Final = cast(
    dict[str, Callable[[FittedModel], dict[str, Any]]],
    {"moment-arms": _posture, "activation": _activation, "muscles": _muscles},
)
