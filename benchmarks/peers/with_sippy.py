"""SIPPY's ARX and OE of one record; neither gives an interval."""

from __future__ import annotations

import contextlib
import io

import numpy as np
from discrete import continuous, decimated
from record import Joint
from sippy_unipi import system_identification

ORDERS = {"ARX": {"ARX_orders": [2, 3, 0]}, "OE": {"OE_orders": [3, 2, 0]}}


def _solve(y: np.ndarray, u: np.ndarray, rate_hz: float, kind: str) -> np.ndarray:
    # torques begin at lag 1: one sample ahead, they begin at u(t)
    with contextlib.redirect_stdout(io.StringIO()):
        model = system_identification(
            y[None, :-1], u[None, 1:], kind, tsample=1 / rate_hz, **ORDERS[kind]
        )
    numerator, denominator = np.ravel(model.G.num[0][0]), np.ravel(model.G.den[0][0])
    return continuous(denominator[1:3] / denominator[0], numerator / denominator[0], rate_hz)


def _joint(record: Joint, kind: str) -> tuple[np.ndarray, np.ndarray]:
    values = np.stack([_solve(*decimated(record, t), kind) for t in range(len(record.angle))])
    return values, np.full_like(values, np.nan)


def joint_arx(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """ARX(2, 3, 0) by least squares."""
    return _joint(record, "ARX")


def joint_oe(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """OE(3, 2, 0): the error of the simulated angle, by its nonlinear programme."""
    return _joint(record, "OE")
