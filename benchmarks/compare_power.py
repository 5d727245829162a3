"""Level, power and coverage of `armimpedance compare`: measured against what is asked.

Equal truth: two groups of 40 trials of one simulated subject, and what breaks a plain permutation
test: another noise, fewer trials, both. Power: ellipses of K that differ by 30 % in size, once as a
muscle does it (co-contraction, found by bisection on the truth; B then changes too), once K alone
scaled. Beside each power stands its bound: a chi-square test whose covariance is known without
error, over the same estimator's scatter between experiments.

    python benchmarks/compare_power.py --repeats 500
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri
from scipy.stats import ncx2
from tqdm import tqdm

from armimpedance.hand.comparison import (
    ComparedGroup,
    changes,
    groups_of_recording,
    parametric_test,
    permutation_test,
    random_effects,
)
from armimpedance.hand.still import METHODS, Options
from manipulandum_sim.hand import (
    DISTURBANCES,
    NOMINAL,
    Arm,
    Condition,
    Truth,
    find_subject,
    find_truth,
    nominal_hand,
    simulate_condition,
)

Rows = Iterator[tuple[str, str, str, bool]]

CHUNK = 50
PERMUTATIONS = 499
LEVEL = (3.0, 7.0)
COVERAGE = (92.0, 98.0)
SIZE = 1.3
POWER = 90.0
TWICE = replace(
    NOMINAL,
    name="nominal x 2",
    force_sd=2 * NOMINAL.force_sd,
    drift_sd=2 * NOMINAL.drift_sd,
    tremor=2 * NOMINAL.tremor,
    voluntary_sd=2 * NOMINAL.voluntary_sd,
)
SUBJECT = find_subject("A")
ARM, HAND = Arm.of(SUBJECT), nominal_hand(SUBJECT)
TESTED = ("inertia", "viscosity", "stiffness", "all")
SYMMETRIC = np.kron(np.eye(3), [[1, 0, 0, 0], [0, 0.5, 0.5, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class Sample:
    """Many groups of trials that differ by chance alone, and their truth (12,)."""

    groups: list[ComparedGroup]
    truth: np.ndarray

    @property
    def elements(self) -> np.ndarray:
        """Symmetric elements of every estimate, (R, 9)."""
        return np.array([g.estimate.parameters for g in self.groups]) @ SYMMETRIC.T


def sample(
    title: str,
    seed: int,
    count: int,
    method: str,
    condition: Condition | None = None,
    **rig: object,
) -> Sample:
    """Simulate and estimate `count` groups, some at a time."""
    groups: list[ComparedGroup] = []
    options = Options(method=method)
    for start in tqdm(range(0, count, CHUNK), desc=title, disable=None, leave=False):
        recording, truth = simulate_condition(
            condition,
            seed=100_000 * seed + start,
            repeats=min(CHUNK, count - start),
            emg=False,
            **rig,  # type: ignore[arg-type]
        )
        groups += groups_of_recording(recording, ["condition"], options=options)
    return Sample(groups, parameters_of(truth))


def parameters_of(truth: Truth) -> np.ndarray:
    """M, B, K row by row."""
    return np.concatenate([truth.M_e[0], truth.B_e[0], truth.K_e[0]], axis=None)


def rejections(title: str, first: Sample, second: Sample, parametric: bool = False) -> np.ndarray:
    """How often p <= .05, in %: (4 matrices, T2 and distance)."""
    found = []
    pairs = list(zip(first.groups, second.groups, strict=False))
    for seed, (one, two) in enumerate(tqdm(pairs, desc=title, disable=None, leave=False)):
        if parametric:
            tests = parametric_test(one.estimate, two.estimate, draws=PERMUTATIONS, seed=seed)
        else:
            tests = permutation_test(
                one.equations,
                two.equations,
                strata=(one.disturbance, two.disturbance),
                permutations=PERMUTATIONS,
                seed=seed,
            )
        found.append([(t.p_t2 <= 0.05, t.p_distance <= 0.05) for t in tests])
    return 100 * np.mean(found, axis=0)


def level_rows(repeats: int, method: str) -> Rows:
    """Equal truth: how often the 5 % level rejects, and what the intervals hold."""
    both = sample("equal truth", 1, 2 * repeats, method)
    first, second = (Sample(part, both.truth) for part in halves(both.groups))
    few = {"sets": 2}
    noisy = sample("noise twice as large", 2, repeats, method, noise=TWICE)
    short = sample("16 trials", 3, repeats, method, **few)
    short_noisy = sample("16 noisy trials", 4, repeats, method, noise=TWICE, **few)
    eight = sample("8 trials", 5, 2 * repeats, method, sets=1)
    eights = [Sample(part, both.truth) for part in halves(eight.groups)]
    for name, one, two in (
        ("40 and 40 trials", first, second),
        ("40, 40 with noise x 2", first, noisy),
        ("40, 16", first, short),
        ("40, 16 with noise x 2", first, short_noisy),
        ("40 with noise x 2, 16", noisy, short),
        ("8 and 8", *eights),
    ):
        rates = rejections(name, one, two)
        judged = name == "40 and 40 trials"
        yield level_row(f"level, {name}: T2 of M/B/K/all, %", rates[:, 0], judged)
        yield level_row(f"level, {name}: distance of M/B/K/all, %", rates[:, 1], False)
    rates = rejections("from estimates", first, second, parametric=True)
    yield level_row("level, from RESULTS, 40 and 40: T2 of M/B/K/all, %", rates[:, 0], False)
    yield level_row("level, from RESULTS, 40 and 40: distance of M/B/K/all, %", rates[:, 1], False)
    yield from coverage_rows(first, second)


def halves(groups: list[ComparedGroup]) -> tuple[list[ComparedGroup], list[ComparedGroup]]:
    """First and second half: pairs with equal truth."""
    middle = len(groups) // 2
    return groups[:middle], groups[middle:]


def level_row(name: str, rates: np.ndarray, judged: bool) -> tuple[str, str, str, bool]:
    """Rates between the limits; others only above them count."""
    shown = "/".join(f"{rate:.1f}" for rate in rates)
    inside = bool((rates >= LEVEL[0]).all() and (rates <= LEVEL[1]).all())
    return name, shown, "3-7" if judged else "", inside or not judged


def coverage_rows(first: Sample, second: Sample) -> Rows:
    """How often the intervals of changes hold no change."""
    held: dict[tuple[str, str], list[bool]] = {}
    for one, two in zip(first.groups, second.groups, strict=True):
        for c in changes(one.estimate, two.estimate):
            none = 0.0 if c.kind == "difference" else 1.0
            held.setdefault((c.matrix, c.quantity), []).append(c.low <= none <= c.high)
    for matrix in TESTED[:3]:
        rates = {q: 100 * np.mean(h) for (m, q), h in held.items() if m == matrix}
        shown = "/".join(f"{rate:.1f}" for rate in rates.values())
        met = all(COVERAGE[0] <= rate <= COVERAGE[1] for rate in rates.values())
        yield f"coverage of changes, {matrix}: {'/'.join(rates)}, %", shown, "92-98", met


def pure_rows(title: str, first: Sample, second: Sample) -> Rows:
    """K alone scaled so that its ellipse is 30 % larger."""
    change = np.zeros(12)
    change[8:] = (np.sqrt(SIZE) - 1) * first.truth[8:]
    # The motion is prescribed, so that a limb theta + change obeys b_t + A_t change.
    stiffer = [
        replace(g, equations=replace(g.equations, b=g.equations.b + g.equations.A @ change))
        for g in second.groups
    ]
    rates = rejections(f"K alone, {title}", first, Sample(stiffer, first.truth + change))
    scatter = np.cov(first.elements.T) + np.cov(second.elements.T)
    yield from power_rows(f"K alone, {title}", rates, change, scatter)


def muscle_rows(repeats: int, method: str) -> Rows:
    """Power where co-contraction makes K's ellipse 30 % larger, and where K alone does so."""
    named = [name for name in DISTURBANCES if name not in ("half_sine", "raised_cosine")]
    asked = [(name, 0.3, 0.0) for name in named]
    asked += [("minimum_jerk", 0.15, 0.0), ("minimum_jerk", 0.3, 0.1)]
    for number, (name, duration, base) in enumerate(asked):
        title = f"{name} {duration:g} s, co-contraction {100 * base:.0f} %"
        rig = {"disturbance": name, "duration_s": duration}
        one, two = (
            sample(title, seed, repeats, method, Condition("c", HAND, cocontraction=c), **rig)
            for seed, c in ((20 + 2 * number, base), (21 + 2 * number, larger(base)))
        )
        rates = rejections(title, one, two)
        scatter = np.cov(one.elements.T) + np.cov(two.elements.T)
        yield from power_rows(title, rates, two.truth - one.truth, scatter)
        same = [Sample(part, one.truth) for part in halves(one.groups)]
        yield from pure_rows(title, *same)


def larger(base: float) -> float:
    """The co-contraction at which K's ellipse is 30 % larger than at `base`."""

    def size(c: float) -> float:
        condition = Condition("c", HAND, cocontraction=c)
        found = find_truth(ARM, [condition], handle_mass_kg=0.164)
        return float(np.linalg.det(found.K_e[0]))

    low, high, wanted = base, base + 0.3, SIZE * size(base)
    for _ in range(30):
        middle = (low + high) / 2
        low, high = (middle, high) if size(middle) < wanted else (low, middle)
    return high


def power_rows(title: str, rates: np.ndarray, change: np.ndarray, scatter: np.ndarray) -> Rows:
    """Power of each statistic with the bound of T2's; asked of all three matrices together."""
    d = SYMMETRIC @ change
    for i, matrix in enumerate(TESTED):
        if matrix == "inertia":
            continue
        part = slice(3 * i, 3 * i + 3) if i < 3 else slice(0, 9)
        c = part.stop - part.start
        noncentrality = d[part] @ np.linalg.solve(scatter[part, part], d[part])
        bound = 100 * ncx2.sf(chdtri(c, 0.05), c, noncentrality)
        shown = f"{rates[i, 0]:.0f} / {rates[i, 1]:.0f} (bound {bound:.0f})"
        judged = matrix == "all"
        met = bool(rates[i, 0] >= POWER) or not judged
        wanted = f">= {POWER:g} by T2" if judged else ""
        yield f"power, {title}: {matrix}, T2 / distance, %", shown, wanted, met


def subject_rows(repeats: int) -> Rows:
    """Mean over subjects and sd between them: coverage; and of a bootstrap on two levels."""
    rng = np.random.default_rng(9)
    for n in (4, 6, 8):
        for ratio in (0.0, 0.5, 1.0, 3.0):
            held = []
            for _ in range(repeats):
                sd = rng.uniform(0.7, 1.4, n)
                y = ratio * rng.standard_normal(n) + sd * rng.standard_normal(n)
                v = sd**2 * rng.chisquare(78, n) / 78
                made = random_effects(y, v)
                reach = abs(made.mean) <= T_975[n] * made.standard_error
                low, high = made.between_limits
                held.append((reach, low <= ratio <= high, _bootstrap_holds(y, v, rng)))
            mean, between, bootstrap = 100 * np.mean(held, axis=0)
            name = f"coverage, {n} subjects, between/within sd {ratio:g}: mean/between sd, %"
            shown = f"{mean:.1f}/{between:.1f} (bootstrap {bootstrap:.0f})"
            # where subjects do not differ nothing can be as wide as asked and not wider
            met = mean >= COVERAGE[0] and between >= COVERAGE[0]
            yield name, shown, ">= 92", bool(met)


#: Quantiles of t with n - 1 degrees of freedom.
T_975 = {4: 3.18245, 6: 2.57058, 8: 2.36462}


def _bootstrap_holds(y: np.ndarray, v: np.ndarray, rng: np.random.Generator) -> bool:
    """Percentile interval of the mean: subjects drawn again, then their errors."""
    drawn = rng.integers(len(y), size=(500, len(y)))
    again = y[drawn] + np.sqrt(v[drawn]) * rng.standard_normal(drawn.shape)
    low, high = np.quantile(again.mean(axis=1), [0.025, 0.975])
    return bool(low <= 0 <= high)


def main() -> int:
    """Print measured and asked; 1 if something asked is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--repeats", type=int, default=500)
    parser.add_argument("--power-repeats", type=int, default=200)
    parser.add_argument("--method", default=METHODS.default)
    arguments = parser.parse_args()
    repeats, method = arguments.repeats, arguments.method
    print(f"{repeats} pairs of groups with equal truth, {arguments.power_repeats} with another")
    print(f"method {method}")
    missed = False
    for rows in (
        subject_rows(repeats),
        level_rows(repeats, method),
        muscle_rows(arguments.power_repeats, method),
    ):
        for name, shown, wanted, met in rows:
            verdict = ("met" if met else "MISSED") if wanted else ""
            print(f"{name:78s} {shown:36s} {wanted:14s} {verdict}", flush=True)
            missed |= not met
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
