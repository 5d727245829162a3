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
from scipy.signal import butter, csd, filtfilt

CUTOFF_HZ = 15.0
WINDOW_S = 1.0
#: Samples of a segment of a spectrum.
SEGMENT = 1024
PLACE, FORCE = ["x_m", "y_m"], ["fx_N", "fy_N"]


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
        x = smooth(samples[PLACE].to_numpy(), rate)
        force = smooth(samples[FORCE].to_numpy(), rate)
        before = time < row["onset_s"]
        x, force = x - x[before].mean(axis=0), force - force[before].mean(axis=0)
        kept = (time >= row["onset_s"]) & (time <= row["end_s"] + 0.2)
        W.append(derivatives(x, rate)[kept])
        Y.append(-force[kept])
    return of_hand(*least_squares(np.concatenate(W), np.concatenate(Y)), told)


def of_hand(theta: np.ndarray, half: np.ndarray, told: dict) -> Answer:
    """Rows of M, B, K from coefficients (6, 2) of acceleration, velocity, place, handle off."""
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


def random_columns(record: Path) -> tuple[np.ndarray, np.ndarray, dict]:
    """Place and force on the hand (trials, S, 2) of random perturbations, means taken off."""
    _, trials, told = trials_of(record)
    x, force = (np.stack([t[c].to_numpy() for t in trials]) for c in (PLACE, FORCE))
    return x - x.mean(axis=1, keepdims=True), force.mean(axis=1, keepdims=True) - force, told


def random_hand(record: Path) -> Answer:
    """M, B, K of random displacements, by least squares on filtered channels."""
    x, force, told = random_columns(record)
    rate, inner = told["sample_rate_hz"], slice(100, -100)
    W = np.concatenate([derivatives(smooth(one, rate), rate)[inner] for one in x])
    Y = np.concatenate([smooth(one, rate)[inner] for one in force])
    return of_hand(*least_squares(W, Y), told)


def random_spectra(record: Path) -> Answer:
    """M, B, K from the spectra of force by those of place, a line at a time.

    Z (2, 2) = S_fx S_xx^-1 per frequency; K - w^2 M from its real part, w B from its imaginary one.
    """
    x, force, told = random_columns(record)
    rate = told["sample_rate_hz"]

    def spectra(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(frequencies, 2, 2), of all trials together."""
        line = [
            [
                np.mean(
                    [
                        csd(q[:, j], p[:, i], rate, nperseg=SEGMENT)[1]
                        for p, q in zip(a, b, strict=True)
                    ],
                    0,
                )
                for j in (0, 1)
            ]
            for i in (0, 1)
        ]
        return np.moveaxis(np.array(line), -1, 0)

    frequency = np.fft.rfftfreq(SEGMENT, 1 / rate)
    kept = (frequency >= 2) & (frequency <= CUTOFF_HZ)
    w = 2 * np.pi * frequency[kept]
    Z = (spectra(force, x)[kept] @ np.linalg.inv(spectra(x, x)[kept])).reshape(-1, 4)
    real, of_real = least_squares(np.column_stack([-(w**2), np.ones_like(w)]), Z.real)
    imaginary, of_imaginary = least_squares(w[:, None], Z.imag)

    def stacked(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(6, 2): the transposes of M, B and K on top of each other."""
        return np.concatenate([m.reshape(2, 2).T for m in (a[0], b[0], a[1])])

    return of_hand(stacked(real, imaginary), stacked(of_real, of_imaginary), told)


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
    methods = {**hands, "hand_random": random_hand, **joints, **courses}
    write_submission(Path(benchmark), Path(out) / "lab_script.csv", methods)
    spectra = {"hand_random": random_spectra}
    write_submission(Path(benchmark), Path(out) / "lab_spectra.csv", spectra)


if __name__ == "__main__":
    main(*sys.argv[1:])
