"""Fit moment arms over posture: which models there are, and one function that fits them all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.errors import InputError
from armimpedance.muscles.angle_scaling import (
    AngleScaling,
    measured_scaling,
    require_spread,
    stated_scaling,
)
from armimpedance.muscles.posture.data import PostureData, stiffness_data, viscosity_data
from armimpedance.muscles.posture.fitted import FittedMatrix, Progress
from armimpedance.muscles.posture.model import PostureModel, posture_polynomial
from armimpedance.muscles.posture.polynomial import fit_polynomial
from armimpedance.muscles.posture.quality import posture_quality, posture_summary
from armimpedance.muscles.posture.sos import sos_fit
from armimpedance.muscles.posture.terms import checked_order
from armimpedance.muscles.region import Region
from armimpedance.muscles.rows import JointRows

FitMatrix = Callable[[PostureData, int, np.random.Generator, Progress], FittedMatrix]


@dataclass(frozen=True)
class PostureMethod:
    """A way to fit K and B over posture.

    Attributes
    ----------
    name : str
    promises : str
        What holds for every fit, in one sentence.
    fit : function
        Of one matrix.
    """

    name: str
    promises: str
    fit: FitMatrix


POSTURE_MODELS = {
    method.name: method
    for method in (
        PostureMethod(
            "polynomial",
            "least squares of each element, as in the source; may be indefinite at a posture",
            fit_polynomial,
        ),
        PostureMethod(
            "sos",
            "sum of squares: stiffness and viscosity are positive semidefinite at every posture",
            sos_fit("full"),
        ),
        PostureMethod(
            "box",
            "positive semidefinite at every posture of the stated workspace, free outside of it",
            sos_fit("box"),
        ),
        PostureMethod(
            "separable",
            "as sos, for moment arms that depend on the angle of their own joint only",
            sos_fit("separable"),
        ),
    )
}


def default_model(order: int) -> str:
    """The name of the model that is fitted if none is asked for."""
    return "polynomial" if order < 2 else "sos"


def fit_posture_model(
    rows: JointRows,
    *,
    order: int,
    model: str | None = None,
    box: ArrayLike | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> PostureModel:
    """Fit joint stiffness and viscosity over posture, Tsuji (1997), eqs. (33)-(37).

    Parameters
    ----------
    rows : JointRows
        Postures at (nearly) constant activation.
    order : int
        L, the order of the moment arms in the joint angles.
    model : str, optional
        A key of `POSTURE_MODELS`; by default "polynomial" below order 2, then "sos".
    box : (2, 2), optional
        The workspace, rad: of shoulder and elbow the lowest and the highest angle. By default the
        measured range.
    seed : int
        Of the shuffles.
    progress : function, optional
        Called with what is done and what there is to do.

    Raises
    ------
    InputError
        No such model or order, a box without the postures, fewer postures than coefficients.
    NotIdentifiableError
        The postures are one, lie on a line, or cannot tell some term.
    EstimationError
        The solver did not end with an optimal solution.
    """
    order = checked_order(order)
    method = _method(model or default_model(order))
    if rows.n_rows == 0:
        raise InputError("no postures", expected="one or more")
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    if order > 0:
        require_spread(rows.joint_angles, order)
    scaling = _scaling(rows, box)
    data = (stiffness_data(rows, scaling), viscosity_data(rows, scaling))
    seeds = np.random.SeedSequence(seed).spawn(2)
    fitted = [
        method.fit(one, order, np.random.default_rng(own), _part(progress, i))
        for i, (one, own) in enumerate(zip(data, seeds, strict=True))
    ]
    K, B = (posture_polynomial(one, scaling) for one in fitted)
    return PostureModel(
        name=method.name,
        order=order,
        scaling=scaling,
        stiffness=K,
        viscosity=B,
        dof=min(one.dof for one in fitted),
        region=Region.of(scaling.scaled(rows.joint_angles)),
        quality=tuple(q for d, f in zip(data, fitted, strict=True) for q in posture_quality(d, f)),
        summary=posture_summary(method.name, order, rows, data, fitted, (K, B)),
    )


def _method(name: str) -> PostureMethod:
    if name not in POSTURE_MODELS:
        raise InputError(f"no posture model {name!r}", expected=" or ".join(POSTURE_MODELS))
    return POSTURE_MODELS[name]


def _scaling(rows: JointRows, box: ArrayLike | None) -> AngleScaling:
    if box is None:
        return measured_scaling(rows.joint_angles)
    return stated_scaling(box, rows.joint_angles, rows.labels)


def _part(progress: Progress | None, matrix: int) -> Progress:
    """Progress of one of the two matrices as progress of both."""
    if progress is None:
        return lambda _done, _total: None
    return lambda done, total: progress(matrix * total + done, 2 * total)
