"""A posture model of a person whose reflex is in every row: what its intervals hold.

    python benchmarks/posture_in_doubt.py --reflex 0 0.1 0.3 --sessions 6 --seed 600

Persons drawn as for the open benchmark, eight pushes at each of eleven places, a reflex that is so
large a part of the stiffness after 40 ms. Printed, for B and K: the share of elements that the
intervals of the measured places hold, and those of the separable model at four places in between;
how many sessions have an estimate that warns.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse

import numpy as np

import armimpedance as ai
from armimpedance.lab.benchmark_command.task import drawn_person
from armimpedance.muscles.models import JointRows, triple
from armimpedance.numerics.regression import t_factor
from manipulandum_sim.hand import Arm, Condition, Reflex, find_experiment, find_truth, simulate

LATE_S = 0.04


def session(gain: float, seed: int) -> tuple[np.ndarray, bool]:
    """Shares held (2, 2): B and K of measured places and of the model; whether a row warns."""
    rng = np.random.default_rng(seed)
    person = drawn_person(rng)
    hands = np.array([c.hand for c in find_experiment("postures").conditions(person)])
    between = [hands[rng.permutation(len(hands))[:3]].mean(axis=0) for _ in range(4)]
    asked = [Condition(f"asked_{n}", (float(x), float(y))) for n, (x, y) in enumerate(between)]
    truth = find_truth(Arm.of(person), asked, handle_mass_kg=0.0)
    reflex = Reflex(gain, LATE_S) if gain else None
    recording, own = simulate(
        "postures", seed=seed, subject=person, sets=1, emg=False, reflex=reflex
    )
    rows = ai.to_joint(ai.estimate(recording), recording=recording)
    said = ai.fit_posture(rows, model="separable").predict(truth.posture)
    held = np.zeros((2, 2))
    parts = (("viscosity", own.B_j, truth.B_j), ("stiffness", own.K_j, truth.K_j))
    for i, (name, at_rows, at_asked) in enumerate(parts):
        off = [np.abs(getattr(e, name) - at_rows[n]) for n, e in enumerate(rows)]
        half = [t_factor(e.dof) * e.sd[1 + i] for e in rows]
        held[0, i] = np.mean(np.array(off) <= np.array(half))
        off_asked = np.abs(getattr(said, name) - triple(at_asked))
        held[1, i] = np.mean(off_asked <= said.half_width(name))
    return held, bool(JointRows.doubts_in(w for e in rows for w in e.warnings))


def main() -> None:
    """Print a line for each size of the reflex."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--reflex", type=float, nargs="+", default=[0.0, 0.1, 0.3])
    parser.add_argument("--sessions", type=int, default=6)
    parser.add_argument("--seed", type=int, default=600)
    asked = parser.parse_args()
    for gain in asked.reflex:
        seeds = range(asked.seed, asked.seed + asked.sessions)
        held, warned = zip(*(session(gain, seed) for seed in seeds), strict=True)
        (B, K), (B_model, K_model) = 100 * np.mean(held, axis=0)
        print(
            f"reflex {gain:g}: measured places hold B {B:.0f}, K {K:.0f} %; the model B "
            f"{B_model:.0f}, K {K_model:.0f} %; warned in {sum(warned)} of {asked.sessions}",
            flush=True,
        )


if __name__ == "__main__":
    main()
