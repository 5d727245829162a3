"""Does `estimate` find K as precisely as `plan` promised? Where a reflex can hide it does not.

    python benchmarks/plan_and_estimate.py --sessions 12 --seed 101

From a pilot of 16 pushes a plan of K within 10 %, with bumps of several durations; then so many
pushes, in sessions of one condition and of four. The interval of a plan is that of noise;
`estimate` allows for a reflex as well, as far as the trials do not exclude it.
"""

from __future__ import annotations

import argparse
from typing import Final

import numpy as np

import armimpedance as ai
from manipulandum_sim.hand import simulate

DURATIONS_S: Final = (0.15, 0.2, 0.25, 0.3)
ASKED: Final = "cocontraction_10"
BESIDE: Final = ("cocontraction_00", "cocontraction_05", "cocontraction_20")


def half_width(seed: int, sets: int, duration_s: float, conditions: list[str]) -> float:
    """The largest of K's diagonal half-widths in a session, percent of the element."""
    session, _ = simulate(
        "cocontraction", seed=seed, sets=sets, conditions=conditions, duration_s=duration_s
    )
    low, high = (matrices[2].diagonal() for matrices in ai.estimate(session)[ASKED].interval())
    return float((100 * (high - low) / (high + low)).max())


def main() -> None:
    """Print planned and found half-widths."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=12)
    parser.add_argument("--seed", type=int, default=101)
    asked = parser.parse_args()
    pilot, _ = simulate("cocontraction", seed=4, sets=2, conditions=[ASKED])
    for duration_s in DURATIONS_S:
        wish = {"shape": "minimum_jerk", "duration_s": duration_s, "max_acceleration": 6.0}
        best = ai.plan(pilot=pilot, k_percent=10, **wish).best
        planned = 100 * best.precision.k_part(best.trials)
        beside = best.apart.k_part(best.trials) / best.precision.k_part(best.trials)
        print(
            f"{duration_s} s, {best.trials} pushes: planned {planned:.1f} %, beside a reflex "
            f"{beside:.2f} times that"
        )
        for conditions in ([ASKED], [ASKED, *BESIDE]):
            seeds = range(asked.seed, asked.seed + asked.sessions)
            sets = -(-best.trials // 8)
            found = np.array([half_width(s, sets, duration_s, conditions) for s in seeds])
            print(
                f"  {len(conditions)} condition(s): {found.mean():.1f} % "
                f"({found.min():.1f} to {found.max():.1f}), {found.mean() / planned:.2f} times it",
                flush=True,
            )


if __name__ == "__main__":
    main()
