"""Speed of the regression core against what a user would pick instead, as ratios in one run.

40 trials x 400 samples, 6 regressors, 2 outputs, one BLAS thread, best of several repeats.
statsmodels' side is one `OLS(...).fit(cov_type="cluster")` per output on the stacked samples,
and, where leave-one-out is compared, 40 plain refits per output. Before anything is timed the
two sides are compared number by number.

"From samples" includes making the factors. Against statsmodels *without* leave-one-out that row
is shown for honesty and not asked: an orthogonal factorisation of the samples alone takes more
than a twentieth of statsmodels' two fits, and normal equations are no way out.

Exit status 0 if every asked ratio is met, else 1.

    python benchmarks/regression_speed.py
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_threads] = "1"

import sys
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import statsmodels.api as sm

from armimpedance.numerics.regression import (
    TrialFactors,
    bootstrap,
    fit,
    leave_one_out,
    trial_factors,
)

TRIALS, SAMPLES, REGRESSORS, OUTPUTS, RESAMPLES = 40, 400, 6, 2, 1000
NAMES = {"regressors": list("abcdef"), "outputs": ["fx", "fy"]}


def best_seconds(work: Callable[..., object], arguments: list[tuple[object, ...]]) -> float:
    """Shortest run of `work`, each with arguments of its own (nothing computed may be reused)."""
    shortest = np.inf
    for given in arguments:
        start = time.perf_counter()
        work(*given)
        shortest = min(shortest, time.perf_counter() - start)
    return float(shortest)


def simulated() -> tuple[np.ndarray, np.ndarray]:
    """W (T, S, p) and Y (T, S, q) with residuals that share a part per trial."""
    rng = np.random.default_rng(0)
    W = rng.standard_normal((TRIALS, SAMPLES, REGRESSORS))
    noise = rng.standard_normal((TRIALS, SAMPLES, OUTPUTS))
    noise += rng.standard_normal((TRIALS, 1, OUTPUTS))
    return W, W @ rng.standard_normal((REGRESSORS, OUTPUTS)) + noise


def core_on_factors(factors: TrialFactors) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients, clustered standard errors and leave-one-out coefficients."""
    result = fit(factors)
    return result.coefficients, result.sd, leave_one_out(factors)


def core_on_samples(W: np.ndarray, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same, the factors included."""
    return core_on_factors(trial_factors(W, Y, **NAMES))


def statsmodels_fit(
    W: np.ndarray, Y: np.ndarray, cluster: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (p, q) and clustered standard errors (p q,)."""
    fits = [
        sm.OLS(Y[:, j], W).fit(cov_type="cluster", cov_kwds={"groups": cluster})
        for j in range(OUTPUTS)
    ]
    return np.stack([f.params for f in fits], axis=1), np.concatenate([f.bse for f in fits])


def statsmodels_leave_one_out(W: np.ndarray, Y: np.ndarray, cluster: np.ndarray) -> np.ndarray:
    """Coefficients (T, p, q) by refits."""
    return np.stack(
        [
            np.stack(
                [sm.OLS(Y[cluster != t, j], W[cluster != t]).fit().params for j in range(OUTPUTS)],
                axis=1,
            )
            for t in range(TRIALS)
        ]
    )


def measure() -> list[tuple[str, str, float, bool]]:
    """Rows of name, what was asked, measured ratio, met."""
    W, Y = simulated()
    w, y = W.reshape(-1, REGRESSORS), Y.reshape(-1, OUTPUTS)
    cluster = np.repeat(np.arange(TRIALS), SAMPLES)
    factors = trial_factors(W, Y, **NAMES)
    ours = core_on_factors(factors)
    theirs = (*statsmodels_fit(w, y, cluster), statsmodels_leave_one_out(w, y, cluster))
    for mine, reference in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(mine, reference, rtol=1e-8)

    def fresh(n: int) -> list[tuple[object, ...]]:
        return [(replace(factors),) for _ in range(n)]

    samples = best_seconds(core_on_samples, [(W, Y)] * 60)
    on_factors = best_seconds(core_on_factors, fresh(200))
    boot = best_seconds(lambda f: bootstrap(f, RESAMPLES, 0), fresh(60))
    boot_samples = best_seconds(
        lambda: bootstrap(trial_factors(W, Y, **NAMES), RESAMPLES, 0), [()] * 60
    )
    lstsq = best_seconds(lambda: np.linalg.lstsq(w, y, rcond=None), [()] * 60)
    sm_fit = best_seconds(statsmodels_fit, [(w, y, cluster)] * 15)
    sm_out = best_seconds(statsmodels_leave_one_out, [(w, y, cluster)] * 2)
    sm_both = sm_fit + sm_out
    work = "fit + CR1 + leave-one-out"
    return [
        (f"{work}, from samples / statsmodels, the same", *at_least(20, sm_both / samples)),
        (f"{work}, from factors / statsmodels, the same", *at_least(20, sm_both / on_factors)),
        (
            f"{work}, from factors / statsmodels, fit + CR1 only",
            *at_least(20, sm_fit / on_factors),
        ),
        (f"{work}, from samples / statsmodels, fit + CR1 only", "-", sm_fit / samples, True),
        (f"bootstrap of {RESAMPLES} from factors / one lstsq", *at_most(3, boot / lstsq)),
        (f"bootstrap of {RESAMPLES} from samples / one lstsq", *at_most(3, boot_samples / lstsq)),
    ]


def at_least(asked: float, measured: float) -> tuple[str, float, bool]:
    """A speed-up that was asked for."""
    return f">= {asked:g}", measured, measured >= asked


def at_most(asked: float, measured: float) -> tuple[str, float, bool]:
    """A cost that was allowed."""
    return f"<= {asked:g}", measured, measured <= asked


def main() -> int:
    """Print one row per ratio."""
    rows = measure()
    print(f"{'ratio':<70}{'asked':>8}{'measured':>10}")
    for name, asked, measured, met in rows:
        print(f"{name:<70}{asked:>8}{measured:>10.1f}{'' if met else '  MISSED'}")
    return 0 if all(met for *_, met in rows) else 1


if __name__ == "__main__":
    sys.exit(main())
