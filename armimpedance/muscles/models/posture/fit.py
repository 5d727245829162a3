"""Fit moment arms over posture: one function for all models of the table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.progress import Progress
from armimpedance.muscles.models.activation.checks import plausible_size
from armimpedance.muscles.models.angle_scaling import AngleScaling, require_spread, stated_scaling
from armimpedance.muscles.models.posture.data import PostureData, posture_data
from armimpedance.muscles.models.posture.fitted import FittedMatrix
from armimpedance.muscles.models.posture.misfit import judged_fit
from armimpedance.muscles.models.posture.model import PostureModel, posture_polynomial
from armimpedance.muscles.models.posture.models import POSTURE_MODELS, default_model
from armimpedance.muscles.models.posture.quality import posture_quality, posture_summary
from armimpedance.muscles.models.posture.terms import checked_order
from armimpedance.muscles.models.region import Region
from armimpedance.muscles.models.rows import JointRows
from armimpedance.muscles.models.shared_errors import main_errors


def fit_posture_model(
    rows: JointRows,
    *,
    order: int = 2,
    model: str | None = None,
    box: ArrayLike | None = None,
    seed: int = 0,
    judged: bool = True,
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
        Seed of the shuffles.
    judged : bool
        False neither leaves rows out nor shuffles them, which is faster; the qualities that need
        that are then nan.
    progress : function, optional
        Called with what is done and what there is to do.

    Returns
    -------
    PostureModel

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
    method = POSTURE_MODELS.named(model or default_model(order))
    rows.require_planar()
    if rows.n_rows == 0:
        raise InputError("no postures", expected="one or more")
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")
    if order > 0:
        require_spread(rows.joint_angles, order)
    scaling = _scaling(rows, box)
    data = [posture_data(rows, symbol, scaling) for symbol in "KB"]
    seeds = np.random.SeedSequence(seed).spawn(2)
    fitted = [
        method.fit(one, order, np.random.default_rng(own), _part(progress, i), judged)
        for i, (one, own) in enumerate(zip(data, seeds, strict=True))
    ]

    def again(moved: PostureData) -> FloatArray:
        return method.fit(moved, order, np.random.default_rng(0), _silent, False).coefficients

    fitted = [
        _with_shared(made, one, rows.shared(one.symbol), again)
        for made, one in zip(fitted, data, strict=True)
    ]
    judgements = [judged_fit(d, f, rows.labels) for d, f in zip(data, fitted, strict=True)]
    fitted = [made for made, _ in judgements]
    checks = (*judgements[0][1], *judgements[1][1], plausible_size(data[0].values))
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
        summary=posture_summary(method.name, order, rows, data, fitted, (K, B), checks),
    )


def _with_shared(
    fitted: FittedMatrix,
    data: PostureData,
    shared: FloatArray,
    again: Callable[[PostureData], FloatArray],
) -> FittedMatrix:
    """The fit with what errors that all rows share add to its covariance."""
    covariance = np.array(fitted.covariance)
    for error in main_errors(shared, data.sd):
        for moved in (data.values + error, data.values - error):
            # d (3 terms,) of one standard deviation; half for each of both ways
            d = (again(replace(data, values=moved)) - fitted.coefficients).T.ravel()
            covariance += np.outer(d, d) / 2
    return replace(fitted, covariance=covariance)


def _silent(_done: int, _total: int) -> None:
    """Shows no progress."""


def _scaling(rows: JointRows, box: ArrayLike | None) -> AngleScaling:
    if box is None:
        return AngleScaling.of(rows.joint_angles)
    return stated_scaling(box, rows.joint_angles, rows.labels)


def _part(progress: Progress | None, matrix: int) -> Progress:
    """Progress of one of the two matrices as progress of both."""
    if progress is None:
        return _silent
    return lambda done, total: progress(matrix * total + done, 2 * total)
