"""Removing what the limb did on its own: an offset and a ramp, from both sides of the equation.

With a virtual position that drifts at constant velocity (25), the impedance equation holds for
any linear operator that annihilates an offset and a ramp, applied to position, velocity,
acceleration **and** force. Two such operators:

- `end_operator`, ``P s = s - s(t0) - r (s(tf) - s(t0))``, ``r = (t - t0)/(tf - t0)``: exact for
  whatever motion remains at tf, but it hangs on the noise of two samples;
- ``P s = s - Q Q^T s`` with `ramp_basis` Q, the least-squares projection, which uses the whole
  window.

The source corrects the force alone (29), `correct_force_only`: exact only where displacement,
velocity and acceleration are all zero again at tf.
"""

from __future__ import annotations

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError


def ramp_basis(lag_s: FloatArray) -> FloatArray:
    """Orthonormal basis Q (S, 2) of an offset and a ramp; ``P s = s - Q Q^T s`` removes both.

    Parameters
    ----------
    lag_s : (S,)

    Returns
    -------
    (S, 2) array
        Orthonormal columns that span an offset and a ramp.

    Raises
    ------
    InputError
        If there are fewer than three lags: nothing would be left.
    """
    if len(lag_s) < 3:
        raise InputError(f"a window of {len(lag_s)} samples", expected="at least 3")
    centred = lag_s - lag_s.mean()
    basis = np.column_stack([np.ones_like(centred), centred])
    return np.asarray(basis / np.linalg.norm(basis, axis=0))


def end_operator(lag_s: FloatArray, start: int, end: int) -> FloatArray:
    """Matrix (S, S) of ``P s = s - s(t0) - r(t) [s(tf) - s(t0)]`` with samples `start`, `end`."""
    r = (lag_s - lag_s[start]) / (lag_s[end] - lag_s[start])
    operator = np.eye(len(lag_s))
    operator[:, start] -= 1 - r
    operator[:, end] -= r
    return operator


def correct_force_only(force: FloatArray, lag_s: FloatArray, start: int, end: int) -> FloatArray:
    """The source's drift correction (29) on forces (T, S, d), from single samples at t0 and tf.

    ``dF_d = dF - (t - t0)/(tf - t0) dF(tf)``, ``dF = F - F(t0)``.

    Parameters
    ----------
    force : (T, S, d)
    lag_s : (S,)
    start, end : int
        Samples of t0 and tf.

    Returns
    -------
    (T, S, d) array
        Forces without the drift, N.
    """
    return np.matmul(end_operator(lag_s, start, end), force)
