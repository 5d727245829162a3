"""Does anything that the commands do remain in the residual? What M, B, K and a reflex miss."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.stats import chi2

from armimpedance.hand.random.lines import Complex, Lines

#: The residual is held against the motion in windows of this width (Hz), or so many lines an axis.
WIDTH_HZ: Final = 1.0
LINES_EACH: Final = 8


class Misfit(NamedTuple):
    """What is left.

    Attributes
    ----------
    p : float
        Probability of as much where the model is right.
    share : float
        Its size beside the force that the model explains, over the band.
    hz : float
        Where it is largest beside the noise.
    """

    p: float
    share: float
    hz: float


def misfit_of(lines: Lines, explained: Complex, left: Complex, weight: Complex) -> Misfit:
    """Regress the residual on the explained motion, window by window.

    Parameters
    ----------
    lines : Lines
    explained, left : (L, d) complex
        Motion, and residual of the model.
    weight : (L, d, d) complex
        Inverse of the noise's spectrum.
    """
    d, f = lines.axes, lines.frequency_hz
    width = max(WIDTH_HZ, LINES_EACH * d / lines.per_hz)
    count = max(1, int((f[-1] - f[0]) / width))
    edges = np.searchsorted(f, np.linspace(f[0], f[-1] * (1 + 1e-9), count + 1))
    root = np.linalg.cholesky(weight)
    white = (np.swapaxes(root.conj(), 1, 2) @ left[..., None])[..., 0]
    found, force = [], 0.0
    remains = 0.0
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        z = explained[first:last]
        U = np.linalg.svd(z, full_matrices=False)[0]
        found.append(2 * float((np.abs(U.conj().T @ white[first:last]) ** 2).sum()))
        kept = (np.abs(U.conj().T @ left[first:last]) ** 2).sum()
        noise = (np.abs(left[first:last]) ** 2).sum() * d / max(last - first, 1)
        remains += max(float(kept - noise), 0.0)
        force += float((np.abs(lines.force[first:last]) ** 2).sum())
    each = 2 * d * d
    # the model's own parameters took their part out of it
    spare = max(each * count - 3 * d * d, 1)
    p = float(chi2.sf(sum(found) / lines.widening, spare))
    worst = int(np.argmax(found))
    middle = float(f[edges[worst] : edges[worst + 1]].mean())
    return Misfit(p, float(np.sqrt(remains / force)) if force else 0.0, middle)
