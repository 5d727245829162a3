"""A moving hand: the error of K against the number of pushed trials, for every method.

    python benchmarks/movement/trials.py --sessions 20 --figure docs/gallery/movement_trials.svg

One phase in the middle of the reach, 40 free reaches; the error is the rms over sessions of the
Frobenius norm of K's error at the hand, in percent of K.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from accuracy import CASES, of_phase, posture_inertia

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.hand.reaching import METHODS, identify_movement
from armimpedance.hand.show import one_legend
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from manipulandum_sim.movement import MovementRig, simulate_movement

PUSHES = ("doublet", "servo")
#: Of each of the eight directions.
REPEATS = (2, 3, 5, 10, 20)
LOOKS = {
    "latent": ("blue", "o"),
    "ensemble": ("green", "^"),
    "predicted_path": ("vermillion", "s"),
    "mean_difference": ("purple", "D"),
    "impulse_response": ("orange", "v"),
}


def one_session(case: str, repeats: int, seed: int) -> list[float]:
    """Relative error of K by each method, NaN where it refuses."""
    rig = {**CASES[case], "phases": (0.5,)}
    recording, truth = simulate_movement(seed=seed, repeats=repeats, unperturbed=40, **rig)
    made, errors = MovementRig(**rig), []
    for method in METHODS.names:
        told = [posture_inertia(truth)] if method == "impulse_response" else None
        try:
            (found,) = identify_movement(recording, method=method, inertia=told)
        except ArmImpedanceError:
            errors.append(np.nan)
            continue
        value, true, _, _ = of_phase(made, truth, 0.5, found)
        errors.append(float(np.linalg.norm((value - true)[8:]) / np.linalg.norm(true[8:])))
    return errors


def errors_of(case: str, sessions: int, workers: int) -> FloatArray:
    """(repeats, methods): percent, NaN where a method refuses most sessions."""
    rows = []
    with ProcessPoolExecutor(workers) as pool:
        for repeats in REPEATS:
            every = np.array(
                list(pool.map(partial(one_session, case, repeats), range(7000, 7000 + sessions)))
            )
            refused = np.isnan(every).mean(axis=0) > 0.5
            mean = np.nanmean(np.where(refused, 0.0, every) ** 2, axis=0)
            rows.append(np.where(refused, np.nan, 100 * np.sqrt(mean)))
            told = "  ".join(f"{n} {v:.1f}" for n, v in zip(METHODS.names, rows[-1], strict=True))
            print(f"{case} {8 * repeats} trials: {told}", flush=True)
    return np.array(rows)


def draw(found: dict[str, FloatArray], path: Path) -> None:
    """One panel a push."""
    import matplotlib as mpl

    with print_style():
        mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "trials"})
        axes = new_figure(TWO_COLUMNS_IN, 2.7).subplots(1, len(found), sharey=True)
        for ax, (case, errors) in zip(axes, found.items(), strict=True):
            for name, course in zip(METHODS.names, errors.T, strict=True):
                color, marker = LOOKS[name]
                ax.plot(
                    8 * np.array(REPEATS),
                    course,
                    color=OKABE_ITO[color],
                    marker=marker,
                    markersize=4,
                    label=name,
                )
            ax.axhline(10.0, color="0.7", linewidth=0.7, zorder=0)
            ax.set(xscale="log", yscale="log", title=case, xlabel="pushed trials")
            ax.set_xticks([8 * r for r in REPEATS], [str(8 * r) for r in REPEATS])
            ax.set_yticks([2, 5, 10, 20, 50, 100, 200], ["2", "5", "10", "20", "50", "100", "200"])
            ax.minorticks_off()
        axes[0].set_ylabel("error of K (%)")
        one_legend(axes[0].figure, [axes[1]], columns=5)
        axes[0].figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sessions", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--figure", type=Path)
    asked = parser.parse_args()
    found = {case: errors_of(case, asked.sessions, asked.workers) for case in PUSHES}
    if asked.figure is not None:
        draw(found, asked.figure)


if __name__ == "__main__":
    main()
