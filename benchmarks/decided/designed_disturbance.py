"""The designed disturbance against bumps and doublet: on the bound and in simulation.

40 disturbances of 5 mm an experiment, method `weighted`, nominal noise; the linear limb of
limbs.py (perfect servo) and the simulated subject behind a servo of 20 kN/m. RMSE in % of
the Frobenius norm of the symmetric part.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

# limbs.py, which several studies share, lies one folder up.
sys.path.append(str(Path(__file__).resolve().parents[1]))

import numpy as np
from limbs import LINEAR, linear_window
from tqdm import tqdm

from armimpedance.hand.planning import (
    SHAPES,
    Goal,
    Limits,
    PlannedArm,
    PlannedMotion,
    Profile,
    Setting,
    design,
    noise_named,
    precision,
)
from armimpedance.hand.still import Group, Options, estimate, estimate_window
from manipulandum_sim.hand import Servo, simulate_condition

TRIALS = 40
#: Shape and duration (s).
CASES = (
    ("minimum_jerk", 0.3),
    ("minimum_jerk", 0.15),
    ("biphasic", 0.3),
    ("designed", 0.3),
    ("reflex_separating", 0.3),
)
ASKED_RMSE_K = 3.5
#: Trials needed for the same interval on K, relative to the bumps of 0.3 and 0.15 s.
ASKED_TRIALS = {0.3: 0.2, 0.15: 0.35}
ASKED_ACCELERATION = 5.3
WEIGHTED = Options(method="weighted")
#: The linear limb's tremor is 0.08 N rms, the simulator's has that amplitude.
LIMB_NOISE = replace(noise_named("nominal"), tremor=0.08 * np.sqrt(2))


def rmse(made: list, truth: np.ndarray) -> np.ndarray:
    """Of M, B, K in %."""
    found = np.array([[one.inertia, one.viscosity, one.stiffness] for one in made])
    wrong = (found + found.transpose(0, 1, 3, 2)) / 2 - truth
    size = np.linalg.norm(truth, axis=(1, 2))
    return np.asarray(100 * np.sqrt((wrong**2).sum(axis=(2, 3)).mean(axis=0)) / size)


def on_linear_limb(shape: str, duration: float, repeats: int) -> np.ndarray:
    """RMSE of M, B, K in %."""
    group, made = Group("hand", {}), []
    for seed in tqdm(range(repeats), desc=f"{shape} {duration:g} s", disable=None, leave=False):
        window = linear_window("nominal", seed, TRIALS, duration, shape=shape)
        made.append(estimate_window(window, group, WEIGHTED))
    return rmse(made, LINEAR)


def on_subject(shape: str, duration: float, repeats: int) -> np.ndarray:
    """RMSE of M, B, K in %."""
    rig = {"disturbance": shape, "duration_s": duration, "servo": Servo(20_000.0)}
    recording, truth = simulate_condition(seed=3, repeats=repeats, emg=False, **rig)
    true = np.stack([truth.M_e[0], truth.B_e[0], truth.K_e[0]])
    return rmse(estimate(recording, options=WEIGHTED), true)


def promised(shape: str, duration: float) -> np.ndarray:
    """The bound on the linear limb with its noise: relative errors of M, B, K in one trial."""
    setting = Setting(PlannedArm(LINEAR), LIMB_NOISE)
    motion = PlannedMotion(setting, Profile(SHAPES.named(shape), 0.005, duration))
    return precision(motion).relative_sd


def report(name: str, shown: str, asked: str = "", met: bool = True) -> bool:
    """Print one row; whether something asked is missed."""
    verdict = ("met" if met else "MISSED") if asked else ""
    print(f"{name:66s} {shown:22s} {asked:12s} {verdict}", flush=True)
    return not met


def relaxed(shape: str, duration: float) -> float:
    """Sd of K of one trial, as a part of K, on the planner's own arm."""
    motion = PlannedMotion(Setting(), Profile(SHAPES.named(shape), 0.005, duration))
    return float(precision(motion).relative_sd[2])


def trials_rows() -> Iterator[tuple[str, str, str, bool]]:
    """On the bound of a relaxed arm with a handle at nominal noise."""
    own = relaxed("designed", 0.3)
    for duration, asked in ASKED_TRIALS.items():
        ratio = (own / relaxed("minimum_jerk", duration)) ** 2
        name = f"bound: trials of designed / of the bump of {duration:g} s"
        yield name, f"{ratio:.3f}", f"<= {asked:g}", bool(ratio <= asked)
    again = design(Setting(), Limits(), Goal())
    peak = again.profile.peak_acceleration
    name = "design run anew: bound of K at 40 trials, %; peak acceleration, m/s^2"
    shown = f"{100 * again.relative_sd / np.sqrt(TRIALS):.2f}; {peak:.2f}"
    yield name, shown, f"<= {ASKED_ACCELERATION:g}", peak <= ASKED_ACCELERATION


def main() -> int:
    """Print measured and asked; 1 if something asked is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=500)
    repeats = parser.parse_args().repeats
    bounds = {case: promised(*case) for case in CASES}
    missed = False
    for row in trials_rows():
        missed |= report(*row)
    print(f"M/B/K, %, {repeats} experiments of {TRIALS} disturbances")
    for shape, duration in CASES:
        title = f"{shape}, {duration:g} s"
        bound = 100 * bounds[shape, duration] / np.sqrt(TRIALS)
        report(f"{title}: bound, linear limb", "/".join(f"{v:.2f}" for v in bound))
        for limb, run in (("linear limb", on_linear_limb), ("subject, 20 kN/m", on_subject)):
            found = run(shape, duration, repeats)
            asked = f"K <= {ASKED_RMSE_K:g}" if shape == "designed" else ""
            met = not asked or bool(found[2] <= ASKED_RMSE_K)
            shown = "/".join(f"{v:.2f}" for v in found)
            missed |= report(f"{title}: RMSE, {limb}", shown, asked, met)
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
