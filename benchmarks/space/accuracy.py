"""Errors, coverage and efficiency of a hand's M, B, K in space, over simulated sessions.

Each case is a number of sessions of one condition (26 directions, three times each): elbow held, or
free at two levels of co-contraction and with several disturbances; with `plain` as a limb of the
second order, else as `armimpedance estimate` says it, a free elbow's swivel allowed for.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.ellipses import FIELDS, ellipsoid_of
from armimpedance.hand.still import allowing, estimate
from armimpedance.numerics.regression import t_factor
from manipulandum_sim.space import SpaceCondition, SpaceTruth, simulate_space

#: name -> co-contraction, fields of the rig.
CASES: Final[dict[str, tuple[float, dict[str, Any]]]] = {
    "held": (0.12, {}),
    "free-12": (0.12, {"elbow": "free"}),
    "free-5": (0.05, {"elbow": "free"}),
    "free-5-designed": (0.05, {"elbow": "free", "disturbance": "designed"}),
    "free-5-plateau": (0.05, {"elbow": "free", "disturbance": "plateau", "duration_s": 0.5}),
    "wrist-12-elbow-held": (0.12, {"wrist": "free"}),
    "wrist-12": (0.12, {"wrist": "free", "elbow": "free"}),
    "wrist-5": (0.05, {"wrist": "free", "elbow": "free"}),
    "wrist-12-plateau": (
        0.12,
        {"wrist": "free", "elbow": "free", "disturbance": "plateau", "duration_s": 0.5},
    ),
    "wrist-5-plateau": (
        0.05,
        {"wrist": "free", "elbow": "free", "disturbance": "plateau", "duration_s": 0.5},
    ),
    "wrist-12-long": (
        0.12,
        {"wrist": "free", "elbow": "free", "disturbance": "plateau", "duration_s": 1.25},
    ),
}


def main() -> None:
    """Print a block of lines for each case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", choices=tuple(CASES), nargs="+", default=list(CASES))
    parser.add_argument("--sessions", type=int, default=40)
    parser.add_argument("--sets", type=int, default=3)
    parser.add_argument("--seed", type=int, default=11)
    arguments = parser.parse_args()
    for case in arguments.case:
        level, rig = CASES[case]
        recording, truth = simulate_space(
            [SpaceCondition("nominal", level)],
            seed=arguments.seed,
            sets=arguments.sets,
            repeats=arguments.sessions,
            **rig,
        )
        plain = estimate(recording)
        told = allowing(plain, recording, ["condition"])
        for name, found in (("plain", plain), ("estimate", told)):
            print(f"{case}, {name}")
            print_matrices(found, truth)
        print_ellipsoids(told, truth)
        warned = sum(any("inner mode" in w for w in one.warnings) for one in told)
        print(f"  named in {warned} of {len(told)}")


def truth_of(truth: SpaceTruth) -> FloatArray:
    """M, B, K of the first condition, (3, 3, 3): of a free wrist those of slow motion."""
    if truth.posture.shape[1] > 4:
        return np.stack([truth.M_e_slow[0], truth.B_e_slow[0], truth.K_e[0]])
    return np.stack([truth.M_e[0], truth.B_e[0], truth.K_e[0]])


def print_matrices(found: Sequence[ImpedanceEstimate], truth: SpaceTruth) -> None:
    """RMSE and bias (Frobenius, parts of the truth), coverage of elements, efficiency."""
    for i, (field, true) in enumerate(zip(FIELDS, truth_of(truth), strict=True)):
        block = slice(9 * i, 9 * i + 9)
        seen = np.array([getattr(one, field).ravel() for one in found])
        half = np.array([t_factor(e.dof) * np.sqrt(np.diag(e.covariance)[block]) for e in found])
        off = seen - true.ravel()
        size, variance = np.linalg.norm(true), seen.var(axis=0, ddof=1).sum()
        bounds = [np.trace(e.bound[block, block]) for e in found if e.bound is not None]
        print(
            f"  {field:9} rmse {100 * np.sqrt((off**2).sum(axis=1).mean()) / size:5.2f} %, bias "
            f"{100 * np.linalg.norm(off.mean(axis=0)) / size:5.2f} +- "
            f"{100 * np.sqrt(variance / len(found)) / size:.2f} %, covered "
            f"{100 * (np.abs(off) <= half).mean():5.1f} %, efficiency "
            f"{np.mean(bounds) / variance:.2f}"
        )


def print_ellipsoids(found: Sequence[ImpedanceEstimate], truth: SpaceTruth) -> None:
    """Coverage of half-axes, sizes and axes."""
    for field, true in zip(FIELDS, truth_of(truth), strict=True):
        values, vectors = np.linalg.eigh((true + true.T) / 2)
        right = np.append(values[::-1], 4 / 3 * np.pi * values.prod())
        solids = [solid for e in found if (solid := ellipsoid_of(e, field)) is not None]
        limits = np.array([solid.interval() for solid in solids])
        held = ((limits[..., 0] <= right) & (right <= limits[..., 1])).mean(axis=0)
        axes = np.mean([[s.may_be_axis(v) for v in vectors.T[::-1]] for s in solids], axis=0)
        print(
            f"  {field:9} half-axes {np.round(100 * held[:3])}, size {100 * held[3]:.0f}, axes "
            f"{np.round(100 * axes)} % of {len(solids)} ellipsoids"
        )


if __name__ == "__main__":
    main()
