"""statsmodels' least squares on a laboratory's derivatives, with its robust standard errors."""

from __future__ import annotations

import numpy as np
import statsmodels.api as sm
from record import Hand, Joint
from scipy.signal import detrend
from with_scipy import joint_rows, rows_of_matrices, trial_rows

#: Samples over which residuals of a joint hang together (HAC of Newey and West): .1 s.
LAGS = 100


def _fit(W: np.ndarray, Y: np.ndarray, **kind: object) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (p, q) and half widths of their 95 % intervals, t distributed."""
    fits = [sm.OLS(y, W).fit(use_t=True, **kind) for y in Y.T]
    limits = np.stack([f.conf_int() for f in fits], axis=1)
    return np.stack([f.params for f in fits], axis=1), (limits[..., 1] - limits[..., 0]) / 2


def _hand(record: Hand, drift: bool) -> tuple[np.ndarray, np.ndarray]:
    values, half = [], []
    for trials in record.conditions:
        rows = [trial_rows(record, t) for t in range(trials.start, trials.stop)]
        if drift:
            # as an offset and a slope of every trial in the fit (Frisch, Waugh and Lovell)
            rows = [(detrend(W, axis=0), detrend(Y, axis=0)) for W, Y in rows]
        cluster = np.repeat(np.arange(len(rows)), len(rows[0][0]))
        W, Y = (np.concatenate(part) for part in zip(*rows, strict=True))
        theta, width = _fit(W, Y, cov_type="cluster", cov_kwds={"groups": cluster})
        values.append(rows_of_matrices(theta))
        half.append(rows_of_matrices(width))
    return np.stack(values), np.stack(half)


def hand(record: Hand) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the SciPy loop, standard errors clustered by trial."""
    return _hand(record, drift=False)


def hand_drift(record: Hand) -> tuple[np.ndarray, np.ndarray]:
    """The same with an offset and a slope for every trial."""
    return _hand(record, drift=True)


def joint(record: Joint) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the SciPy loop, standard errors of residuals that hang together."""
    found = []
    for trial in range(len(record.angle)):
        W, y = joint_rows(record, trial)
        found.append(_fit(W, y[:, None], cov_type="HAC", cov_kwds={"maxlags": LAGS}))
    values, half = zip(*found, strict=True)
    return np.stack(values)[:, :, 0], np.stack(half)[:, :, 0]
