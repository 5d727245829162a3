"""What a laboratory's own script does: filter, differentiate, least squares. NumPy and SciPy alone.

    python benchmarks/open/lab_script.py BENCHMARK OUT

Every channel goes through a zero-phase low-pass, velocities and accelerations are gradients, the
intervals are a textbook's, which take samples as independent; courses come from windows of 1 s.
Nothing of armimpedance is imported.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pandas as pd
from rows import Answer, write_submission
from scipy.signal import butter, filtfilt

CUTOFF_HZ = 15.0
WINDOW_S = 1.0


def trials_of(record: Path) -> tuple[pd.DataFrame, list[pd.DataFrame], dict]:
    """Trial table, samples of each trial, what the recording says of itself."""
    folder = record / "recording"
    told = json.loads((folder / "recording.json").read_text())
    file = folder / "samples.parquet"
    samples = pd.read_parquet(file) if file.exists() else pd.read_csv(file.with_suffix(".csv"))
    trials = pd.read_csv(folder / "trials.csv")
    by_trial = dict(list(samples.groupby("trial")))
    return trials, [by_trial[t] for t in trials["trial"]], told


def smooth(x: np.ndarray, rate_hz: float) -> np.ndarray:
    """Butterworth of second order, forward and backward."""
    b, a = butter(2, CUTOFF_HZ, fs=rate_hz)
    return filtfilt(b, a, x, axis=0)


def derivatives(x: np.ndarray, rate_hz: float) -> np.ndarray:
    """Acceleration, velocity, position side by side."""
    velocity = np.gradient(x, 1 / rate_hz, axis=0)
    return np.hstack([np.gradient(velocity, 1 / rate_hz, axis=0), velocity, x])


def least_squares(W: np.ndarray, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (p, q) and half widths of their 95 % intervals."""
    theta, *_ = np.linalg.lstsq(W, Y, rcond=None)
    variance = ((Y - W @ theta) ** 2).sum(axis=0) / (len(W) - W.shape[1])
    return theta, 1.96 * np.sqrt(np.outer(np.diag(np.linalg.inv(W.T @ W)), variance))


def hand(record: Path) -> Answer:
    """M, B, K of pushes, from their onset to 0.2 s after their end."""
    table, trials, told = trials_of(record)
    rate, W, Y = told["sample_rate_hz"], [], []
    for (_, row), samples in zip(table.iterrows(), trials, strict=True):
        time = samples["time_s"].to_numpy()
        x = smooth(samples[["x_m", "y_m"]].to_numpy(), rate)
        force = smooth(samples[["fx_N", "fy_N"]].to_numpy(), rate)
        before = time < row["onset_s"]
        x, force = x - x[before].mean(axis=0), force - force[before].mean(axis=0)
        kept = (time >= row["onset_s"]) & (time <= row["end_s"] + 0.2)
        W.append(derivatives(x, rate)[kept])
        Y.append(-force[kept])
    theta, half = least_squares(np.concatenate(W), np.concatenate(Y))
    handle = told.get("handle_mass_kg", 0.0) * np.eye(2)
    rows = []
    for n, name in enumerate("MBK"):
        values = theta[2 * n : 2 * n + 2].T - (handle if name == "M" else 0)
        width = half[2 * n : 2 * n + 2].T
        for i in (0, 1):
            for j in (0, 1):
                v, w = values[i, j], width[i, j]
                rows.append((f"{name}_{i + 1}{j + 1}", v, v - w, v + w))
    return Answer(rows)


def joint_columns(record: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (S,), W (S, 3) of acceleration, velocity, angle, and the torque on the limb (S, 1)."""
    _, (samples,), told = trials_of(record)
    rate = told["sample_rate_hz"]
    angle, torque = samples["q1_rad"].to_numpy()[:, None], -samples["tau1_Nm"].to_numpy()[:, None]
    angle, torque = (smooth(c - c.mean(), rate) for c in (angle, torque))
    inner = slice(100, -100)
    time = samples["time_s"].to_numpy()[inner]
    return time, derivatives(angle, rate)[inner], torque[inner]


def of_joint(theta: np.ndarray, half: np.ndarray, at: str = "") -> list[tuple]:
    """Rows of I, B, K."""
    values = zip("IBK", theta[:3, 0], half[:3, 0], strict=True)
    return [(name + at, v, v - w, v + w) for name, v, w in values]


def joint(record: Path) -> Answer:
    """I, B, K."""
    _, W, y = joint_columns(record)
    return Answer(of_joint(*least_squares(W, y)))


def varying(record: Path) -> Answer:
    """I and what is constant from all samples, courses from a window about each time."""
    time, W, y = joint_columns(record)
    with (record.parent.parent / "asked.csv").open() as stream:
        asked = list(dict.fromkeys(row["quantity"] for row in csv.DictReader(stream)))
    rows = {name: (name, *rest) for name, *rest in of_joint(*least_squares(W, y))}
    for at in dict.fromkeys(q.partition("@")[2] for q in asked):
        if at:
            near = np.abs(time - float(at)) < WINDOW_S / 2
            ones = np.ones((near.sum(), 1))
            found = least_squares(np.hstack([W[near], ones]), y[near])
            rows |= {row[0]: row for row in of_joint(*found, f"@{at}")}
    return Answer([rows[q] for q in asked])


def main(benchmark: str, out: str) -> None:
    """Write the submission."""
    Path(out).mkdir(parents=True, exist_ok=True)
    hands = dict.fromkeys(("hand_ideal", "hand_soft", "hand_reflex", "hand_mixed"), hand)
    joints = dict.fromkeys(("joint_torque", "joint_position", "joint_reflex"), joint)
    courses = dict.fromkeys(("joint_smooth", "joint_square"), varying)
    methods = {**hands, **joints, **courses}
    write_submission(Path(benchmark), Path(out) / "lab_script.csv", methods)


if __name__ == "__main__":
    main(*sys.argv[1:])
