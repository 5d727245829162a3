"""What intervals hold of a limb that is not the one of the model, with and without allowance.

    python benchmarks/allowed_departures.py --records 40 --seed 0
    python benchmarks/allowed_departures.py --conditions 8

The hand of `broken/hand_plant.py`: 16 pushes of 5 mm and .3 s for each condition. Printed, for each
departure: coverage of the elements of M, B and K in per cent without and with allowance, the median
growth of the intervals, and how many records have a row that warns. More conditions are of the same
limb: what they say of a departure is put together.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
from dataclasses import replace

import numpy as np
from broken import damage
from broken.hand_plant import Hand

import armimpedance as ai
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.still import estimate
from armimpedance.numerics.regression import t_factor

LIMBS = {
    "nothing broken": Hand(),
    "reflex of 10 % after 40 ms": Hand(reflex=0.1, delay_s=0.04),
    "reflex of 25 % after 40 ms": Hand(reflex=0.25, delay_s=0.04),
    "reflex of 25 % after 55 ms": Hand(reflex=0.25),
    "reflex of 25 % after 80 ms": Hand(reflex=0.25, delay_s=0.08),
    "reflex of 50 % after 55 ms": Hand(reflex=0.5),
    "reflex of 25 % after 40 ms, muscle of 20 ms": Hand(reflex=0.25, delay_s=0.04, muscle_s=0.02),
    "reflex to the velocity, 40 ms, muscle of 20 ms": Hand(
        reflex_rate_s=0.025, delay_s=0.04, muscle_s=0.02
    ),
    "reflex to both, 60 ms, muscle of 10 ms": Hand(
        reflex=0.15, reflex_rate_s=0.015, delay_s=0.06, muscle_s=0.01
    ),
    "push of 1 N from 120 ms on": Hand(answers_N=1.0),
    "stiffness + 50 % at 5 mm": Hand(cubic=50 / 0.005**2),
    "dry friction of .1 N": Hand(friction_N=0.1),
}
GAINS = {"one axis 20 % off": 1.2, "one axis 10 % off": 1.1}


def held(estimates: list[ImpedanceEstimate], truth: np.ndarray) -> np.ndarray:
    """Share of the elements of M, B, K within their intervals, (3,)."""
    inside = [
        np.abs(one.parameters - truth) <= t_factor(one.dof) * one.sd.ravel() for one in estimates
    ]
    return np.asarray(np.mean(inside, axis=0).reshape(3, -1).mean(axis=1))


def line(limb: Hand, gain: float, records: int, seed: int) -> str:
    """What is printed of one departure."""
    shares, growth, warned = [], [], 0
    truth = np.array(list(limb.truth.values()))
    rng = np.random.default_rng(seed)
    for index in range(records):
        recording: Recording = limb.record(seed * records + index, "allowed").record
        if gain != 1:
            recording = damage.gain("force", (1.0, gain))(recording, rng)
        plain = estimate(recording)
        wide = list(ai.estimate(recording))
        shares.append([held(plain, truth), held(wide, truth)])
        growth.append(
            np.mean([w.sd / p.sd for w, p in zip(wide, plain, strict=True)], axis=(0, 2, 3))
        )
        warned += any(one.warnings for one in wide)
    parts = [*(100 * np.mean(shares, axis=0)), np.median(growth, axis=0)]
    texts = ["/".join(f"{v:.0f}" for v in part) for part in parts[:2]]
    return " | ".join([*texts, "/".join(f"{v:.2f}" for v in parts[2]), f"{warned} of {records}"])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--records", type=int, default=40)
    parser.add_argument("--conditions", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    names = tuple(f"level {i}" for i in range(asked.conditions))
    print("| | without | with | wider | warned |\n| --- | --- | --- | --- | --- |")
    rows = [(name, limb, 1.0) for name, limb in LIMBS.items()]
    rows += [(name, Hand(), gain) for name, gain in GAINS.items()]
    for name, limb, gain in rows:
        limb = replace(limb, conditions=names, stiffer=(1.0,) * asked.conditions)
        print(f"| {name} | {line(limb, gain, asked.records, asked.seed)} |", flush=True)


if __name__ == "__main__":
    main()
