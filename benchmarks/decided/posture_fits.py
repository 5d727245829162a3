"""Models over posture: errors, definiteness, coverage and time, measured against what is asked.

Twenty postures: the hand locations of experiment 1 of the simulated subject A, through inverse
kinematics. Truths: six muscles of constant activation, scaled so that the mean of the two diagonal
elements over these postures is 15.5 N m/rad, with three kinds of moment arms. Noise: 1 N m/rad
(standard deviation) on each of ss, se, ee of the symmetric matrix, told to the models.

RMSE: root of the mean of squared errors over repeats, over ss, se, ee, and over the points of a
25 x 25 grid. "inside": those of the measured box (the range of both angles) that are in the convex
hull of the postures, 44 % of it; "box": all of the measured box; "outside": those of a box 30 %
larger that are not in the measured one.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

from armimpedance.muscles.models import (
    AngleScaling,
    GramProgram,
    JointPrediction,
    JointRows,
    Region,
    fit_posture_model,
    matrix,
    triple,
)
from armimpedance_figures.source_figure import SEED, SETS
from armimpedance_figures.tsuji1997.study import study
from manipulandum_sim.hand import Arm, find_experiment, find_subject, joint_angles

Truth = Callable[[np.ndarray], np.ndarray]
Row = tuple[str, str, str, bool]

ASKED_NOISE_FREE, ASKED_EIGENVALUE = 1e-3, -1e-8
ASKED_RMSE, ASKED_MS = 0.60, 50.0
SD = 1.0
MEAN_DIAGONAL = 15.5

# Moment arms (m) of Selen et al. 2009, Table 1, and stiffnesses (N/m) that give about
# [[15, 6], [6, 16]] N m/rad with them.
ARMS = np.array(
    [[0.0536, 0], [0.0536, 0], [0, 0.0316], [0, 0.0267], [0.0386, 0.0427], [0.0388, 0.03]]
)
STIFFNESS = np.array([1498, 1498, 5957, 5957, 2134, 2134.0])
RIPPLE = np.array([[0.2, 0], [0.2, 0], [0, 0.35], [0, 0.15], [0.25, 0.35], [0.2, 0.15]])
PEAK = np.array([[0.5, 0], [1.4, 0], [0, 1.9], [0, 0.8], [0.6, 1.8], [1.4, 0.9]])


def measured_postures() -> np.ndarray:
    """(20, 2), rad."""
    subject = find_subject("A")
    hands = np.array([c.hand for c in find_experiment("postures").conditions(subject)])
    return joint_angles(Arm.of(subject), hands)


POSTURES = measured_postures()
SCALING = AngleScaling.of(POSTURES)


def stiffness(factor: np.ndarray) -> np.ndarray:
    """``G^T K_m G`` (P, 2, 2) of moment arms ARMS times a factor (P, 6, 2)."""
    return np.einsum("m,pmi,pmj->pij", STIFFNESS, ARMS * factor, ARMS * factor)


def polynomial_arms(q: np.ndarray) -> np.ndarray:
    """Order 2; two-joint muscles' depend on both angles, by a fixed draw of coefficients."""
    rng = np.random.default_rng(3)
    c = rng.normal(0, [0.15, 0.15, 0.08, 0.08, 0.08], (6, 2, 5))
    own = np.array([[1, 0, 1, 0, 0], [0, 1, 0, 0, 1]])
    c[:4] *= own
    s, e = SCALING.scaled(q).T
    return stiffness(1 + np.einsum("pt,mjt->pmj", np.stack([s, e, s * s, s * e, e * e], 1), c))


def cosine_arms(q: np.ndarray) -> np.ndarray:
    """Cosines of the own joint's angle; two-joint muscles' also of the sum of both."""
    factor = 1 + RIPPLE * np.cos(q[:, None] - PEAK)
    factor[:, 4:] += 0.15 * np.cos(q.sum(axis=1)[:, None, None] - np.array([[2.6], [2.0]]))
    return stiffness(factor)


def peaked_arms(q: np.ndarray) -> np.ndarray:
    """Peaks mid-range, Gaussian; two-joint muscles' fall off along both angles."""
    u = SCALING.scaled(q)
    at = np.array([[-0.2, 0], [0.3, 0], [0, 0.2], [0, -0.3], [0.1, 0.2], [-0.2, -0.1]])
    factor = 0.65 + 0.5 * np.exp(-(((u[:, None] - at) / 0.6) ** 2) / 2)
    both = np.exp(-(((u - [0.1, -0.1]) / 0.8) ** 2).sum(axis=1) / 2)
    factor[:, 4:] = 0.65 + 0.5 * both[:, None, None] * factor[:, 4:]
    return stiffness(factor)


def of_human_size(truth: Truth) -> Truth:
    """The same with the mean diagonal that is asked."""
    mean = np.trace(truth(POSTURES), axis1=1, axis2=2).mean() / 2
    return lambda q: MEAN_DIAGONAL / mean * truth(q)


TRUTHS = {
    "polynomial": of_human_size(polynomial_arms),
    "cosine": of_human_size(cosine_arms),
    "peaked": of_human_size(peaked_arms),
}


@dataclass(frozen=True)
class Places:
    """Where errors are counted: angles (n, 2) and a mask (n,) of each region."""

    q: np.ndarray
    regions: dict[str, np.ndarray]


def places(scaling: AngleScaling, postures: np.ndarray) -> Places:
    """The grids of the module's docstring."""
    u = scaling.scaled(scaling.grid(25))
    wide = 1.3 * u
    ring = wide[(np.abs(wide) > 1).any(axis=1)]
    hull = Region.of(scaling.scaled(postures), tolerance=0.0).contains(u)
    no = np.zeros(len(ring), dtype=bool)
    regions = {
        "inside": np.concatenate([hull, no]),
        "box": np.concatenate([np.ones(len(u), dtype=bool), no]),
        "outside": np.concatenate([np.zeros(len(u), dtype=bool), ~no]),
    }
    return Places(scaling.angles(np.concatenate([u, ring])), regions)


@dataclass
class Score:
    """Squared errors, held intervals and indefinite postures of one model, over repeats."""

    squared: list[np.ndarray]
    held: list[np.ndarray]
    indefinite: list[np.ndarray]

    def add(self, predicted: JointPrediction, true: np.ndarray) -> None:
        fitted = predicted.stiffness
        self.squared.append((fitted - true) ** 2)
        self.held.append(np.abs(fitted - true) <= predicted.half_width("stiffness"))
        self.indefinite.append(smallest_eigenvalues(fitted) < ASKED_EIGENVALUE)

    def rmse(self, where: np.ndarray) -> float:
        return float(np.sqrt(np.mean([s[where].mean() for s in self.squared])))

    def coverage(self, where: np.ndarray) -> float:
        return 100 * float(np.mean([h[where].mean() for h in self.held]))

    def share(self, where: np.ndarray) -> float:
        return 100 * float(np.mean([i[where].mean() for i in self.indefinite]))


def smallest_eigenvalues(triples: np.ndarray) -> np.ndarray:
    return np.linalg.eigvalsh(matrix(triples))[..., 0]


def scores(truth: Truth, postures: np.ndarray, repeats: int, at: Places) -> dict[str, Score]:
    """All models on the same noisy data."""
    true, k = triple(truth(at.q)), triple(truth(postures))
    found: dict[str, Score] = {}
    cases = [(f"least squares, L = {order}", "polynomial", order, True) for order in (0, 1, 2)]
    cases += [(f"{name}, L = 2", name, 2, True) for name in ("sos", "separable", "box")]
    cases += [("sos, L = 2, sd not told", "sos", 2, False)]
    for seed in tqdm(range(repeats), disable=None, leave=False):
        K = matrix(k + np.random.default_rng(seed).normal(0, SD, k.shape))
        sd = np.full(K.shape, SD)
        told, blind = JointRows(postures, K, K, sd, sd), JointRows(postures, K, K)
        for name, model, order, known in cases:
            rows = told if known else blind
            made = fit_posture_model(rows, order=order, model=model, judged=False)
            found.setdefault(name, Score([], [], [])).add(made.predict(at.q), true)
    return found


def noise_free_rows() -> Iterator[Row]:
    """Truth of order 2 without noise, over 50 x 50 postures of the measured box."""
    q, truth = SCALING.grid(50), TRUTHS["polynomial"]
    K = truth(POSTURES)
    for model in ("polynomial", "sos"):
        made = fit_posture_model(JointRows(POSTURES, K, 0.1 * K), order=2, model=model)
        fitted = made.predict(q).stiffness
        worst = float(np.abs(fitted - triple(truth(q))).max())
        met = worst <= ASKED_NOISE_FREE
        yield f"noise-free, {model}: largest error, N m/rad", f"{worst:.1e}", "<= 1e-3", met
        if model == "sos":
            low = float(smallest_eigenvalues(fitted).min())
            name = "noise-free, sos: smallest eigenvalue on the workspace, N m/rad"
            yield name, f"{low:.3g}", ">= -1e-8", low >= ASKED_EIGENVALUE


def time_rows() -> Iterator[Row]:
    """One solution of the program for 20 postures; cvxpy is imported before."""
    import cvxpy  # noqa: F401

    u = SCALING.scaled(POSTURES)
    k = triple(TRUTHS["cosine"](POSTURES)) + np.random.default_rng(0).normal(0, SD, (20, 3))
    w = np.ones((20, 3))
    for structure in ("full", "box", "separable"):
        program = GramProgram.of(structure, 2, u)
        start = time.perf_counter()
        program.solve(k, w, 1.0)
        first = 1e3 * (time.perf_counter() - start)
        took = []
        for cost in np.linspace(0.1, 10, 20):
            start = time.perf_counter()
            program.solve(k, w, float(cost))
            took.append(1e3 * (time.perf_counter() - start))
        again = float(np.median(took))
        shown = f"{again:.1f} (first {first:.0f})"
        yield f"time of a solution, {structure}, ms", shown, "<= 50", again <= ASKED_MS


def noisy_rows(repeats: int) -> Iterator[Row]:
    """Errors, indefinite postures and coverage with noise."""
    at = places(SCALING, POSTURES)
    for name, truth in TRUTHS.items():
        found = scores(truth, POSTURES, repeats, at)
        yield from error_rows(f"{name} arms", found, at, asked=True)
    rng = np.random.default_rng(7)
    spread = SCALING.angles(rng.uniform(-1, 1, (20, 2)))
    at = places(AngleScaling.of(spread), spread)
    for name, truth in TRUTHS.items():
        found = scores(truth, spread, repeats // 4, at)
        yield from error_rows(f"{name} arms, postures anywhere in the box", found, at, asked=False)


def error_rows(title: str, found: dict[str, Score], at: Places, *, asked: bool) -> Iterator[Row]:
    """RMSE of all models, then what is asked of the default against least squares."""
    regions = at.regions
    for model, score in found.items():
        rmse = " ".join(f"{score.rmse(w):6.2f}" for w in regions.values())
        share = " ".join(f"{score.share(w):4.1f}" for w in regions.values())
        held = " ".join(f"{score.coverage(w):3.0f}" for w in regions.values())
        yield f"{title}: {model}", f"{rmse} | {share} | {held}", "", True
    if not asked:
        return
    default, least = found["sos, L = 2"], found["least squares, L = 2"]
    inside = default.rmse(regions["inside"])
    yield f"{title}: RMSE of sos inside, N m/rad", f"{inside:.3f}", "<= .60", inside <= ASKED_RMSE
    for region, where in regions.items():
        a, b = default.rmse(where), least.rmse(where)
        yield f"{title}: RMSE of sos over least squares, {region}", f"{a / b:.3f}", "< 1", a < b
    everywhere = np.ones(len(at.q), dtype=bool)
    a, b = default.share(everywhere), least.share(everywhere)
    yield f"{title}: indefinite postures, sos, %", f"{a:.2f}", "0", a == 0
    yield f"{title}: indefinite postures, least squares, %", f"{b:.2f}", "> 0", b > 0


def table_rows() -> Iterator[Row]:
    """The pattern of the source's Table 1 on the simulated subject A, as the gallery draws it."""
    made = study("postures", subject="A", seed=SEED, sets=SETS)
    rows = JointRows(
        np.array([e.joint_angles for e in made.joint]),
        np.array([e.stiffness for e in made.joint]),
        np.array([e.viscosity for e in made.joint]),
    )
    fits = [fit_posture_model(rows, order=L, model="polynomial") for L in (0, 1, 2)]
    for name, model in zip(("L = 0", "L = 1", "L = 2"), fits, strict=True):
        yield from quality_rows(f"subject A, polynomial, {name}", model.quality)
    yield from quality_rows("subject A, sos, L = 2", fit_posture_model(rows, order=2).quality)
    r = np.array([[q.r for q in model.quality] for model in fits])
    e = np.array([[q.e for q in model.quality] for model in fits])
    zero, rising = bool((r[0] == 0).all()), bool((np.diff(r, axis=0) > 0).all())
    yield "subject A: R at L = 0", f"{r[0].max():.3f}", "0", zero
    yield "subject A: R rises with L, all elements", str(rising), "True", rising
    falling = bool((np.diff(e, axis=0) < 0).all())
    yield "subject A: E falls with L, all elements", str(falling), "True", falling


def quality_rows(title: str, quality: tuple) -> Iterator[Row]:
    """R, E, leave-one-out R and null R, element by element."""
    for q in quality:
        if q.element[2:] != "es":
            shown = f"{q.r:5.2f} {q.e:7.3f} {q.leave_one_out_r:5.2f} {q.null_r:5.2f}"
            yield f"{title}, {q.element}: R, E, leave-one-out R, null R", shown, "", True


def main() -> int:
    """Print measured and asked; 1 if something asked is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=100)
    repeats = parser.parse_args().repeats
    missed = False
    print(
        f"{repeats} repeats; of a model: RMSE (N m/rad) | indefinite postures (%) | coverage (%),"
    )
    print("each inside the hull, in the measured box, outside of it")
    for rows in (noise_free_rows(), time_rows(), noisy_rows(repeats), table_rows()):
        for name, shown, wanted, met in rows:
            verdict = ("met" if met else "MISSED") if wanted else ""
            print(f"{name:74s} {shown:50s} {wanted:10s} {verdict}", flush=True)
            missed |= not met
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
