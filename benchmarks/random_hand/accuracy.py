"""Random perturbations: error and coverage of M, B and K beside the bound and two plain ways.

    python benchmarks/random_hand/accuracy.py --axes 2 3 --sessions 30 --seed 2000
    python benchmarks/random_hand/accuracy.py --joints wrist ankle --sessions 40 --seed 7400
    python benchmarks/random_hand/accuracy.py --axes 3 --returning 78

Each session is one record of 60 s, 2 to 20 Hz; own force 1 N slow and .3 N tremor. Errors are
Frobenius norms in percent of the truth, coverage is over all elements. The bound (Cramer-Rao) takes
the true limb, robot and noise; with a reflex its matrix and delay are unknown to it. "H1" divides
Welch's spectra (2 s) and fits M, B, K to the quotient; "script" band-passes, differentiates
numerically and calls least squares.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
from scipy import signal

from armimpedance.core.records import Recording
from armimpedance.hand.random import identify_random, lines_of
from armimpedance.hand.still.show import estimate
from manipulandum_sim.hand import Reflex
from manipulandum_sim.random_hand import (
    JointRig,
    RandomRig,
    RandomTruth,
    simulate_random,
    simulate_random_joint,
    tremor_filter,
)
from manipulandum_sim.space import simulate_space

BAND_HZ = (2.0, 20.0)
REFLEX = Reflex(0.25, 0.040)
#: Of the muscles' stiffness; about a quarter of a joint's, whose tissue and weight have a share.
JOINT_REFLEX = Reflex(0.36, 0.040)
NAMES = "MBK"


def matrices_of(truth: RandomTruth) -> np.ndarray:
    """M, B, K of the limb, (3, d, d)."""
    return np.stack([truth.M_e, truth.B_e, truth.K_e])


def impedance(truth: RandomTruth, s: np.ndarray) -> np.ndarray:
    """What the sensor meets (L, d, d), handle included; s (L, 1, 1)."""
    late = truth.K_e_reflex * np.exp(-s * truth.reflex_delay_s)
    return truth.M_e_with_handle * s**2 + truth.B_e * s + truth.K_e + late


def bound(recording: Recording, truth: RandomTruth, rig: RandomRig | JointRig) -> np.ndarray:
    """Least rms error of M, B, K (3,), parts of the truth, from the commands of one session."""
    command = np.stack(list(recording.extra.values()), axis=1)
    lines = lines_of(recording, np.arange(1), command).within(BAND_HZ)
    s, d = lines.s[..., None], lines.axes
    Z, (K, B) = impedance(truth, s), rig.spring
    robot = np.diag(rig.beyond) * s**2 + (B * s + K) * np.eye(d)
    carried = np.diag(rig.carried) * s**2 + (B * s + K) * np.eye(d)
    drive = np.broadcast_to(np.eye(d), Z.shape) if rig.imposed != "position" else carried
    X = np.linalg.solve(Z + robot, drive @ lines.command[..., None])[..., 0]
    weight = np.linalg.inv(noise_spectrum(rig, lines.frequency_hz, Z, recording.sample_rate_hz))
    u = [s[..., 0] ** n * X for n in (2, 1, 0)]
    if rig.reflex:
        late = np.exp(-s[..., 0] * truth.reflex_delay_s) * X
        u.append(late)
    U = np.hstack(u)
    q = U.shape[1]
    # rows of [M B K R]: (i a, j c)
    info = np.einsum("lij,la,lc->iajc", weight, U.conj(), U).real.reshape(d * q, d * q)
    if rig.reflex:
        g = -s[..., 0] * (late @ truth.K_e_reflex.T)
        cross = np.einsum("la,lij,lj->ia", U.conj(), weight, g).real.ravel()
        own = np.einsum("li,lij,lj->", g.conj(), weight, g).real
        info = np.block([[info, cross[:, None]], [cross[None], own]])
    C = np.linalg.inv(2 * info)
    rows = np.arange(d * q).reshape(d, q)
    variance = np.diag(C)
    size = np.linalg.norm(matrices_of(truth), axis=(1, 2))
    each = [variance[rows[:, n * d : (n + 1) * d].ravel()].sum() for n in range(3)]
    return np.sqrt(lines.widening * np.array(each)) / size


def noise_spectrum(
    rig: RandomRig | JointRig, f: np.ndarray, Z: np.ndarray, rate: float
) -> np.ndarray:
    """Spectrum (L, d, d) of the person's own force and the sensors, in units of the lines."""
    level, d = rig.level, rig.axes
    z = np.exp(-2j * np.pi * f / rate)
    keep = np.exp(-1 / (level.voluntary_time * rate))
    slow = level.voluntary_sd**2 * (1 - keep**2) / np.abs(1 - keep * z) ** 2
    b, a = tremor_filter(level.tremor_hz)
    _, H = signal.freqz(b, a, f, fs=rate)
    pulse = signal.lfilter(b, a, np.eye(1, 20_000)[0])
    tremor = level.tremor**2 * np.abs(H) ** 2 / (pulse**2).sum()
    sensor = level.force_sd**2 + level.force_step**2 / 12
    place = level.encoder_step**2 / 12
    whole = (slow + tremor + sensor)[:, None, None] * np.eye(d)
    return whole + place * Z @ np.swapaxes(Z.conj(), 1, 2)


def plain_h1(recording: Recording) -> np.ndarray:
    """M, B, K (3, d, d) from a quotient of Welch's spectra, all lines alike."""
    rate, x, F = recording.sample_rate_hz, recording.position, recording.force
    n = int(2 * rate)
    d = x.shape[1]

    def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        first, second = a.T[:, None], b.T[None]
        return np.moveaxis(signal.csd(first, second, rate, nperseg=n)[1], 2, 0)

    f = np.fft.rfftfreq(n, 1 / rate)
    kept = (f >= BAND_HZ[0]) & (f <= BAND_HZ[1])
    # S_xx Z^T = -S_xF
    Z = -np.swapaxes(np.linalg.solve(cross(x, x)[kept], cross(x, F)[kept]), 1, 2)
    s = 2j * np.pi * f[kept]
    columns = np.stack([s**2, s, np.ones_like(s)], axis=1)
    real = np.vstack([columns.real, columns.imag])
    right = np.vstack([Z.reshape(len(s), -1).real, Z.reshape(len(s), -1).imag])
    return np.linalg.lstsq(real, right, rcond=None)[0].reshape(3, d, d)


def script(recording: Recording) -> np.ndarray:
    """M, B, K (3, d, d) by least squares on band-passed samples and numerical derivatives."""
    rate, d = recording.sample_rate_hz, recording.axes
    sos = signal.butter(4, BAND_HZ, "bandpass", fs=rate, output="sos")
    x, F = (signal.sosfiltfilt(sos, c, axis=0) for c in (recording.position, recording.force))
    v = np.gradient(x, 1 / rate, axis=0)
    a = np.gradient(v, 1 / rate, axis=0)
    cut = slice(int(rate), -int(rate))
    theta = np.linalg.lstsq(np.hstack([a, v, x])[cut], -F[cut], rcond=None)[0]
    return np.swapaxes(theta.reshape(3, d, d), 1, 2)


def judged(recording: Recording, truth: RandomTruth, rig: RandomRig | JointRig) -> Iterator[str]:
    """The lines of one case; each trial of the recording is a session."""
    true = matrices_of(truth)
    size = np.linalg.norm(true, axis=(1, 2))
    ways: dict[str, list[np.ndarray]] = {"ours": [], "script": [], "H1": []}
    bounds, held, delays, named, seconds = [], [], [], [], 0.0
    handle = np.zeros_like(true)
    handle[0] = np.diag(rig.carried - rig.beyond)
    for row in range(recording.n_trials):
        one = recording.select(np.array([row]))
        began = time.process_time()
        fit = identify_random(one)[0]
        seconds += time.process_time() - began
        low, high = fit.estimate.interval()
        held.append(((low <= true) & (true <= high)).mean(axis=(1, 2)))
        ways["ours"].append(fit.estimate.parameters.reshape(true.shape) - true)
        ways["script"].append(script(one) - handle - true)
        ways["H1"].append(plain_h1(one) - handle - true)
        bounds.append(bound(one, truth, rig))
        delays.append((fit.reflex.delay_s, fit.reflex.delay_sd_s, fit.reflex.probability))
        named.append([w.split(":")[0] for w in fit.estimate.warnings])
    least = 100 * np.sqrt((np.array(bounds) ** 2).mean(axis=0))
    for way, found in ways.items():
        error = np.array(found)
        rms = 100 * np.sqrt((np.linalg.norm(error, axis=(2, 3)) ** 2).mean(axis=0)) / size
        bias = 100 * np.linalg.norm(error.mean(axis=0), axis=(1, 2)) / size
        cells = zip(NAMES, rms, bias, strict=True)
        yield f"  {way:7s}" + "  ".join(f"{n} rms {r:5.2f} bias {b:5.2f}" for n, r, b in cells)
    share = 100 * np.mean(held, axis=0)
    yield "  bound  " + "  ".join(f"{n} {b:5.2f}" for n, b in zip(NAMES, least, strict=True))
    yield "  held   " + "  ".join(f"{n} {h:5.1f} %" for n, h in zip(NAMES, share, strict=True))
    at = 1e3 * np.array(delays)
    if rig.reflex:
        off = np.sqrt(((at[:, 0] - 1e3 * truth.reflex_delay_s) ** 2).mean())
        yield f"  delay {at[:, 0].mean():.1f} ms, rms error {off:.1f}, said {at[:, 1].mean():.1f}"
    yield (
        "  reflex's "
        f"probability {at[:, 2].mean() / 1e3:.3f}, {seconds / recording.n_trials:.2f} s a session; "
        f"warned {dict(Counter(sum(named, [])))}"
    )


def returning(trials: int, sessions: int, seed: int) -> Iterator[str]:
    """The same person in space, pushed along directions on a sphere."""
    recording, truth = simulate_space(seed=seed, sets=trials // 26, repeats=sessions)
    true = np.stack([truth.M_e[0], truth.B_e[0], truth.K_e[0]])
    errors, held = [], []
    for one in estimate(recording):
        low, high = one.interval()
        errors.append(np.linalg.norm(one.parameters.reshape(true.shape) - true, axis=(1, 2)))
        held.append(((low <= true) & (true <= high)).mean(axis=(1, 2)))
    rms = 100 * np.sqrt((np.array(errors) ** 2).mean(axis=0)) / np.linalg.norm(true, axis=(1, 2))
    parts = zip(NAMES, rms, 100 * np.mean(held, axis=0), strict=True)
    yield "  ".join(f"{n} rms {r:5.2f} held {h:5.1f} %" for n, r, h in parts)


def cases(asked: argparse.Namespace) -> Iterator[tuple[str, Any, Any, dict[str, Any]]]:
    """Name, simulator, rig and its fields of every case that is asked for."""
    common = {"trials": asked.sessions, "duration_s": asked.duration_s}
    if asked.joints:
        for joint, imposed, reflex in product(
            asked.joints, ("position", "torque"), (None, JOINT_REFLEX)
        ):
            fields = {"joint": joint, "imposed": imposed, "reflex": reflex} | common
            yield joint, simulate_random_joint, JointRig, fields
        return
    for axes, imposed, reflex in product(asked.axes, asked.imposed, (None, REFLEX)):
        fields = {"axes": axes, "imposed": imposed, "reflex": reflex} | common
        yield f"{axes} axes", simulate_random, RandomRig, fields


def main() -> None:
    """Run the cases that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--axes", type=int, nargs="+", default=[2, 3])
    parser.add_argument("--imposed", nargs="+", default=["position", "force"])
    parser.add_argument("--joints", nargs="+", choices=("wrist", "ankle"), help="no hand, these")
    parser.add_argument("--sessions", type=int, default=30)
    parser.add_argument("--seed", type=int, default=2000)
    parser.add_argument("--duration-s", type=float, default=60.0)
    parser.add_argument("--returning", type=int, help="trials of returning disturbances instead")
    asked = parser.parse_args()
    if asked.returning:
        print(*returning(asked.returning, asked.sessions, asked.seed), sep="\n")
        return
    for name, simulate, rig, fields in cases(asked):
        recording, truth = simulate(seed=asked.seed, **fields)
        late = "reflex" if fields["reflex"] else "no reflex"
        print(f"{name}, {fields['imposed']} imposed, {late}", flush=True)
        for line in judged(recording, truth, rig(**fields)):
            print(line, flush=True)


if __name__ == "__main__":
    main()
