"""Does `estimate` find K as precisely as `plan` promised, departures and all?

    python benchmarks/plan_and_estimate.py --sessions 20 --seed 101
    python benchmarks/plan_and_estimate.py --sessions 20 --pilot-sets 25 --k-percent 5

From a pilot of 16 pushes, a plan of K within 10 % for each of several pushes; then sessions of so
many pushes with one condition and with four. Printed: the larger half-width of K along x and y that
`estimate` prints over the one that the plan promised, and in how many sessions it would lie within
the asked range if both scattered by chance alone.
"""

from __future__ import annotations

import argparse
from typing import Final

import numpy as np

import armimpedance as ai
from manipulandum_sim.hand import Servo, simulate

PUSHES: Final = (
    ("minimum_jerk", 0.15),
    ("minimum_jerk", 0.2),
    ("minimum_jerk", 0.3),
    ("biphasic", 0.3),
    ("designed", 0.3),
)
ASKED: Final = "cocontraction_10"
BESIDE: Final = ("cocontraction_00", "cocontraction_05", "cocontraction_20")
SERVO_N_PER_M: Final = 20_000.0
#: What the plan is asked to keep: the median, and nine sessions of ten.
MEDIAN, NINE_OF_TEN = (0.95, 1.05), (0.85, 1.2)


def half_width(seed: int, sets: int, push: dict[str, object], conditions: list[str]) -> float:
    """The largest of K's diagonal half-widths in a session, a part of the element."""
    session, _ = simulate(
        "cocontraction", seed=seed, sets=sets, conditions=conditions, emg=False, **push
    )
    low, high = (matrices[2].diagonal() for matrices in ai.estimate(session)[ASKED].interval())
    return float(((high - low) / (high + low)).max())


def share_by_chance(trials: int, pilot: int, draws: int = 100_000) -> float:
    """How often the ratio would lie within the range if standard errors scattered by chance alone.

    Those of n trials are the root of chi^2 over its n - 1 degrees of freedom; the larger of two
    elements on both sides.
    """
    rng = np.random.default_rng(0)
    found, promised = (
        np.sqrt(rng.chisquare(n - 1, (draws, 2)) / (n - 1)).max(axis=1) for n in (trials, pilot)
    )
    ratio = found / promised
    return float(np.mean((ratio > NINE_OF_TEN[0]) & (ratio < NINE_OF_TEN[1])))


def main() -> None:
    """Print the ratio of found to promised half-widths."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=20)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--pilot-sets", type=int, default=2, help="sets of eight pushes (2)")
    parser.add_argument("--k-percent", type=float, default=10.0, help="the plan's wish (10)")
    asked = parser.parse_args()
    servo = Servo(SERVO_N_PER_M)
    everything, by_chance = [], []
    for shape, duration_s in PUSHES:
        push = {"disturbance": shape, "duration_s": duration_s, "servo": servo}
        pilot, _ = simulate(
            "cocontraction",
            seed=4,
            sets=asked.pilot_sets,
            conditions=[ASKED],
            emg=False,
            **push,
        )
        for conditions in ([ASKED], [ASKED, *BESIDE]):
            plan = ai.plan(
                pilot=pilot,
                k_percent=asked.k_percent,
                shape=shape,
                duration_s=duration_s,
                max_acceleration=6.0,
                conditions=len(conditions),
            )
            # the pilot's own push comes first
            own = plan.candidates[0]
            trials, promised = own.trials, own.precision.k_part(own.trials)
            seeds = range(asked.seed, asked.seed + asked.sessions)
            found = np.array([half_width(s, trials // 8, push, conditions) for s in seeds])
            ratio = found / promised
            everything.append(ratio)
            by_chance.append(share_by_chance(trials, 8 * asked.pilot_sets))
            print(
                f"{shape} {duration_s} s, {len(conditions)} condition(s), {trials} pushes: promised"
                f" {100 * promised:.1f} %, found over promised {_told(ratio)}",
                flush=True,
            )
    ratio = np.concatenate(everything)
    print(f"all {len(ratio)} sessions: {_told(ratio)}")
    inside = np.mean((ratio > NINE_OF_TEN[0]) & (ratio < NINE_OF_TEN[1]))
    print(f"within {NINE_OF_TEN[0]} to {NINE_OF_TEN[1]}: {100 * inside:.0f} % (asked 90)")
    print(f"by chance alone: {100 * np.mean(by_chance):.0f} %")


def _told(ratio: np.ndarray) -> str:
    low, middle, high = np.quantile(ratio, [0.05, 0.5, 0.95])
    return f"{middle:.2f} (5 to 95 %: {low:.2f} to {high:.2f})"


if __name__ == "__main__":
    main()
