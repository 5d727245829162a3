"""SIPPY's ARX and OE of one record of a joint, its subspaces of a hand; none gives an interval.

It takes one record, not trials: the pushes of a condition, each from rest to rest, are strung end
to end. Force goes in and motion comes out, for a model in discrete time gives no impedance
otherwise.
"""

from __future__ import annotations

import contextlib
import io

import numpy as np
from discrete import continuous, decimated
from record import Hand, Joint
from scipy.linalg import logm
from scipy.signal import butter, filtfilt
from sippy_unipi import system_identification
from with_scipy import CUTOFF_HZ

ORDERS = {"ARX": {"ARX_orders": [2, 3, 0]}, "OE": {"OE_orders": [3, 2, 0]}}


def solve(y: np.ndarray, u: np.ndarray, rate_hz: float, kind: str) -> np.ndarray:
    """I, B, K of one record by a discrete model."""
    # torques begin at lag 1: one sample ahead, they begin at u(t)
    with contextlib.redirect_stdout(io.StringIO()):
        model = system_identification(
            y[None, :-1], u[None, 1:], kind, tsample=1 / rate_hz, **ORDERS[kind]
        )
    numerator, denominator = np.ravel(model.G.num[0][0]), np.ravel(model.G.den[0][0])
    return continuous(denominator[1:3] / denominator[0], numerator / denominator[0], rate_hz)


def _joint(record: Joint, kind: str) -> tuple[np.ndarray, np.ndarray]:
    values = np.stack([solve(*decimated(record, t), kind) for t in range(len(record.angle))])
    return values, np.full_like(values, np.nan)


def joint_arx(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """ARX(2, 3, 0) by least squares."""
    return _joint(record, "ARX")


def joint_oe(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """OE(3, 2, 0): the error of the simulated angle, by its nonlinear programme."""
    return _joint(record, "OE")


def _matrices(model: object, rate_hz: float) -> np.ndarray:
    """M, B, K (12,) of a model of order 4 from force to position."""
    stiffness = np.linalg.inv(model.C @ np.linalg.solve(np.eye(4) - model.A, model.B) + model.D)
    A = np.real(logm(model.A)) * rate_hz
    # coordinates of position and velocity: A is then [[0, 1], [-M^-1 K, -M^-1 B]]
    to = np.vstack([model.C, model.C @ A])
    lower = (to @ A @ np.linalg.inv(to))[2:]
    inertia = -stiffness @ np.linalg.inv(lower[:, :2])
    return np.concatenate([inertia, -inertia @ lower[:, 2:], stiffness], axis=None)


def hand(record: Hand) -> tuple[np.ndarray, np.ndarray]:
    """M, B, K of every condition by PARSIM-K, of its subspaces the one that came nearest."""
    b, a = butter(2, CUTOFF_HZ, fs=record.rate_hz)
    keep, before, values = round(record.rate_hz / 100), record.lag_s <= 0, []
    for trials in record.conditions:
        both = (filtfilt(b, a, s[trials], axis=1) for s in (record.position, -record.force))
        x, force = (
            (s - s[:, before].mean(axis=1, keepdims=True))[:, ::keep].reshape(-1, 2).T for s in both
        )
        rate_hz = record.rate_hz / keep
        with contextlib.redirect_stdout(io.StringIO()):
            model = system_identification(
                x, force, "PARSIM-K", SS_fixed_order=4, tsample=1 / rate_hz
            )
        values.append(_matrices(model, rate_hz))
    return np.stack(values), np.full((len(values), 12), np.nan)
