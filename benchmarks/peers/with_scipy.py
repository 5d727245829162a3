"""A loop as a laboratory writes it: filter every trial, differentiate, least squares.

Intervals are those of a textbook's least squares, which takes samples as independent.
"""

from __future__ import annotations

import numpy as np
from record import Hand, Joint
from scipy.signal import butter, filtfilt
from scipy.stats import t

#: Low-pass of both channels, second order, forward and backward.
CUTOFF_HZ = 15.0


def derivatives(x: np.ndarray, rate_hz: float) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and acceleration along the first axis."""
    velocity = np.gradient(x, 1 / rate_hz, axis=0)
    return velocity, np.gradient(velocity, 1 / rate_hz, axis=0)


def trial_rows(record: Hand, trial: int) -> tuple[np.ndarray, np.ndarray]:
    """W (S, 6) of acceleration, velocity, position and y (S, 2) of one trial from its onset on.

    Position and force are filtered alike and counted from their mean before the onset.
    """
    b, a = butter(2, CUTOFF_HZ, fs=record.rate_hz)
    x = filtfilt(b, a, record.position[trial], axis=0)
    force = filtfilt(b, a, record.force[trial], axis=0)
    before = record.lag_s <= 0
    x, force = x - x[before].mean(axis=0), force - force[before].mean(axis=0)
    velocity, acceleration = derivatives(x, record.rate_hz)
    return np.hstack([acceleration, velocity, x])[~before], -force[~before]


def least_squares(W: np.ndarray, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (p, q) and the half widths of their intervals."""
    theta, *_ = np.linalg.lstsq(W, Y, rcond=None)
    dof = len(W) - W.shape[1]
    variance = ((Y - W @ theta) ** 2).sum(axis=0) / dof
    spread = np.diag(np.linalg.inv(W.T @ W))
    return theta, t.ppf(0.975, dof) * np.sqrt(np.outer(spread, variance))


def rows_of_matrices(theta: np.ndarray) -> np.ndarray:
    """Coefficients (6, 2) of both forces as M, B, K row by row (12,)."""
    return np.concatenate([theta[i : i + 2].T.ravel() for i in (0, 2, 4)])


def hand(record: Hand) -> tuple[np.ndarray, np.ndarray]:
    """M, B, K of every condition."""
    values, half = [], []
    for trials in record.conditions:
        rows = [trial_rows(record, t) for t in range(trials.start, trials.stop)]
        W, Y = (np.concatenate(part) for part in zip(*rows, strict=True))
        theta, width = least_squares(W, Y)
        values.append(rows_of_matrices(theta))
        half.append(rows_of_matrices(width))
    return np.stack(values), np.stack(half)


def joint_rows(record: Joint, trial: int) -> tuple[np.ndarray, np.ndarray]:
    """W (S, 3) and the torque (S,) of one record, means taken off, without the filter's ends."""
    b, a = butter(2, CUTOFF_HZ, fs=record.rate_hz)
    angle, torque = (
        filtfilt(b, a, x[trial] - x[trial].mean()) for x in (record.angle, record.torque)
    )
    velocity, acceleration = derivatives(angle, record.rate_hz)
    inner = slice(100, -100)
    return np.column_stack([acceleration, velocity, angle])[inner], torque[inner]


def joint(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """I, B, K of every record."""
    found = []
    for trial in range(len(record.angle)):
        W, y = joint_rows(record, trial)
        found.append(least_squares(W, y[:, None]))
    values, half = zip(*found, strict=True)
    return np.stack(values)[:, :, 0], np.stack(half)[:, :, 0]
