"""SysIdentPy's NARX, linear, of two past angles, three torques and a constant; no interval."""

from __future__ import annotations

import numpy as np
from discrete import continuous, decimated
from record import Joint
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares


def solve(y: np.ndarray, u: np.ndarray, rate_hz: float) -> np.ndarray:
    """I, B, K of one record by a discrete model."""
    model = FROLS(
        ylag=2,
        xlag=3,
        order_selection=False,
        n_terms=6,
        estimator=LeastSquares(),
        basis_function=Polynomial(degree=1),
    )
    model.fit(X=u[1:, None], y=y[:-1, None])
    codes = model.final_model[:, 0].astype(int)
    theta = dict(zip(codes, model.theta.ravel(), strict=True))
    a = -np.array([theta[1001], theta[1002]])
    return continuous(a, np.array([theta[c] for c in (2001, 2002, 2003)]), rate_hz)


def joint(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """I, B, K of every record."""
    values = np.stack([solve(*decimated(record, t)) for t in range(len(record.angle))])
    return values, np.full_like(values, np.nan)
