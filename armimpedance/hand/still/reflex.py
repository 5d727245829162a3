"""The reflex guard: is the stiffness the limb's own, or partly a response of the nervous system?

A stretch reflex follows a disturbance with a delay of some tens of milliseconds. A fit of M, B and
K takes it for stiffness (or, if the disturbance is over by then, for negative stiffness), and the
multiple correlation does not show it. Three views of the same trials: a test over many delays
(`reflex_evidence`), a fit with a delayed position term, and the stiffness of windows that end
before a reflex can act (`reflex_ends`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import Kind
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording, Window
from armimpedance.hand.still.estimation import DEFAULT_BY, error_in_group, groups_of
from armimpedance.hand.still.methods import exact
from armimpedance.hand.still.reflex_scan import (
    DelayFits,
    DelayScan,
    Evidence,
    scan_delays,
    visible_share,
    weigh,
)
from armimpedance.hand.still.reflex_verdict import (
    LEVEL,
    NEGLIGIBLE_SHARE,
    TELLING_S,
    TELLING_SHARE,
    DelayProfile,
    Outcome,
    ReflexVerdict,
    Share,
    window_ends,
)
from armimpedance.hand.still.result import require_identifiable
from armimpedance.numerics.signals import cut_windows, disturbance_times

#: Delays that are scanned (s).
SCAN_S = tuple(round(0.030 + 0.0025 * step, 4) for step in range(37))
#: Limits of a stated delay (s).
DELAYS_S = (0.005, 0.300)
#: Delays (s) for which the detection limit of a reflex is reported.
VISIBLE_S = (0.040, 0.050, 0.060, 0.080, 0.100)
#: With fewer trials neither noise nor chance can be judged.
FEWEST_TRIALS = 8
#: Delays of less weight are left out of the mean over delays.
_LEAST_WEIGHT = 1e-4


def reflex_guard(
    recording: Recording,
    *,
    by: Sequence[str] = DEFAULT_BY,
    delay_s: float | None = None,
    seed: int = 0,
    ends: bool = True,
    progress: Progress | None = None,
) -> list[ReflexVerdict]:
    """Judge every group of trials.

    Parameters
    ----------
    recording : Recording
        Recording of returning disturbances.
    by : sequence of str
        Columns of the trial table; trials alike in all of them form a group.
    delay_s : float, optional
        Delay of the reflex if it is known, for example from EMG; default: scanned from 30 to 120
        ms.
    seed : int
        Seed of the random signs behind p.
    ends : bool
        Fit windows that end early too.
    progress : function (done, all), optional

    Returns
    -------
    list of ReflexVerdict
        One verdict per group, in the order of the groups.

    Raises
    ------
    InputError
        Stochastic perturbations, too few trials, a delay out of range, a missing column.
    NotIdentifiableError
        If a group's motion does not determine M, B and K.
    """
    if recording.perturbation == "stochastic":
        raise InputError(
            "stochastic perturbations: no onset to count a delay from",
            expected="disturbances that return",
        )
    groups = list(groups_of(recording, by))
    timing = disturbance_times(recording)
    verdicts = []
    for done, (keys, rows) in enumerate(groups, start=1):
        try:
            window = cut_windows(recording, rows, timing)
            verdict = guard_window(
                window, recording.kind, keys=keys, delay_s=delay_s, seed=seed, ends=ends
            )
        except ArmImpedanceError as error:
            raise error_in_group(error, keys) from error
        verdicts.append(verdict)
        if progress is not None:
            progress(done, len(groups))
    return verdicts


def guard_window(
    window: Window,
    kind: Kind,
    *,
    keys: Mapping[str, Any] | None = None,
    delay_s: float | None = None,
    seed: int = 0,
    ends: bool = True,
) -> ReflexVerdict:
    """Judge one group from its raw windows (used by simulations).

    Parameters
    ----------
    window : Window
        Raw samples of T trials around each onset.
    kind : {"hand", "joint"}
    keys : mapping, optional
        The group's columns.
    delay_s : float, optional
        Delay of the reflex if it is known.
    seed : int
        Seed of the random signs behind p.
    ends : bool
        Fit windows that end early too.

    Returns
    -------
    ReflexVerdict
        The outcome, its p value, the reflex's delay in s, and the overstatement of K.
    """
    _check(window, delay_s)
    require_identifiable(exact.prepare(window, kind).factors)
    scanned = delay_s is None
    delays = np.array(SCAN_S) if delay_s is None else np.array([delay_s])
    scan = scan_delays(window, kind, delays)
    evidence = weigh(scan, seed)
    profile = DelayProfile(delays, evidence.log_ratio, evidence.weight)
    stiffnesses, covariance = _over_delays(scan, evidence)
    trials = scan.equation.trials
    d = window.axes
    without, intrinsic, reflex = stiffnesses.reshape(3, d, d)
    seen = evidence.p_value <= LEVEL and not _negligible(stiffnesses, covariance)
    visible = () if seen else _visible(scan, seed)
    overstated, share = _shares(stiffnesses, covariance, d, float(trials - 1))
    return ReflexVerdict(
        keys=dict(keys or {}),
        kind=kind,
        outcome="contaminated" if seen else _unless_hidden(visible),
        p_value=evidence.p_value,
        delay_s=float(profile.weight @ delays),
        delay_low_s=profile.quantile(0.025) if scanned else float(delays[0]),
        delay_high_s=profile.quantile(0.975) if scanned else float(delays[0]),
        scanned=scanned,
        without=without,
        intrinsic=intrinsic,
        reflex=reflex,
        covariance=covariance,
        dof=float(trials - 1),
        overstated=overstated,
        share=share,
        visible=visible,
        profile=profile,
        ends=window_ends(window, kind) if ends else None,
        n_trials=trials,
    )


def _check(window: Window, delay_s: float | None) -> None:
    trials = int(window.usable.sum())
    if trials < FEWEST_TRIALS:
        raise InputError(
            f"{trials} usable trials: chance cannot be distinguished from a reflex",
            expected=f"{FEWEST_TRIALS} or more",
        )
    if delay_s is not None and not DELAYS_S[0] <= delay_s <= DELAYS_S[1]:
        low, high = (1e3 * limit for limit in DELAYS_S)
        raise InputError(f"a reflex {1e3 * delay_s:g} ms late", expected=f"{low:g} to {high:g} ms")


def _over_delays(scan: DelayScan, evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Mean of K without, K and R over delays, and its covariance within and between delays."""
    chosen = evidence.weight >= _LEAST_WEIGHT * evidence.weight.max()
    weight = evidence.weight[chosen] / evidence.weight[chosen].sum()
    fits: DelayFits = scan.keep(chosen).stiffness()
    mean = weight @ fits.found
    apart = fits.found - mean
    within = np.einsum("d,dab->ab", weight, fits.covariance())
    return mean, within + (weight[:, None] * apart).T @ apart


def _negligible(stiffnesses: FloatArray, covariance: FloatArray) -> bool:
    """True if R plus twice its standard error is far below K."""
    q = len(stiffnesses) // 3
    largest = np.linalg.norm(stiffnesses[2 * q :]) + 2 * np.sqrt(
        np.trace(covariance[2 * q :, 2 * q :])
    )
    return bool(largest < NEGLIGIBLE_SHARE * np.linalg.norm(stiffnesses[q : 2 * q]))


def _shares(
    stiffnesses: FloatArray, covariance: FloatArray, d: int, dof: float
) -> tuple[Share, Share]:
    """Overstatement ``<K_without - K, K> / <K, K>`` and share ``<R, K> / <K, K>``.

    Both are those of symmetric parts.
    """
    from scipy.stats import t

    q = d * d
    swap = np.arange(q).reshape(d, d).T.ravel()
    S = (np.eye(q) + np.eye(q)[swap]) / 2
    without, k, r = (S @ part for part in stiffnesses.reshape(3, q))
    size = float(k @ k)
    over, share = float(without @ k) / size - 1, float(r @ k) / size
    none = np.zeros(q)
    # d/dK of <a, K>/<K, K> is (a - 2 <a, K>/<K, K> K)/<K, K>
    slopes = (
        np.concatenate([S @ k, S @ (without - 2 * (over + 1) * k), none]) / size,
        np.concatenate([none, S @ (r - 2 * share * k), S @ k]) / size,
    )
    factor = float(t.ppf(0.975, dof))
    half = [factor * float(np.sqrt(slope @ covariance @ slope)) for slope in slopes]
    return (
        Share(over, over - half[0], over + half[0]),
        Share(share, share - half[1], share + half[1]),
    )


def _visible(scan: DelayScan, seed: int) -> tuple[tuple[float, float], ...]:
    delays = VISIBLE_S if len(scan.delay_s) > 1 else (float(scan.delay_s[0]),)
    return tuple((delay, visible_share(scan, delay, LEVEL, seed)) for delay in delays)


def _unless_hidden(visible: tuple[tuple[float, float], ...]) -> Outcome:
    nearest = min(visible, key=lambda pair: abs(pair[0] - TELLING_S))
    return "none" if nearest[1] <= TELLING_SHARE else "unknown"
