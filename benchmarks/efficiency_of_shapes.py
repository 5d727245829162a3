"""Efficiency of the default estimator for bumps and designed pushes, on a linear limb.

    python benchmarks/efficiency_of_shapes.py --repeats 500

The bound is that of the covariance that the residuals of the true parameters have in all repeats,
so that it depends on no model of the noise. Printed: the bound over the mean square error, of M, B
and K (Frobenius norm of the symmetric part), and how many intervals hold.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse

import numpy as np
from limbs import LINEAR, frobenius_percent, linear_window

from armimpedance.hand.still import Group, Options, bound, estimate_window, modal_equation
from armimpedance.numerics.regression import t_factor

TRIALS = 40
SHAPES = (
    ("minimum_jerk", 0.3),
    ("minimum_jerk", 0.15),
    ("designed", 0.3),
    ("reflex_separating", 0.3),
)


def main() -> None:
    """Print one row a shape."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=500)
    repeats = parser.parse_args().repeats
    for shape, duration in SHAPES:
        clean = modal_equation(linear_window("none", 0, TRIALS, duration, shape=shape))
        windows = [
            linear_window("nominal", n, TRIALS, duration, shape=shape) for n in range(repeats)
        ]
        residual = np.concatenate([modal_equation(w).residual(LINEAR.ravel()) for w in windows])
        least = frobenius_percent(bound(clean, residual.T @ residual / len(residual)), LINEAR)
        made = [estimate_window(w, Group("hand", {}), Options()) for w in windows]
        wrong = np.array([one.parameters for one in made]) - LINEAR.ravel()
        error = frobenius_percent(wrong.T @ wrong / repeats, LINEAR)
        sd = np.array([one.sd.ravel() for one in made])
        held = np.abs(wrong) < t_factor(TRIALS - 1) * sd
        print(
            f"{shape} {duration:g} s: efficiency {((least / error) ** 2).round(2).tolist()}, error "
            f"{error.round(3).tolist()} %, intervals that hold "
            f"{(100 * held.reshape(repeats, 3, 4).mean(axis=(0, 2))).round(1).tolist()} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
