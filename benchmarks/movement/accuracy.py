"""A moving hand: bias, error and coverage of M, B and K at every phase, over many sessions.

    python benchmarks/movement/accuracy.py --sessions 200 --cases doublet servo soft-servo
    python benchmarks/movement/accuracy.py --sessions 40 --methods latent mean_difference

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

from armimpedance.errors import InputError
from armimpedance.movement import METHODS, identify_movement
from manipulandum_sim.hand import Reflex
from manipulandum_sim.movement import MovementRig, Variability, simulate_movement

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


def one_session(case: str, methods: list[str], level: str, repeats: int, seed: int) -> np.ndarray:
    """(methods, phases, 4, 12): estimate, truth, half width of the interval, whether named."""
    rig = CASES[case]
    recording, truth = simulate_movement(seed=seed, repeats=repeats, unperturbed=8 * repeats, **rig)
    line, letter = MovementRig(**rig).line, level[0].replace("h", "e")
    rows = []
    for method in methods:
        of_method = []
        for e in identify_movement(recording, method=method, level=level):  # type: ignore[arg-type]
            assert e.position is not None
            travelled = float((e.position - line.start_m) @ line.along)
            true = [truth.at(f"{name}_{letter}", travelled) for name in "MBK"]
            half = (e.interval()[1] - e.interval()[0]) / 2
            named = np.full(12, float(bool(e.warnings)))
            of_method.append([e.parameters, np.concatenate(true, axis=None), half.ravel(), named])
        rows.append(of_method)
    return np.array(rows)


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
            for level in asked.levels:
                work = partial(one_session, case, asked.methods, level, asked.repeats)
                found = np.array(list(pool.map(work, range(2000, 2000 + asked.sessions))))
                for m, method in enumerate(asked.methods):
                    for p in range(found.shape[2]):
                        yield f"{case:10s} {level:5s} {method:15s} {p} {summary(found[:, m, p])}"


if __name__ == "__main__":
    main()
