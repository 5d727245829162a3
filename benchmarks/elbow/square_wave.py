"""Stiffness that switches: the square-wave benchmark of time-varying identification, all methods.

``python benchmarks/elbow/square_wave.py [--runs N] [--trials N] [--methods ...]``

After M. van de Ruit and colleagues (2021): the stiffness of one joint switches between two
levels; of each method bias, random and total error (over time, percent of the difference of the
levels), the variance accounted for, the rise time of the mean estimate from 10 to 90 %, and the
share of points inside the 95 % bands more than .1 s from a switch. The angle is imposed, white
noise stands on the torque. Every method gets the same realizations; one that does not know that
they are aligned is run on each and averaged.

``--reflex``: 60 s at 30 dB with courses of B, K and the reflex's gain. ``--hour MINUTES``: time and
memory of one long record. ``--figure FILE``: the courses of one run at 20 dB.
"""

from __future__ import annotations

import argparse
import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import ArmImpedanceError
from armimpedance.joint.elbow import (
    CASCADE_METHODS,
    VARYING_METHODS,
    VaryingImpedance,
    from_recording,
    identify_cascade,
    identify_varying,
)
from armimpedance.show.plots import OKABE_ITO, TWO_COLUMNS_IN, new_figure, print_style
from manipulandum_sim.elbow import Reflex, simulate_cascade

#: N m/rad, and the time between two switches, s.
LEVELS, HALF_S = (40.0, 120.0), 1.0
DURATION_S, AWAY_S = 4.0, 0.1
#: The grid on which courses are compared, s.
GRID_S = 0.01
STANDING = tuple(name for name in VARYING_METHODS if name != "emg")


@dataclass(frozen=True)
class Scores:
    """Percent of the difference of the levels, percent, ms, share."""

    bias: float
    random: float
    total: float
    vaf: float
    rise_ms: float
    covered: float


def square_wave(time_s: FloatArray) -> FloatArray:
    """The stiffness at times, N m/rad."""
    return np.where((time_s % (2 * HALF_S)) < HALF_S, *LEVELS)


def scores_of(method: str, snr_db: float, runs: int, trials: int) -> Scores:
    """Of one method at one level of noise."""
    # no point at the instant of a switch, where the truth is neither level
    grid = np.arange(0.15, DURATION_S - 0.15, GRID_S) + GRID_S / 2
    truth = square_wave(grid)
    away = np.abs((grid + HALF_S / 2) % HALF_S - HALF_S / 2) > AWAY_S
    courses, inside, vaf = [], [], []
    for seed in range(runs):
        recording, true = simulate_cascade(
            0.02, 0.8, square_wave, duration_s=DURATION_S, trials=trials,
            snr_db=(snr_db, None), seed=100 + seed,
        )  # fmt: skip
        found = _found(method, from_recording(recording))
        K, B, sd = (_on_grid(found, name, grid) for name in ("K", "B", "sd_K"))
        courses.append(K)
        inside.append((np.abs(K - truth) < 1.96 * sd)[away].mean())
        vaf.append(_vaf(found, B, K, grid, recording.position[:, 0], true.torque))
    made = np.stack(courses)
    error, span = made - truth, LEVELS[1] - LEVELS[0]
    bias = np.sqrt((error.mean(axis=0) ** 2).mean())
    random = np.sqrt(made.var(axis=0).mean())
    total = np.sqrt((error**2).mean())
    percent = 100 / span
    rise = _rise(grid, made.mean(axis=0))
    return Scores(
        bias * percent, random * percent, total * percent,
        float(np.mean(vaf)), 1e3 * rise, float(np.mean(inside)),
    )  # fmt: skip


def _found(method: str, samples) -> VaryingImpedance:
    if method in CASCADE_METHODS.names:
        return identify_cascade(samples, method=method, aligned=True, every_s=0.001, reflex="none")
    return identify_varying(samples, method=method, every_s=GRID_S)


def _on_grid(found: VaryingImpedance, name: str, grid: FloatArray) -> FloatArray:
    """A course averaged over the trials; its standard error of the mean."""
    values = getattr(found, name)
    rows = [found.points_of(t) for t in range(len(found.trials))]
    parts = np.stack([np.interp(grid, found.time_s[r], values[r]) for r in rows])
    if name.startswith("sd"):
        return np.sqrt((parts**2).sum(axis=0)) / len(rows)
    return parts.mean(axis=0)


def _vaf(found, B, K, grid, angle, torque) -> float:
    """Variance of the torque without noise that I, B and K account for, percent."""
    t = np.arange(torque.shape[1]) / 1000.0
    inside = (t > grid[0]) & (t < grid[-1])
    x = angle.reshape(torque.shape)
    v = np.gradient(x, 1e-3, axis=1)
    a = np.gradient(v, 1e-3, axis=1)
    made = found.inertia.value * a + np.interp(t, grid, B) * v + np.interp(t, grid, K) * x
    left = (torque - made)[:, inside]
    return float(100 * (1 - left.var() / torque[:, inside].var()))


def _rise(grid: FloatArray, mean: FloatArray) -> float:
    """Mean time from 10 to 90 % over the switches up and down, s."""
    part = (mean - LEVELS[0]) / (LEVELS[1] - LEVELS[0])
    times = []
    for n in range(1, round(DURATION_S / HALF_S)):
        near = np.abs(grid - n * HALF_S) < HALF_S / 2
        fine = np.arange(grid[near][0], grid[near][-1], 1e-4)
        up = np.interp(fine, grid[near], part[near])
        up = up if n % 2 else 1 - up
        middle = int(np.abs(fine - n * HALF_S).argmin())
        low = np.flatnonzero(up[: middle + 1000] < 0.1)
        high = np.flatnonzero(up > 0.9)
        high = high[high > (low[-1] if len(low) else 0)]
        times.append(fine[high[0]] - fine[low[-1]] if len(low) and len(high) else np.nan)
    return float(np.mean(times))


def benchmark(methods: tuple[str, ...], runs: int, trials: int) -> None:
    """Print the table."""
    print(f"{trials} realizations of {DURATION_S:g} s, {runs} runs")
    print("| method | dB | bias | random | total | VAF | rise (ms) | covered |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for snr_db in (10.0, 20.0, 30.0):
        for method in methods:
            try:
                s = scores_of(method, snr_db, runs, trials)
            except ArmImpedanceError as error:
                print(f"| {method} | {snr_db:g} | {error} |")
                continue
            print(
                f"| {method} | {snr_db:g} | {s.bias:.1f} | {s.random:.1f} | {s.total:.1f} | "
                f"{s.vaf:.1f} | {s.rise_ms:.0f} | {100 * s.covered:.0f} |",
                flush=True,
            )


def draw(methods: tuple[str, ...], trials: int, path: Path) -> None:
    """The course of K by each method, with its band, about two switches."""
    import matplotlib as mpl

    recording, _ = simulate_cascade(
        0.02, 0.8, square_wave, duration_s=DURATION_S, trials=trials, snr_db=(20.0, None), seed=100
    )
    samples, grid = from_recording(recording), np.arange(0.7, 2.3, 0.004)
    with print_style():
        mpl.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "square wave"})
        rows = -(-len(methods) // 4)
        figure = new_figure(TWO_COLUMNS_IN, 0.4 + 1.6 * rows)
        axes = figure.subplots(rows, 4, sharex=True, sharey=True, squeeze=False)
        for ax in axes.flat[len(methods) :]:
            ax.set_visible(False)
        for ax, method in zip(axes.flat, methods, strict=False):
            ax.plot(grid, square_wave(grid), color="0.6", linewidth=1.0)
            ax.set_title(method)
            try:
                found = _found(method, samples)
            except ArmImpedanceError:
                ax.annotate("refused", (0.3, 0.5), xycoords="axes fraction")
                continue
            K, sd = (_on_grid(found, name, grid) for name in ("K", "sd_K"))
            ax.fill_between(grid, K - 1.96 * sd, K + 1.96 * sd, color=OKABE_ITO["blue"], alpha=0.3)
            ax.plot(grid, K, color=OKABE_ITO["blue"], linewidth=0.8)
            ax.set_ylim(20, 140)
        for ax in axes[-1]:
            ax.set_xlabel("time (s)")
        for row in axes:
            row[0].set_ylabel("K (N m/rad)")
        figure.savefig(path, metadata={"Date": None})


def reflex(runs: int) -> None:
    """Errors of the courses of B, K and the reflex's gain, and of the delay; false alarms."""
    cases = {
        "nominal": {},
        "own torque .3 N m": {"own_Nm": 0.3},
        "no reflex": {"gain": None},
        "no reflex, own torque .3 N m": {"gain": None, "own_Nm": 0.3},
        "linear reflex": {"side": "both"},
    }
    print("| case | K | B | G | delay (ms, rms) | covered K, B, G | seen |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, case in cases.items():
        rows = np.array([_reflex_run(seed, **case) for seed in range(runs)])
        rms = np.sqrt(np.nanmean(rows[:, 3] ** 2)) if np.isfinite(rows[:, 3]).any() else np.nan
        m = [np.nanmean(c) if np.isfinite(c).any() else np.nan for c in rows.T]
        print(
            f"| {name} | {m[0]:.1f} | {m[1]:.1f} | {m[2]:.1f} | {rms:.2f} | {100 * m[4]:.0f}, "
            f"{100 * m[5]:.0f}, {100 * m[6]:.0f} | {100 * m[7]:.0f} % |",
            flush=True,
        )


def _reflex_run(
    seed: int, gain: float | None = 3.0, own_Nm: float = 0.0, side: str = "positive"
) -> list[float]:
    rng = np.random.default_rng(seed)
    p = rng.uniform(0, 2 * np.pi, 3)
    delay = rng.uniform(0.03, 0.06)

    def swing(size: float, hz: float, phase: float):
        return lambda t: size * (1 + 0.35 * np.sin(2 * np.pi * hz * t + phase))

    one = None
    if gain is not None:
        one = Reflex(swing(gain, 0.06, p[2]), delay_s=delay, side=side)
    recording, truth = simulate_cascade(
        0.02, swing(0.8, 0.07, p[0]), swing(60.0, 0.1, p[1]), one, own_Nm=own_Nm, seed=seed
    )
    found = identify_cascade(from_recording(recording))
    at = np.minimum(np.round(found.time_s * 1000).astype(int), len(truth.K) - 1)

    def of(value: FloatArray, sd: FloatArray, true: FloatArray) -> tuple[float, float]:
        error = value - true[at]
        total = 100 * np.sqrt((error**2).mean() / (true[at] ** 2).mean())
        return float(total), float((np.abs(error) < 1.96 * sd).mean())

    K, B = of(found.K, found.sd_K, truth.K), of(found.B, found.sd_B, truth.B)
    G, late = (np.nan, np.nan), np.nan
    if found.reflex is not None and gain is not None:
        G = of(found.reflex.G, found.reflex.sd_G, truth.G)
        late = 1e3 * (found.reflex.delay_s - delay)
    seen = float(found.reflex is not None)
    return [K[0], B[0], G[0], late, K[1], B[1], G[1], seen]


def hour(minutes: float) -> None:
    """Processor time and memory of one long record."""
    recording, _ = simulate_cascade(
        0.02, 0.8, lambda t: 60 + 20 * np.sin(0.6 * t),
        Reflex(lambda t: 3 + np.sin(0.3 * t)), duration_s=60 * minutes,
    )  # fmt: skip
    samples = from_recording(recording)
    del recording
    before = _peak_mb()
    began = time.process_time()
    identify_cascade(samples)
    took = time.process_time() - began
    size = (samples.torque.nbytes + samples.angle.nbytes) / 1e6
    print(
        f"{minutes:g} min: {took:.1f} s of the processor, peak {_peak_mb() - before:.0f} MB above "
        f"the simulation's {before:.0f} MB; torque and angle are {size:.0f} MB"
    )


def _peak_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--methods", nargs="*", default=(*CASCADE_METHODS, *STANDING))
    parser.add_argument("--reflex", action="store_true")
    parser.add_argument("--figure", type=Path, help="one run at 20 dB, every method's course")
    parser.add_argument("--hour", type=float, metavar="MINUTES")
    asked = parser.parse_args()
    if asked.hour:
        hour(asked.hour)
    elif asked.figure:
        draw(tuple(asked.methods), asked.trials, asked.figure)
    elif asked.reflex:
        reflex(asked.runs)
    else:
        benchmark(tuple(asked.methods), asked.runs, asked.trials)


if __name__ == "__main__":
    main()
