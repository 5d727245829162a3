"""Memory and time of large recordings, as ratios in one run: measured against what is asked.

Each command runs in a process of its own, whose peak of resident memory the system tells. What the
imports take is measured in the same way and subtracted; the yardstick is the recording's own
arrays: time, position and force.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import cont2discrete, lfilter

from armimpedance.core.records import Recording
from armimpedance.recordings import write_recording

#: Bytes of time, position and force of one sample of two axes.
OWN = 8 * 5
#: Inertia, viscosity and stiffness of the limb.
LIMB = (1.5, 10.0, 150.0)

#: What each child does; it prints seconds of processor time, and its peak in bytes.
_PREPARE = """
import resource, sys, time
import matplotlib, pandas, pyarrow.parquet, scipy.interpolate, scipy.linalg, scipy.signal
import scipy.special, scipy.stats
from armimpedance.hand.still.show import estimate
from armimpedance.app.inspection import inspect
from armimpedance.show.verbs.results import read
# the first of anything loads what it needs
small = sys.argv[2]
estimate(small); inspect(small)
"""
_TELL = """
seconds = time.process_time() - start
try:
    # what getrusage tells begins with the peak of the process that started this one
    with open("/proc/self/status") as status:
        peak = next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM"))
except OSError:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(seconds, peak)
"""
CHILDREN = {
    "imports": "",
    "read": "read(sys.argv[1])",
    "inspect": "inspect(sys.argv[1])",
    "exact": "estimate(sys.argv[1], method='exact')",
    "default": "estimate(sys.argv[1])",
}


def returning(conditions: int, trials: int, samples: int, rate_hz: float) -> Recording:
    """A linear limb with noise, disturbed for 0.3 s in eight directions."""
    rng = np.random.default_rng(0)
    M, B, K = LIMB
    n = conditions * trials
    t = np.arange(samples) / rate_hz
    s = np.clip((t - 0.25) / 0.3, 0, 1)
    bump = 0.005 * 64 * s**3 * (1 - s) ** 3
    velocity = np.gradient(bump, t)
    angle = np.arange(n) * np.pi / 4
    u = np.column_stack([np.cos(angle), np.sin(angle)])[:, None, :]
    force = -(M * np.gradient(velocity, t) + B * velocity + K * bump)[None, :, None] * u
    force += rng.normal(0, 0.1, force.shape)
    position = bump[None, :, None] * u
    table = pd.DataFrame(
        {
            "trial": np.arange(1, n + 1),
            "condition": [f"c{i // trials:05d}" for i in range(n)],
            "direction_deg": 45.0 * (np.arange(n) % 8),
            "onset_s": 0.25,
            "end_s": 0.55,
        }
    )
    return Recording(
        kind="hand",
        sample_rate_hz=rate_hz,
        trials=table,
        offsets=np.arange(n + 1) * samples,
        time_s=np.tile(t, n),
        position=(np.round(position / 2e-5) * 2e-5).reshape(-1, 2),
        force=(np.round(force / 0.05) * 0.05).reshape(-1, 2),
    )


def random(samples: int) -> Recording:
    """One trial of a random perturbation at 1 kHz."""
    rng = np.random.default_rng(0)
    push = lfilter([0.06], [1, -0.94], 20 * rng.standard_normal((samples, 2)), axis=0)
    numerator, denominator, _ = cont2discrete(([1.0], list(LIMB)), 1e-3)
    place = lfilter(numerator.ravel(), denominator, push, axis=0)
    return Recording(
        kind="hand",
        sample_rate_hz=1000.0,
        trials=pd.DataFrame({"trial": [1], "condition": ["a"]}),
        offsets=np.array([0, samples]),
        time_s=np.arange(samples) / 1000.0,
        position=np.round(place / 2e-6) * 2e-6,
        force=rng.normal(0, 0.05, push.shape) - push,
        perturbation="stochastic",
    )


def child(what: str, folder: Path, small: Path) -> tuple[float, float]:
    """Seconds of processor time and peak in bytes of one of `CHILDREN`."""
    code = f"{_PREPARE}\nstart = time.process_time()\n{CHILDREN[what]}\n{_TELL}"
    told = subprocess.run(
        [sys.executable, "-c", code, str(folder), str(small)],
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    seconds, peak = told.stdout.split()[-2:]
    return float(seconds), float(peak)


class Table:
    """Rows of what was measured and asked; `missed` counts the failures."""

    def __init__(self) -> None:
        self.missed = 0

    def row(self, name: str, measured: float, asked: float) -> None:
        """Print a row."""
        verdict = "met" if measured <= asked else "MISSED"
        self.missed += verdict == "MISSED"
        print(f"{name:70s} {measured:8.2f}  <= {asked:6.2f}  {verdict}", flush=True)


def measure(scale: float, place: Path) -> int:
    """Print all rows for recordings of `scale` times the sizes asked; the number missed."""
    table, small = Table(), place / "small"
    write_recording(returning(2, 16, 801, 1000.0), small)

    def made(name: str, make: Callable[[], Recording]) -> tuple[Path, float]:
        start, folder, recording = time.perf_counter(), place / name, make()
        write_recording(recording, folder)
        samples = len(recording.time_s)
        print(f"{name}: {samples / 1e6:.3g} M samples, {time.perf_counter() - start:.0f} s to make")
        return folder, OWN * samples

    imports = child("imports", small, small)[1]
    print(f"imports and a first small run: {imports / 1e6:.0f} MB")

    def over(name: str, folder: Path, own: float, *doing: str) -> None:
        for what in ("read", *doing, "default"):
            peak = child(what, folder, small)[1] - imports
            table.row(f"{name}: {what}, peak / the recording's own arrays", peak / own, 3.0)

    over("trials", *made("trials", lambda: returning(int(343 * scale), 40, 801, 1000.0)), "exact")
    over("one trial", *made("one trial", lambda: random(int(10e6 * scale))))
    # as many samples in both, then as many trials of each: what grows is what is kept of each
    few, own = made("100 conditions", lambda: returning(100, int(40 * scale) or 8, 801, 1000.0))
    many, _ = made("500 conditions", lambda: returning(500, int(8 * scale) or 2, 801, 1000.0))
    larger, more = made(
        "500 conditions alike", lambda: returning(500, int(40 * scale) or 8, 801, 1000.0)
    )
    for what in ("read", "exact", "default"):
        first = child(what, few, small)[1]
        grown = child(what, many, small)[1] - first
        table.row(f"100 to 500 conditions, {what}: MB more", grown / 1e6, 100.0)
        grown = child(what, larger, small)[1] - first - (more - own)
        table.row(f"the same of alike ones, {what}: MB beyond their own", grown / 1e6, 100.0)
    trials = int(100_000 * scale)
    folder, _ = made("short trials", lambda: returning(trials // 100, 100, 160, 200.0))
    ratio = child("inspect", folder, small)[0] / child("read", folder, small)[0]
    table.row(f"inspect of {trials} trials / reading them", ratio, 2.0)
    return table.missed


def main() -> int:
    """Print measured and asked; 1 if anything is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scale", type=float, default=1.0, help="part of the sizes asked")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        return int(measure(asked.scale, Path(place)) > 0)


if __name__ == "__main__":
    sys.exit(main())
