"""The motion that a command explains, from its neighbours in frequency alone.

About line k the response to a command is nearly constant: ``Theta_j = (g0 + g1 d + g2 d^2) R_j +
t0 + t1 d``, ``d = j - k``, over the lines beside it; t0, t1 take up what the record owes to its
ends (R. Pintelon, J. Schoukens, System Identification, 2nd ed. 2012, chapter 7, the local
polynomial method). Line k itself is left out, so ``g0 R_k`` holds nothing of its noise, sensors'
or subject's, whatever device lies between command and joint.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.joint.elbow.stationary.band import Complex

#: Lines on each side that the local fit rests on.
SIDE: Final = 10
#: Added to the squares of its columns, relative: lines without command explain nothing.
_RIDGE: Final = 1e-9


def explained_motion(angle: Complex, command: Complex) -> Complex:
    """What the command explains of the angle, each line left out of the fit for it.

    Parameters
    ----------
    angle, command : (n,) complex
        Neighbouring Fourier coefficients of one trial.

    Returns
    -------
    (n,) complex
    """
    n = len(angle)
    width = min(2 * SIDE + 1, n)
    first = np.clip(np.arange(n) - width // 2, 0, n - width)
    window = first[:, None] + np.arange(width)
    d = (window - np.arange(n)[:, None]) / SIDE
    R = command[window]
    # X (n, width, 5) [g0 g1 g2 t0 t1] (5,) = Theta (n, width), line k itself weighed by zero
    size = np.sqrt((np.abs(R) ** 2).mean(axis=1, keepdims=True)) + np.finfo(float).tiny
    X = np.stack([R, R * d, R * d**2, size + 0 * d, size * d], axis=-1)
    X = X * (d != 0)[..., None]
    across = np.conj(X).transpose(0, 2, 1)
    gram = across @ X
    scale = np.trace(gram, axis1=1, axis2=2).real[:, None, None] + np.finfo(float).tiny
    gram = gram + _RIDGE * scale * np.eye(5)
    fitted = np.linalg.solve(gram, across @ angle[window][..., None])[..., 0]
    return np.asarray(fitted[:, 0] * command)
