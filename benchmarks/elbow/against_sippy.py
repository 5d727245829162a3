"""I, B and K of a joint by our methods, by SIPPY and by SysIdentPy: the same samples, in one run.

All get the samples of one trial after our preparation (offset and slope off, zero-phase low-pass,
decimated). SIPPY fits ARX(2, 3, 0), whose least squares is the source's, and OE(3, 2, 0);
SysIdentPy a linear NARX of the same two past angles, three torques and a constant, by its least
squares. Neither knows of I, B and K: their coefficients go through the poles' logarithm and the
gain at 0 Hz, the exact inverse of a zero-order or first-order hold. Seconds are the best of three
runs, ratios are to our default; ours fit, give intervals and choose orders, theirs fit.

On a bench whose truth is known (10 s, 20 dB) errors stand beside; with a RECORDING there is no
truth. SIPPY's and SysIdentPy's ARX must agree with numpy's lstsq to 1e-6, else exit status 1: then
the comparison itself is wrong.

    (see sippy_environment.txt)
    PYTHONPATH=. sippy-env/bin/python benchmarks/elbow/against_sippy.py [RECORDING] [--trial N]
"""

from __future__ import annotations

import os

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_threads] = "1"

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.signal import detrend

from armimpedance.joint.elbow import METHODS, JointSamples, from_recording, identify_elbow
from armimpedance.numerics.signals import lowpass

sys.path.append(str(Path(__file__).parent / "peers"))
from discrete import continuous

TRUTH = (0.07, 0.6, 20.0)
REPEATS, AGREE = 3, 1e-6
LSTSQ, CONSTANT = "numpy lstsq ARX(2,3,0)", "the same, a constant"
#: Samples per period of the cut-off that theirs are given: with the 50 of our default the poles of
#: a plain ARX lie so near 1 that a noise of one per mille decides them.
DECIMATED = 5


def rows(y: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """W (n, 5) of ``-y(t-1), -y(t-2), u(t), u(t-1), u(t-2)`` and y(t)."""
    W = np.column_stack([-y[1:-1], -y[:-2], u[2:], u[1:-1], u[:-2]])
    return W, y[2:]


def ours(samples: JointSamples, name: str) -> Callable[[], np.ndarray]:
    return lambda: identify_elbow(samples, method=name).parameters.values


def plain(y: np.ndarray, u: np.ndarray, rate: float, constant: bool) -> Callable[[], np.ndarray]:
    def solve() -> np.ndarray:
        W, target = rows(y, u)
        W = np.column_stack([W, np.ones(len(W))]) if constant else W
        theta = np.linalg.lstsq(W, target, rcond=None)[0]
        return continuous(theta[:2], theta[2:5], rate)

    return solve


def sippy(y: np.ndarray, u: np.ndarray, rate: float, kind: str) -> Callable[[], np.ndarray]:
    from with_sippy import solve

    return lambda: solve(y, u, rate, kind)


def sysidentpy(y: np.ndarray, u: np.ndarray, rate: float) -> Callable[[], np.ndarray]:
    from with_sysidentpy import solve

    return lambda: solve(y, u, rate)


def timed(solve: Callable[[], np.ndarray]) -> tuple[np.ndarray, float]:
    """The result, and the seconds of the fastest run."""
    spent = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        found = solve()
        spent.append(time.perf_counter() - begun)
    return found, min(spent)


def decimated(samples: JointSamples) -> tuple[np.ndarray, np.ndarray, float]:
    """Angle, torque and rate as a user of a general package would have them.

    Behind the low-pass that our default chooses, about five samples per period of its edge, without
    the ends in which the filter rings.
    """
    cutoff, rate = identify_elbow(samples).details["band_hz"], samples.sample_rate_hz
    keep = max(round(rate / (DECIMATED * cutoff)), 1)
    both = detrend(np.stack([samples.angle, samples.torque]), axis=1)
    y, u = lowpass(both, cutoff, rate, axis=1)[:, ::keep]
    edge = int(np.ceil(rate / keep / cutoff))
    print(f"low-pass {cutoff:.3g} Hz on both channels, every {keep}. sample kept")
    return y[edge:-edge], u[edge:-edge], rate / keep


def one_trial(arguments: argparse.Namespace) -> JointSamples:
    if arguments.recording is None:
        from manipulandum_sim.elbow import simulate_bench

        recording, _ = simulate_bench(*TRUTH, snr_db=20.0, seed=3)
        return from_recording(recording)
    from armimpedance.show.verbs.results import read_recording

    recording = read_recording(arguments.recording)
    rows_ = np.flatnonzero(recording.trials["trial"] == arguments.trial)
    return from_recording(recording.select(rows_))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recording", nargs="?", type=Path)
    parser.add_argument("--trial", type=int, default=1)
    arguments = parser.parse_args()
    samples = one_trial(arguments)
    y, u, rate = decimated(samples)
    solvers = {f"ours: {name}": ours(samples, name) for name in METHODS}
    # as theirs, which leave out as many rows as their longest lag, 3
    solvers[LSTSQ] = plain(y[1:-1], u[1:-1], rate, constant=False)
    solvers[CONSTANT] = plain(y[1:-1], u[1:-1], rate, constant=True)
    solvers |= {f"SIPPY {k}": sippy(y, u, rate, k) for k in ("ARX", "OE")}
    solvers["SysIdentPy NARX, linear"] = sysidentpy(y, u, rate)
    results = {name: timed(solve) for name, solve in solvers.items()}
    base = results[f"ours: {METHODS.default}"][1]
    for name, (found, seconds) in results.items():
        error = "" if arguments.recording else f"  error % {100 * (found / TRUTH - 1)}"
        print(
            f"{name:26} I {found[0]:.4f} B {found[1]:.3f} K {found[2]:.2f}"
            f"  time {seconds / base:.3g}{error}"
        )
    pairs = (("SIPPY ARX", LSTSQ), ("SysIdentPy NARX, linear", CONSTANT))
    worst = max(np.abs(results[a][0] / results[b][0] - 1).max() for a, b in pairs)
    print(f"their ARX against numpy's: {worst:.1e}, asked {AGREE:g}")
    return int(not worst < AGREE)


if __name__ == "__main__":
    np.set_printoptions(precision=1, suppress=True)
    sys.exit(main())
