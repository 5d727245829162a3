"""Which estimator should be the default? RMSE of every method where estimators differ.

Nominal and low noise, a soft servo, short disturbances, records with little rest, few trials.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

# limbs.py, which several studies share, lies one folder up.
sys.path.append(str(Path(__file__).resolve().parents[1]))

import numpy as np
from limbs import experiments, frobenius_percent
from tqdm import tqdm

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.hand.still import METHODS, Group, Options, estimate_window, in_order
from manipulandum_sim.hand import Servo

BLOCK = 10


@dataclass(frozen=True)
class Setting:
    """One design of experiment."""

    name: str
    limb: str = "subject"
    noise: str = "nominal"
    design: dict[str, Any] = field(default_factory=dict)


SETTINGS = (
    Setting("nominal noise, linear limb", "linear"),
    Setting("nominal noise, subject"),
    Setting("sensor noise, linear limb", "linear", "sensor"),
    Setting("sensor noise, subject", noise="sensor"),
    Setting("soft servo, 5 kN/m", design={"servo": Servo(5_000.0)}),
    Setting("soft servo, 2 kN/m", design={"servo": Servo(2_000.0)}),
    Setting("bump of 0.15 s", design={"duration_s": 0.15}),
    Setting("doublet of 0.3 s", design={"disturbance": "biphasic"}),
    Setting("0.06 s of rest", "linear", design={"rest": 0.06}),
    Setting("0.06 s of rest, bump of 0.15 s", "linear", design={"rest": 0.06, "duration": 0.15}),
    Setting("one set of 8", design={"trials": 8}),
    Setting("two sets, 16", design={"trials": 16}),
)


def errors_of(number: int, methods: tuple[str, ...], first: int, count: int) -> FloatArray:
    """Errors (methods, count, 12) of experiments of one setting; nan where a method cannot run."""
    setting = SETTINGS[number]
    made = experiments(setting.limb, setting.noise, first, count, **setting.design)
    found = np.full((len(methods), count, 12), np.nan)
    for m, method in enumerate(methods):
        for e, window in enumerate(made.windows):
            try:
                one = estimate_window(
                    window, Group("hand", {}, made.handle_kg), Options(method, bound=False)
                )
            except ArmImpedanceError:
                continue
            found[m, e] = one.parameters - made.truth.ravel()
    return found


def main() -> int:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=100)
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    methods = tuple(METHODS)
    pieces = [
        (number, methods, first, min(BLOCK, asked.repeats - first))
        for number in range(len(SETTINGS))
        for first in range(0, asked.repeats, BLOCK)
    ]
    done = tqdm(in_order(errors_of, pieces, asked.workers), total=len(pieces), disable=None)
    blocks: dict[int, list[FloatArray]] = {}
    for piece, errors in zip(pieces, done, strict=True):
        blocks.setdefault(piece[0], []).append(errors)
    print("| RMSE of M/B/K, % | " + " | ".join(methods) + " |")
    print("| --- |" + " --- |" * len(methods))
    worst = 0.0
    for number, setting in enumerate(SETTINGS):
        truth = experiments(setting.limb, "none", 0, 1, **setting.design).truth
        errors = np.concatenate(blocks[number], axis=1)
        rmse = np.array([_rmse(each, truth) for each in errors])
        print(f"| {setting.name} | " + " | ".join(map(_shown, rmse)) + " |", flush=True)
        worst = max(
            worst, float((rmse[methods.index(METHODS.default)] / np.nanmin(rmse, axis=0)).max())
        )
    print(f"the default's RMSE is at most {worst:.2f} times that of the best method anywhere")
    return 0


def _rmse(errors: FloatArray, truth: FloatArray) -> FloatArray:
    ran = errors[~np.isnan(errors[:, 0])]
    if len(ran) < len(errors):
        return np.full(3, np.nan)
    return frobenius_percent(ran.T @ ran / len(ran), truth)


def _shown(rmse: FloatArray) -> str:
    return (
        "-"
        if np.isnan(rmse).any()
        else "/".join(f"{v:.2g}" if v < 10 else f"{v:.0f}" for v in rmse)
    )


if __name__ == "__main__":
    sys.exit(main())
