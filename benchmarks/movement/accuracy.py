"""A moving hand: bias, error and coverage of M, B and K at every phase, over many sessions.

    python benchmarks/movement/accuracy.py --sessions 200 --cases doublet servo soft-servo
    python benchmarks/movement/accuracy.py --sessions 40 --methods latent mean_difference ensemble

Each session is 40 free reaches and 40 pushed ones at each of three phases. Errors are Frobenius
norms in percent of the truth; coverage is over all elements; "named" is the share of fits that
carry a warning.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate, Quality
from armimpedance.hand.reaching import METHODS, identify_movement
from manipulandum_sim.hand import Reflex
from manipulandum_sim.movement import MovementRig, MovementTruth, Variability, simulate_movement

#: Name -> fields of the rig.
CASES: dict[str, dict[str, Any]] = {
    "doublet": {},
    "servo": {"push": "servo"},
    "soft-servo": {"push": "soft-servo"},
    "channel": {"device": "channel"},
    "curl": {"device": "curl"},
    "reflex": {"reflex": Reflex(0.25, 0.055)},
    "jitter": {"variability": replace(Variability(), onset_s=0.03), "on_time": True},
    "twice": {"variability": Variability().times(2)},
}


def one_session(
    case: str, methods: list[str], levels: list[str], repeats: int, seed: int
) -> np.ndarray:
    """(methods, levels, phases, 4, 12): estimate, truth, half width, whether named."""
    rig = CASES[case]
    recording, truth = simulate_movement(seed=seed, repeats=repeats, unperturbed=8 * repeats, **rig)
    made = MovementRig(**rig)
    told = [posture_inertia(truth)] if "impulse_response" in methods else None
    return np.array(
        [
            [
                [
                    of_phase(made, truth, share, estimate)
                    for share, estimate in zip(
                        made.phases,
                        identify_movement(
                            recording,
                            method=method,
                            level=level,  # type: ignore[arg-type]
                            inertia=told if method == "impulse_response" else None,
                        ),
                        strict=True,
                    )
                ]
                for level in levels
            ]
            for method in methods
        ]
    )


def of_phase(
    rig: MovementRig, truth: MovementTruth, share: float, estimate: ImpedanceEstimate
) -> list[np.ndarray]:
    """Estimate, truth, half width and whether named, (12,) each.

    The truth is that of the nominal reach as long after the place of the push.
    """
    onset = float(rig.nominal_time(np.array(share))) - rig.go_s
    # the middle of the window that `identify_movement` takes of itself
    lag = min(rig.shape.duration_s + 0.1, 0.3) / 2
    letter = "e" if estimate.level == "hand" else "j"
    at = np.array([np.interp(onset + lag, truth.time_s, np.arange(len(truth.time_s)))])
    low, part = int(at[0]), float(at[0] % 1)
    courses = [getattr(truth, f"{name}_{letter}") for name in "MBK"]
    true = [(1 - part) * c[low] + part * c[low + 1] for c in courses]
    half = (estimate.interval()[1] - estimate.interval()[0]) / 2
    named = np.full(12, float(bool(estimate.warnings)))
    return [estimate.parameters, np.concatenate(true, axis=None), half.ravel(), named]


def posture_inertia(truth: MovementTruth) -> ImpedanceEstimate:
    """The inertia as a posture experiment tells it, to 2 percent."""
    M = truth.M_e[0]
    zero = np.zeros((2, 2))
    covariance = np.zeros((12, 12))
    covariance[:4, :4] = (0.02 * np.abs(M).max()) ** 2 * np.eye(4)
    return ImpedanceEstimate(
        level="hand",
        method="truth",
        inertia=M,
        viscosity=zero,
        stiffness=zero,
        covariance=covariance,
        dof=np.inf,
        quality=Quality(1, 1, 1.0, 1.0, 1.0, 1.0, 12, 0.0),
        joint_angles=truth.posture[0],
    )


def summary(found: np.ndarray) -> str:
    """One phase of one method: found (sessions, 4, 12)."""
    value, true, half, named = np.moveaxis(found, 1, 0)
    error = (value - true).reshape(-1, 3, 4)
    size = np.linalg.norm(true.mean(axis=0).reshape(3, 4), axis=1)
    bias = 100 * np.linalg.norm(error.mean(axis=0), axis=1) / size
    every = 100 * np.linalg.norm(error, axis=2) / size
    rmse, most = np.sqrt((every**2).mean(axis=0)), np.quantile(every, 0.95, axis=0)
    held = 100 * (np.abs(error).reshape(-1, 12) <= half).reshape(-1, 3, 4).mean(axis=(0, 2))
    width = 100 * np.linalg.norm(half.reshape(-1, 3, 4), axis=2).mean(axis=0) / size
    return (
        "  ".join(
            f"{name} bias {b:4.1f} rmse {r:5.1f} q95 {q:5.1f} width {w:5.1f} held {h:5.1f}"
            for name, b, r, q, w, h in zip("MBK", bias, rmse, most, width, held, strict=True)
        )
        + f"  named {100 * named[:, 0].mean():3.0f}"
    )


def main() -> None:
    """Run the cases that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=40)
    parser.add_argument("--repeats", type=int, default=5, help="pushes a phase and direction")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    parser.add_argument("--methods", nargs="+", default=[METHODS.default], choices=METHODS.names)
    parser.add_argument("--levels", nargs="+", default=["hand"], choices=("hand", "joint"))
    parser.add_argument("--workers", type=int, default=2)
    asked = parser.parse_args()
    if asked.sessions < 2:
        raise InputError(f"{asked.sessions} sessions", expected="2 or more")
    for line in lines(asked):
        print(line, flush=True)


def lines(asked: argparse.Namespace) -> Iterator[str]:
    """The table, line by line."""
    with ProcessPoolExecutor(asked.workers) as pool:
        for case in asked.cases:
            work = partial(one_session, case, asked.methods, asked.levels, asked.repeats)
            found = np.array(list(pool.map(work, range(2000, 2000 + asked.sessions))))
            for m, method in enumerate(asked.methods):
                for n, level in enumerate(asked.levels):
                    for p in range(found.shape[3]):
                        yield f"{case:10s} {level:5s} {method:15s} {p} {summary(found[:, m, n, p])}"


if __name__ == "__main__":
    main()
