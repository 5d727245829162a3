"""Warnings about a fit, and refusal of estimates that are not those of a limb."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from scipy.stats import chi2

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.core.findings import Finding
from armimpedance.core.records import Recording
from armimpedance.hand.random.equations import Averaged
from armimpedance.hand.random.lines import Complex, Lines
from armimpedance.hand.random.random_fit import RandomFit
from armimpedance.hand.still import is_wrist_free
from armimpedance.numerics.regression import t_factor

# Test of the residual for effects of the commands that M, B, K and a reflex do not explain.

#: The residual is compared with the motion in windows of this width (Hz), or of so many lines per
#: axis.
WIDTH_HZ: Final = 1.0
LINES_EACH: Final = 8


class Misfit(NamedTuple):
    """Residual effect of the commands.

    `p`: p-value under the model.
    `share`: its size relative to the force over the band.
    `hz`: frequency at which it is largest relative to the noise.
    """

    p: float
    share: float
    hz: float


def misfit_of(lines: Lines, explained: Complex, residual: Complex, weight: Complex) -> Misfit:
    """Regress the residual on the explained motion, window by window.

    `explained`, `left` (L, d) complex: motion, and residual of the model.
    `weight` (L, d, d) complex: inverse of the noise's spectrum.
    """
    d, f = lines.axes, lines.frequency_hz
    width = max(WIDTH_HZ, LINES_EACH * d / lines.per_hz)
    count = max(1, int((f[-1] - f[0]) / width))
    edges = np.searchsorted(f, np.linspace(f[0], f[-1] * (1 + 1e-9), count + 1))
    root = np.linalg.cholesky(weight)
    white = (np.swapaxes(root.conj(), 1, 2) @ residual[..., None])[..., 0]
    statistics, force = [], 0.0
    remains = 0.0
    for first, last in zip(edges[:-1], edges[1:], strict=True):
        z = explained[first:last]
        U = np.linalg.svd(z, full_matrices=False)[0]
        statistics.append(2 * float((np.abs(U.conj().T @ white[first:last]) ** 2).sum()))
        explained_power = (np.abs(U.conj().T @ residual[first:last]) ** 2).sum()
        noise = (np.abs(residual[first:last]) ** 2).sum() * d / max(last - first, 1)
        remains += max(float(explained_power - noise), 0.0)
        force += float((np.abs(lines.force[first:last]) ** 2).sum())
    per_window = 2 * d * d
    # degrees of freedom of the model's parameters are subtracted
    spare = max(per_window * count - 3 * d * d, 1)
    p = float(chi2.sf(sum(statistics) / lines.widening, spare))
    worst = int(np.argmax(statistics))
    middle = float(f[edges[worst] : edges[worst + 1]].mean())
    return Misfit(p, float(np.sqrt(remains / force)) if force else 0.0, middle)


#: A reflex or a lag is reported from this probability on.
NAMED: Final = 0.5
#: A reflex that is less likely than this is not mentioned.
MENTIONED: Final = 0.25
#: A misfit is reported at this p or less, if it is this share of the force.
MISFIT_P: Final = 1e-4
MISFIT_SHARE: Final = 0.002
#: Smallest asymmetry of the inertia that is reported, as a share of its mean diagonal.
UNSYMMETRIC: Final = 0.05
#: Standard errors beyond which a difference is significant.
SURE: Final = 4.0
#: Relative half-width of K's intervals above which a warning is given.
WIDE: Final = 0.5


def refuse_impossible(answer: Averaged, d: int) -> None:
    """Refuse an inertia that no limb has.

    Raises EstimationError: it is not positive definite beyond its interval.
    """
    q = d * d
    M, C = answer.values[:q].reshape(d, d), answer.covariance[:q, :q]
    values, vectors = np.linalg.eigh((M + M.T) / 2)
    w = np.kron(vectors[:, 0], vectors[:, 0])
    if values[0] + SURE * float(np.sqrt(w @ C @ w)) < 0:
        raise EstimationError(
            f"the inertia is not that of a limb (smallest eigenvalue {values[0]:.3g}): the force "
            "is the device's on the limb, or axes are exchanged or turned round; say so when the "
            "file is converted"
        )


def doubts_of(fit: RandomFit, misfit: Misfit) -> list[str]:
    """Warnings of one fit."""
    warnings = [*_of_reflex(fit), *_of_lag(fit)]
    if misfit.p < MISFIT_P and misfit.share > MISFIT_SHARE:
        warnings.append(
            f"lack of fit: {100 * misfit.share:.2g} % of the force, most about "
            f"{misfit.hz:.3g} Hz, answers the commands and is not in M, B, K and a reflex "
            f"(p {misfit.p:.1g}): a limb of more than second order, as with a free elbow, a loose "
            "grip, or one that changed; the intervals do not hold it"
        )
    estimate = fit.estimate
    M, d = estimate.inertia, estimate.k
    off = M - M.T
    sd = np.sqrt(_antisymmetric_variance(estimate.covariance[: d * d, : d * d], d))
    size = float(np.trace(M)) / d
    if (np.abs(off) > np.maximum(SURE * sd, UNSYMMETRIC * size)).any():
        warnings.append(
            "axes: the inertia is not symmetric, which no limb's is: force and motion stand in "
            "frames that are turned, or an axis of one is scaled"
        )
    half = t_factor(estimate.dof) * estimate.sd[2]
    if (np.diag(half) > WIDE * np.abs(np.diag(estimate.stiffness))).any():
        warnings.append("wide: K is not known to half of itself along every axis")
    return warnings


def of_elbow(stated: str | None) -> list[str]:
    """A warning if a reflex was detected and the elbow of an arm in space may have been free.

    The record cannot distinguish the two, so that no inner mode is subtracted.
    """
    if stated == "held":
        return []
    whose = "was free" if stated == "free" else "may have been free (column elbow of trials.csv)"
    return [
        f"inner mode: the elbow {whose}; beside a reflex its swivel is not allowed for: it hides a "
        "third of K along the softest axis and more, and the intervals do not hold it: hold the "
        "elbow, or take K from displacements that stay out (`estimate`)"
    ]


#: Effect of a free wrist on K.
_WRIST: Final = (
    "the wrist was free; forearm and hand let go of the handle at a few Hz, which is taken for a "
    "reflex and hides most of K along its softest axis, and the intervals do not hold it: lock the "
    "wrist, or take K from displacements that stay out (`estimate`)"
)


def of_wrist(*, free: bool) -> list[str]:
    """A warning if the wrist of an arm in space was free."""
    return [f"inner mode: {_WRIST}"] if free else []


def check_wrist(recording: Recording) -> tuple[Finding, ...]:
    """The finding "wrist", which stops `random`: K would be 16 to 20 % too small.

    Parameters
    ----------
    recording : Recording
        Recording of a hand under a random perturbation.

    Returns
    -------
    tuple of Finding
        Empty if the wrist was locked, or in the plane.

    Examples
    --------
    >>> from armimpedance.hand.random import check_wrist
    >>> from manipulandum_sim.random_hand import simulate_random
    >>> check_wrist(simulate_random(seed=1, trials=1, duration_s=2.0)[0])
    ()
    """
    in_space = recording.kind == "hand" and recording.axes == 3
    if not in_space or not is_wrist_free(recording, np.arange(recording.n_trials)):
        return ()
    return (Finding("wrist", "unusable", _WRIST),)


def _antisymmetric_variance(C: FloatArray, d: int) -> FloatArray:
    """Variance (d, d) of ``M - M^T``."""
    swap = np.arange(d * d).reshape(d, d).T.ravel()
    D = np.eye(d * d) - np.eye(d * d)[swap]
    return np.asarray(np.diag(D @ C @ D.T).reshape(d, d).clip(min=0))


def _of_reflex(fit: RandomFit) -> list[str]:
    r = fit.reflex
    about = f"{100 * r.share:.0f} % of K, {1e3 * r.delay_s:.0f} +- {1e3 * r.delay_sd_s:.1f} ms late"
    if r.probability > NAMED:
        return [f"reflex: {about} (probability {r.probability:.2f}); K is what answers at once"]
    if r.probability > MENTIONED:
        return [
            f"reflex: not decided (probability {r.probability:.2f}, then {about}); the intervals "
            "hold both"
        ]
    return []


def _of_lag(fit: RandomFit) -> list[str]:
    if fit.lag_probability <= NAMED:
        return []
    when = "later" if fit.lag_s > 0 else "earlier"
    return [
        f"delay: the force is recorded {1e3 * abs(fit.lag_s):.2f} ms {when} than the motion; it is "
        "taken off, for it would stand in B"
    ]
