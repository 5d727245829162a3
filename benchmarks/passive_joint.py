"""Passive elbow from markers at 30 frames/s: errors, the source's sds, coverage of intervals.

Run: ``python benchmarks/passive_joint.py [--runs 200]``. Subject 1, test P5 of 700 frames and the
release test of 1100, markers with 0.5 mm of noise, joint angles by `limb.mocap.joint_motion`; the
rest angle is known. Exits 1 if something asked for is missed.
"""

from __future__ import annotations

import argparse
import os
import sys
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from armimpedance.core.errors import EstimationError
from armimpedance.joint.relaxed import METHODS, PassiveSamples, from_motion, identify_passive
from armimpedance.limb.mocap import joint_motion
from manipulandum_sim.passive import Chain, base_motion, find_passive_subject, simulate_passive_many
from manipulandum_sim.studio import Studio

ELBOW = "right_elbow_flexion"
NAMES = ("k", "h", "f")
BATCH = 40
#: Subject 1, P5 (Venture elbow, table II): relative sds in percent, and the condition number, of
#: which the source does not say whether its columns were scaled.
PRINTED_RELATIVE_SD = np.array([0.179, 21.7, 30.1])
CONDITIONS = (2.2, 3.1)
#: Viscosity that plain least squares returns is compared with the truth where the friction is the
#: one that the source prints. The source does not say its filter (Hz), on which the bias hangs.
PRINTED_FRICTION = -0.015
BIAS_CUTOFFS_HZ = (5.0, 6.0, 8.0)
#: Fewer runs than this do not judge a coverage: 95 +- 4 % at two standard errors.
FEWEST_RUNS = 100


class Checks:
    """Prints measured against asked and remembers misses."""

    def __init__(self) -> None:
        self.missed = 0

    def say(self, what: str, measured: float, low: float, high: float) -> None:
        """One line; missed outside of [low, high]."""
        held = low <= measured <= high
        self.missed += not held
        print(
            f"  {what:46s} {measured:10.4g}   asked {low:g} to {high:g}   {'' if held else 'MISS'}"
        )


def recordings(test, seeds, subject="1"):
    """Motions from markers and truths, in batches."""
    for start in range(0, len(seeds), BATCH):
        batch = seeds[start : start + BATCH]
        for markers, truth in simulate_passive_many(test, batch, subject=subject):
            yield joint_motion(markers).motion, truth


def study(motions, rest, method, cutoff_hz=8.0):
    """Values, source's sds, limits, conditions raw and scaled of recordings; how many failed."""
    rows, failed = [], 0
    for motion in motions:
        samples = from_motion(motion, [ELBOW], cutoff_hz=cutoff_hz)
        try:
            (fit,) = identify_passive(samples, rest_angle=rest, method=method, cross_validate=False)
        except EstimationError:
            failed += 1
            continue
        found = [fit.parameters[name] for name in NAMES]
        conditions = (fit.torque_fit.cond_raw, fit.torque_fit.cond_scaled)
        rows.append([[p.value, p.sd, *p.ci95, *conditions] for p in found])
    return np.array(rows).transpose(2, 0, 1), failed


def report(checks, motions, truth, test):
    """Errors of all methods on one test; coverage is judged where there are runs enough."""
    i = truth.joints.index(ELBOW)
    x = np.array([truth.k[i], truth.h[i], truth.f[i]])
    found = {}
    for method in METHODS:
        began = time.perf_counter()
        (value, sd, low, high, raw, scaled), failed = study(motions, float(truth.q_r[i]), method)
        seconds = (time.perf_counter() - began) / len(motions)
        bias, spread = value.mean(axis=0) - x, value.std(axis=0, ddof=1)
        cover = 100 * ((low <= x) & (x <= high)).mean(axis=0)
        found[method] = (value, bias, cover, failed)
        print(f"{test}, {method}: {len(value)} fits, {seconds:.2f} s each")
        for name, *row in zip(NAMES, x, bias, spread, sd.mean(axis=0), cover, strict=True):
            true, off, scatter, source, covered = row
            print(
                f"  {name}: true {true:.4g}, bias {off:+.2g}, sd {scatter:.2g}, "
                f"source's sd {source:.2g}, cover {covered:.0f} %"
            )
        print(f"  condition raw {np.median(raw):.2f}, scaled {np.median(scaled):.2f}")
    value, bias, cover, _ = found["parallel"]
    checks.say(
        "parallel: 95th percentile of |k error|, %",
        100 * np.percentile(np.abs(value[:, 0] / x[0] - 1), 95),
        0,
        1,
    )
    checks.say("parallel: |mean bias of h|, %", 100 * abs(bias[1]) / x[1], 0, 5)
    checks.say("parallel: |mean bias of f|, N m", abs(bias[2]), 0, 0.002)
    judged = zip(NAMES, cover, strict=True) if len(motions) >= FEWEST_RUNS else ()
    for name, share in judged:
        checks.say(f"parallel: coverage of {name}, %", share, 88, 98)
    _, bias, cover, failed = found["output-error"]
    checks.say("output-error: |mean bias of h|, %", 100 * abs(bias[1]) / x[1], 0, 1)
    checks.say("output-error: |mean bias of f|, N m", abs(bias[2]), 0, 0.001)
    checks.say("output-error: fits refused, %", 100 * failed / len(motions), 0, 1)
    judged = zip(NAMES, cover, strict=True) if len(motions) >= FEWEST_RUNS else ()
    for name, share in judged:
        checks.say(f"output-error: coverage of {name}, %", share, 88, 98)


def pendulum(truth):
    """Inertia and gravity torque(q) of the forearm below a held arm, by the simulator's chain."""
    skeleton = find_passive_subject("1").skeleton
    base = truth.columns[truth.joints.index(ELBOW)]
    q = truth.q[:1, :base]
    still = base_motion(skeleton, "right_upper_arm", q, 0 * q, 0 * q)
    angles = 2 * np.pi * np.arange(3)[:, None] / 3
    chain = Chain(skeleton.segments[skeleton.index("right_upper_arm") + 1 :])
    M, bias = chain.mass_and_bias(angles, 0 * angles, np.repeat(still, 3, axis=0))
    rows = np.hstack([np.ones_like(angles), np.cos(angles), np.sin(angles)])
    return float(M[0, 0, 0]), np.linalg.solve(rows, bias[:, 0])


def swung(x, start, count, inertia, weight):
    """Angles of a free swing, k, h and an offset given, by `scipy.integrate.solve_ivp`."""

    def law(_, y):
        gravity = weight @ [1.0, np.cos(y[0]), np.sin(y[0])]
        return [y[1], -(x[0] * y[0] + x[1] * y[1] + x[2] + gravity) / inertia]

    times = np.arange(count) / 30
    return solve_ivp(law, (0, times[-1]), start, t_eval=times, rtol=1e-8, atol=1e-9).y[0]


def direct(motion, inertia, weight):
    """k, h, q_r by least squares of the whole swings themselves, the held arm known to be still."""
    column = motion.skeleton.coordinates.index(ELBOW)
    trials = [motion.coordinates[motion.samples_of(t), column] for t in range(motion.n_trials)]

    def left(p):
        starts = p[3:].reshape(-1, 2)
        return np.concatenate(
            [
                m - swung(p[:3], start, len(m), inertia, weight)
                for m, start in zip(trials, starts, strict=True)
            ]
        )

    first = [3.0, 0.03, -4.5] + [v for m in trials for v in (m[0], 0.0)]
    x = least_squares(left, first, x_scale=np.maximum(np.abs(first), 0.1)).x
    return np.array([x[0], x[1], -x[2] / x[0]])


def beside_a_direct_optimiser(checks, count):
    """`output-error` with f known to be 0 beside `direct`, on the same releases, q_r free."""
    who = find_passive_subject("1").with_joint(ELBOW, f=0.0)
    pairs = list(recordings("release", range(7000, 7000 + count), who))
    i = pairs[0][1].joints.index(ELBOW)
    x = np.array([getattr(pairs[0][1], name)[i] for name in ("k", "h", "q_r")])
    rms = {}
    limb = pendulum(pairs[0][1])
    rms["direct"] = np.array([direct(motion, *limb) for motion, _ in pairs]) - x
    found = []
    for motion, _ in pairs:
        samples = from_motion(motion, [ELBOW])
        fit = identify_passive(samples, rest_angle="free", friction=False, cross_validate=False)[0]
        found.append(fit.parameters.values)
    rms["output-error"] = np.array(found) - x
    size = {name: np.sqrt((error**2).mean(axis=0)) for name, error in rms.items()}
    for name, (k, h, q_r) in size.items():
        print(f"{name}: RMSE of k {k:.2g}, h {h:.2g}, q_r {q_r:.2g}")
    for j, name in enumerate(("k", "h")):
        ratio = size["output-error"][j] / size["direct"][j]
        # two RMSEs of 20 fits each that were independent would differ by 16 %; these are not
        checks.say(f"RMSE of {name} over the direct optimiser's", ratio, 0, 1.2)


def as_the_source(checks, motions, rest):
    """The source's estimator and covariance, relative to its own estimates, as it prints them."""
    (value, sd, _, _, raw, scaled), _ = study(motions, rest, "ls")
    print(f"the source's sds: ls, 0.5 mm, 8 Hz, {len(value)} fits")
    relative = np.median(100 * sd / np.abs(value), axis=0)
    for name, mine, printed in zip(NAMES, relative, PRINTED_RELATIVE_SD, strict=True):
        checks.say(f"relative sd of {name} over the printed one", mine / printed, 0.65, 1.35)
    checks.say("condition, raw", float(np.median(raw)), *CONDITIONS)
    checks.say("condition, columns scaled", float(np.median(scaled)), *CONDITIONS)


def bias_of_the_source(checks, runs):
    """What sign(qd) unfiltered does to h where the friction is the printed one."""
    who = find_passive_subject("1").with_joint(ELBOW, f=PRINTED_FRICTION)
    motions, truths = zip(*recordings("p5", range(runs), who), strict=True)
    i = truths[0].joints.index(ELBOW)
    rest, h = float(truths[0].q_r[i]), float(truths[0].h[i])
    largest = 0.0
    for cutoff_hz in BIAS_CUTOFFS_HZ:
        for method in ("ls", "parallel"):
            (value, *_), _ = study(motions, rest, method, cutoff_hz)
            off = 100 * (value[:, 1] / h - 1)
            error = off.std(ddof=1) / np.sqrt(len(off))
            print(
                f"f = {PRINTED_FRICTION}, {cutoff_hz:g} Hz, {method}: "
                f"h {off.mean():+.1f} +- {error:.1f} %, f {value[:, 2].mean():+.4f} N m"
            )
            if method == "ls":
                largest = max(largest, abs(off.mean()))
    # on this rig it stays just below; the pendulum of the unit tests shows 30 %
    checks.say("ls: largest |mean bias of h| of these, %", largest, 20, 100)


def exact(checks):
    """Exact angles, velocities and torques of the rig, frames held by friction left out."""
    markers, truth = simulate_passive_many("p5", [0], studio=Studio(0.0))[0]
    i = truth.joints.index(ELBOW)
    moves = ~truth.held[:, i]
    column = truth.columns[i]
    q, qd, torque = (
        a[moves] for a in (truth.q[:, column], truth.qd[:, column], truth.torque[:, i])
    )
    samples = PassiveSamples(
        markers.sample_rate_hz,
        np.array([0, len(q)]),
        (ELBOW,),
        q[:, None],
        qd[:, None],
        -torque[:, None],
        q[:, None],
    )
    x = np.array([truth.k[i], truth.h[i], truth.f[i]])
    for method in ("ls", "parallel"):
        (fit,) = identify_passive(samples, rest_angle=float(truth.q_r[i]), method=method)
        values = np.array([fit.parameters[name].value for name in NAMES])
        worst = np.abs(values / x - 1).max()
        checks.say(f"{method}: exact data, worst relative error", worst, 0, 1e-6)


def main() -> int:
    """Run all; 1 if something is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=200)
    runs = parser.parse_args().runs
    checks = Checks()
    exact(checks)
    bias_of_the_source(checks, max(runs // 5, 4))
    for test, count in (("p5", runs), ("release", max(runs // 5, 2))):
        pairs = list(recordings(test, range(count)))
        motions, truth = [m for m, _ in pairs], pairs[0][1]
        report(checks, motions, truth, test)
        if test == "p5":
            as_the_source(checks, motions, float(truth.q_r[truth.joints.index(ELBOW)]))
    beside_a_direct_optimiser(checks, min(runs, 20))
    print("missed:", checks.missed)
    return int(checks.missed > 0)


if __name__ == "__main__":
    sys.exit(main())
