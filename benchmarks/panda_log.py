"""A real robot: friction and inertial base parameters of a seven-joint arm from its own log.

The log is `panda_exciting_trajectory.csv` of unisa-acg/inverse-dynamics-solver (BSD-3-Clause, commit
41e196d): time, joint angles, velocities and torques of a Franka Emika Panda, 24 s at 30 Hz. It is not
part of this project; give its path:

    python benchmarks/panda_log.py PATH/panda_exciting_trajectory.csv

Nobody knows this robot's true parameters, so that nothing here passes or fails but the prediction:
every fifth of the log is predicted from the other four. docs/body.md reads the numbers.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from armimpedance.body.base_parameters import base_parameters
from armimpedance.body.equations import body_equations
from armimpedance.body.estimate import clustered_covariance, fit_base
from armimpedance.body.joint_terms import robot_terms
from armimpedance.body.rows import RowChoice
from armimpedance.body.validation import validate
from armimpedance.motion import Hinge, MotionRecording, Segment, Skeleton
from armimpedance.regression.fit import with_covariance

#: Modified Denavit-Hartenberg parameters a (m), d (m), alpha (rad) of the seven joints, as the maker
#: prints them (Franka Emika, "Robot and interface specifications", Denavit-Hartenberg parameters).
PANDA = (
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
)
FOLDS = 5
#: Left out at each end of a fold, s: the filter has seen across it.
GUARD_S = 0.5
CUTOFF_HZ = 2.0
LEAST_R2 = 0.85


def skeleton_of(table: tuple[tuple[float, float, float], ...]) -> Skeleton:
    """Segments with frames parallel to the base's at zero angles."""
    segments = [Segment("base", None, np.zeros(3))]
    R = np.eye(3)
    for number, (a, d, alpha) in enumerate(table, start=1):
        c, s = np.cos(alpha), np.sin(alpha)
        origin = R @ [a, 0.0, 0.0]
        R = R @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
        hinge = Hinge(f"joint_{number}", np.round(R[:, 2], 12))
        parent = segments[-1].name
        segments.append(Segment(f"link_{number}", parent, origin + R @ [0, 0, d], (hinge,)))
    return Skeleton(tuple(segments), floating=False)


def read_log(path: Path) -> tuple[MotionRecording, float]:
    """The log on an even clock, one trial per fold, and how uneven its clock was (s)."""
    from scipy.interpolate import make_interp_spline

    log = pd.read_csv(path)
    time = log["t"].to_numpy()
    step = (time[-1] - time[0]) / (len(time) - 1)
    even = time[0] + step * np.arange(len(time))
    q = make_interp_spline(time, log.filter(like="q_fer").to_numpy(), k=3)(even)
    tau = make_interp_spline(time, log.filter(like="tau_fer").to_numpy(), k=1)(even)
    edges = np.linspace(0, len(even), FOLDS + 1).astype(int)
    names = [f"fifth {k}" for k in range(1, FOLDS + 1)]
    trials = pd.DataFrame({"trial": range(1, FOLDS + 1), "condition": names})
    motion = MotionRecording(1 / step, trials, edges, even, q, skeleton_of(PANDA), torque=tau)
    return motion, float(np.abs(np.diff(time) - step).max())


def noise_and_steps(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Of each joint's torque: sd of what is faster than 2 Hz, and the smallest step."""
    from armimpedance.signals.filters import lowpass

    tau = pd.read_csv(path).filter(like="tau_fer").to_numpy()
    noise = (tau - lowpass(tau, CUTOFF_HZ, 30.0, axis=0))[15:-15].std(axis=0)
    steps = np.abs(np.diff(np.sort(tau, axis=0), axis=0))
    smallest = [column[column > 1e-4].min() for column in steps.T]
    return noise, np.array(smallest)


def main() -> int:
    """Fit, cross-validate, print; 1 if a joint's torque cannot be predicted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="?")
    given = parser.parse_args()
    if given.log is None or not given.log.is_file():
        print("panda_log: no log given (see the head of this script); nothing to do")
        return 0
    motion, jitter = read_log(given.log)
    noise, steps = noise_and_steps(given.log)
    print(
        f"{len(motion.time_s)} samples at {motion.sample_rate_hz:.2f} Hz, clock uneven by "
        f"{1e3 * jitter:.1f} ms at most; torque noise above {CUTOFF_HZ:g} Hz (Nm)",
        noise.round(3),
    )
    print("torque steps (Nm)", steps.round(4))
    terms = robot_terms(motion.skeleton, ("viscosity", "friction", "offset"))
    choice = RowChoice(rows="all", cutoff_hz=CUTOFF_HZ, trim_s=GUARD_S, terms=terms)
    equations = body_equations(motion, choice)
    base = base_parameters(
        equations.stacked(), equations.columns, equations.column_units, tolerance=1e-5
    )
    found = fit_base(equations, base)
    sd = np.sqrt(np.diag(clustered_covariance(motion, choice, base, found)))
    print(f"{base.rank} parameters, condition (columns scaled) {found.fit.cond_scaled:.0f}")
    left_out = [
        validate(
            equations.subset([k]),
            base.lift(fit_base(equations.subset([t for t in range(FOLDS) if t != k]), base).values),
        )
        for k in range(FOLDS)
    ]
    residual = sum(v.residual_squares[0] for v in left_out)
    everything = validate(equations, base.lift(found.values))
    varying = equations.r[..., -1] ** 2
    total = varying.sum(axis=(0, 2)) - len_weighted_mean_square(equations)
    r2 = 1 - residual / total
    print("R^2 fitted    ", (1 - everything.residual_squares.sum(axis=0) / total).round(3))
    print("R^2 left out  ", r2.round(3))
    rms = np.sqrt(residual / equations.samples.sum())
    print("rms left out (Nm)", rms.round(3))
    for symbol, what in (("h", "viscous (Nm s/rad)"), ("f", "Coulomb (Nm)"), ("c", "offset (Nm)")):
        at = [i for i, n in enumerate(base.names) if n.startswith(f"{symbol}_joint")]
        cells = [f"{found.values[i]:.3f}+-{sd[i]:.3f}" for i in at]
        print(f"{what:20s}", "  ".join(cells))
    return int(r2.min() < LEAST_R2)


def len_weighted_mean_square(equations) -> np.ndarray:
    """N times the square of each row's mean over all samples (R,)."""
    weights = equations.samples[:, None]
    return (weights * equations.mean).sum(axis=0) ** 2 / weights.sum()


if __name__ == "__main__":
    raise SystemExit(main())
