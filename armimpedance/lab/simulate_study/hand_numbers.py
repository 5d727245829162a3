"""M, B, K at the hand and their ellipses as rows of numbers; what the shortcut draws of them."""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import UNITS, parameter_names
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, Ellipse, ellipse, ellipse_of
from armimpedance.lab.simulate_study.rig import COLUMNS, Quantity
from armimpedance.numerics.regression import t_interval

_UNITS: Final = UNITS["hand"]
QUANTITIES: Final = (
    *(Quantity(name, _UNITS[name[0]]) for name in parameter_names(2)),
    *(
        quantity
        for symbol in "MBK"
        for quantity in (
            Quantity(f"size_{symbol}", f"({_UNITS[symbol]})^2", "ratio"),
            Quantity(f"orientation_{symbol}", "rad", "axis"),
            Quantity(f"shape_{symbol}", "1", "share"),
        )
    ),
)
#: Elements (12), roots of the covariances of M, B, K (3 x 10), log dof, line shoulder -> hand.
EXTRAS: Final = 44
_LOWER: Final = np.tril_indices(4)
_DIAGONAL: Final = np.flatnonzero(_LOWER[0] == _LOWER[1])


def numbers_of(estimate: ImpedanceEstimate, truth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Numbers (21, 7) and extras (44,) of one estimate whose truth is known, (3, 2, 2)."""
    values = np.full((len(QUANTITIES), len(COLUMNS)), np.nan)
    sd = estimate.sd.ravel()
    low, high = t_interval(estimate.parameters, sd, estimate.dof).T
    bound = np.full(12, np.nan)
    if estimate.bound is not None:
        bound = np.sqrt(np.diag(estimate.bound))
    dof = np.full(12, estimate.dof)
    values[:12] = np.column_stack([estimate.parameters, low, high, sd, dof, truth.ravel(), bound])
    angle = np.nan
    for block, which in enumerate(FIELDS):
        found = ellipse_of(estimate, which)
        if found is None:
            continue
        angle = found.reference_angle_rad
        true = ellipse(truth[block], reference_angle_rad=angle)
        values[12 + 3 * block : 15 + 3 * block] = _ellipse_rows(found, true)
    extras = np.concatenate(
        [estimate.parameters, *_roots(estimate.covariance), [np.log(estimate.dof), angle]]
    )
    return values, extras


def _ellipse_rows(found: Ellipse, true: Ellipse) -> FloatArray:
    """Size, orientation and shape, (3, 7)."""
    covariance = np.asarray(found.covariance)
    return np.column_stack(
        [
            [found.size, found.orientation_rad, found.shape],
            found.interval(),
            np.sqrt(np.diag(covariance)),
            np.full(3, found.dof),
            [true.size, true.orientation_rad, true.shape],
            np.full(3, np.nan),
        ]
    )


def _roots(covariance: FloatArray) -> list[FloatArray]:
    """Cholesky factors of the 4 x 4 covariances of M, B and K, logarithms on their diagonals."""
    roots = []
    for block in range(3):
        part = covariance[4 * block : 4 * block + 4, 4 * block : 4 * block + 4]
        try:
            root = np.asarray(np.linalg.cholesky(part)[_LOWER], dtype=float)
            root[_DIAGONAL] = np.log(root[_DIAGONAL])
        except np.linalg.LinAlgError:
            root = np.full(10, np.nan)
        roots.append(root)
    return roots
