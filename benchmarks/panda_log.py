"""A real robot: friction and inertial base parameters of a seven-joint arm from its own log.

The log is `panda_exciting_trajectory.csv` of unisa-acg/inverse-dynamics-solver (BSD-3-Clause,
commit 41e196d): time, joint angles, velocities and torques of a Franka Emika Panda, 24 s at 30 Hz.
It is not part of this project; give its path:

    python benchmarks/panda_log.py LOG.csv [--folder robot] [--figure F.png]

--folder writes it as a recording that `armimpedance body robot --rows all` reads. Nobody knows this
robot's true parameters: what can be judged is the prediction, every fifth of the log from the other
four. Exit status 1 if a joint's torque is predicted worse than R^2 = .80.
docs/evidence/real_robot.md reads the numbers.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.joint.body import BodyFit, RowChoice, each_trial, identify_body

#: Modified Denavit-Hartenberg parameters a (m), d (m), alpha (rad) of the seven joints, as the
#: maker prints them (Franka Emika, Franka Control Interface documentation).
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
#: The motion lies below .6 Hz; what is faster is noise.
CUTOFF_HZ = 2.0
LEAST_R2 = 0.80
SYMBOLS = (("h", "viscous (N m s/rad)"), ("f", "Coulomb (N m)"), ("c", "offset (N m)"))


def skeleton_of(table: tuple[tuple[float, float, float], ...]) -> Skeleton:
    """Segments whose frames are parallel to the base's at zero angles."""
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


def read_log(path: Path) -> MotionRecording:
    """The log on an even clock, one trial per fold."""
    from scipy.interpolate import make_interp_spline

    log = pd.read_csv(path)
    time = log["t"].to_numpy()
    step = (time[-1] - time[0]) / (len(time) - 1)
    even = time[0] + step * np.arange(len(time))
    q = make_interp_spline(time, log.filter(like="q_fer").to_numpy(), k=3)(even)
    tau = make_interp_spline(time, log.filter(like="tau_fer").to_numpy(), k=1)(even)
    edges = np.linspace(0, len(even), FOLDS + 1).astype(int)
    names = [f"fifth_{k}" for k in range(1, FOLDS + 1)]
    trials = pd.DataFrame({"trial": range(1, FOLDS + 1), "condition": names})
    jitter = 1e3 * np.abs(np.diff(time) - step).max()
    said = f"interpolated to an even clock; the log's was uneven by {jitter:.1f} ms at most"
    return MotionRecording(
        1 / step, trials, edges, even, q, skeleton_of(PANDA), torque=tau, provenance=(said,)
    )


def sensors(path: Path) -> None:
    """Noise and steps of angles, velocities and torques, joint by joint."""
    from armimpedance.numerics.signals import lowpass

    log = pd.read_csv(path)
    for what, unit in (("q_fer", "rad"), ("qd_fer", "rad/s"), ("tau_fer", "N m")):
        values = log[[c for c in log if c.startswith(what)]].to_numpy()
        fast = values - lowpass(values, CUTOFF_HZ, 30.0, axis=0)
        steps = np.diff(np.sort(values, axis=0), axis=0)
        smallest = [float(np.median(np.sort(s[s > 1e-7])[:20])) for s in steps.T]
        print(f"{what}: sd above {CUTOFF_HZ:g} Hz ({unit})", _row(fast[15:-15].std(axis=0)))
        print(f"{what}: smallest steps ({unit})    ", _row(np.array(smallest)))


def fit_of(motion: MotionRecording, choice: RowChoice, motions: list[str] | None) -> BodyFit:
    """What these fifths show."""
    return identify_body(motion, choice=choice, motions=motions, data_dependent=True, block_s=0.5)


def left_out(motion: MotionRecording, choice: RowChoice) -> tuple[np.ndarray, np.ndarray]:
    """Squares (2, joints) of the residuals of every fifth predicted from the others, and of w."""
    names = list(motion.trials["condition"])
    folds = []
    for name in names:
        judged = fit_of(motion, choice, [n for n in names if n != name]).held_out
        folds.append((judged.residual_squares[0], int(judged.samples[0])))
    residual = sum(squares for squares, _ in folds)
    w = np.concatenate([trial.w for trial in each_trial(motion, choice)])
    return residual / len(w), w.var(axis=0)


def main() -> int:
    """Fit, cross-validate, print; 1 if a joint's torque cannot be predicted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path, nargs="?")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--figure", type=Path)
    given = parser.parse_args()
    if given.log is None or not given.log.is_file():
        print("panda_log: no log given (see the head of this script); nothing was run")
        return 0
    motion = read_log(given.log)
    print(f"{len(motion.time_s)} samples at {motion.sample_rate_hz:.2f} Hz; {motion.provenance[0]}")
    sensors(given.log)
    terms = ("viscosity", "friction", "offset")
    choice = RowChoice.of(motion.skeleton, cutoff_hz=CUTOFF_HZ, terms=terms)
    fit = fit_of(motion, choice, None)
    print(f"{fit.base.rank} parameters, condition (columns scaled) {fit.least.cond_scaled:.0f}")
    residual, variance = left_out(motion, choice)
    r2 = 1 - residual / variance
    direct = fit.fitted.residual_squares.sum(axis=0) / fit.fitted.samples.sum()
    print("R^2 fitted  ", _row(1 - direct / variance))
    print("R^2 left out", _row(r2))
    print("rms left out (N m)", _row(np.sqrt(residual)))
    for symbol, what in SYMBOLS:
        own = [p for p in fit.parameters if p.name.startswith(f"{symbol}_joint")]
        cells = [f"{p.value:.3f} +- {1.96 * p.sd_robust:.3f}" for p in own]
        print(f"{what:20s}", "  ".join(cells))
    if given.folder is not None:
        from armimpedance.recordings import write_recording

        write_recording(motion, given.folder)
    if given.figure is not None:
        draw(motion, choice, given.figure)
    return int(r2.min() < LEAST_R2)


def draw(motion: MotionRecording, choice: RowChoice, path: Path) -> None:
    """The last fifth, predicted from the first four."""
    from armimpedance.joint.body.show import body_figure
    from armimpedance.show.plots import save

    names = list(motion.trials["condition"])
    figure = body_figure(fit_of(motion, choice, names[:-1]))
    save(figure, path.with_suffix(""), (path.suffix[1:],))


def _row(values: np.ndarray) -> str:
    return "  ".join(f"{v:.3g}" for v in values)


if __name__ == "__main__":
    raise SystemExit(main())
