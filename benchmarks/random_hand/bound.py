"""Can it be known at all? The Cramer-Rao bound of K and of a reflex' delay in one minute.

    python benchmarks/random_hand/bound.py --force-n 4 8.6 --sessions 6 --seed 7301

An independent computation: mean and covariance of the lines of place and force, both of them, are
differentiated numerically by all elements of M, B, K, R and by the delay; true limb, robot, noise
and commands are known. No taper, no instruments, no code of the analysis.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from manipulandum_sim.hand import Reflex
from manipulandum_sim.random_hand import RandomRig, RandomTruth, simulate_random

BAND_HZ = (2.0, 20.0)
RATE_HZ = 500.0


def own_spectrum(rig: RandomRig, f: np.ndarray) -> np.ndarray:
    """Spectrum of the person's own force at each line (L,), of a transform over the root of N."""
    level, turn = rig.level, np.exp(-2j * np.pi * f / RATE_HZ)
    rho = np.exp(-1 / (level.voluntary_time * RATE_HZ))
    slow = level.voluntary_sd**2 * (1 - rho**2) / np.abs(1 - rho * turn) ** 2
    r, c = np.exp(-np.pi * 2.0 / RATE_HZ), np.cos(2 * np.pi * level.tremor_hz / RATE_HZ)

    def peak(z: np.ndarray) -> np.ndarray:
        return np.abs((1 - z**2) / (1 - 2 * r * c * z + (r * z) ** 2)) ** 2

    every = peak(np.exp(-1j * np.pi * (np.arange(400_000) + 0.5) / 400_000))
    return slow + level.tremor**2 * peak(turn) / every.mean()


class Lines:
    """Lines of one session: place and force (L, 2 d) of parameters and commands."""

    def __init__(self, rig: RandomRig, command: np.ndarray) -> None:
        self.rig, self.d = rig, rig.axes
        f = np.fft.rfftfreq(len(command), 1 / RATE_HZ)
        kept = (f >= BAND_HZ[0]) & (f <= BAND_HZ[1])
        self.s = 2j * np.pi * f[kept][:, None, None]
        self.command = (np.fft.rfft(command, axis=0)[kept] / np.sqrt(len(command)))[..., None]
        self.own = own_spectrum(rig, f[kept])[:, None, None] * np.eye(self.d)

    def moments(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (L, 2 d) and covariance (L, 2 d, 2 d)."""
        s, d, rig, one = self.s, self.d, self.rig, np.eye(self.d)
        M, B, K, R = theta[:-1].reshape(4, d, d)
        Z = M * s**2 + B * s + K + R * np.exp(-s * theta[-1])
        stiffness, viscosity = rig.spring
        spring = (viscosity * s + stiffness) * one
        drive = one if rig.imposed == "force" else np.diag(rig.carried) * s**2 + spring
        yields = np.linalg.inv(Z + np.diag(rig.beyond) * s**2 + spring)
        X = yields @ (drive @ self.command)
        mean = np.concatenate([X, -Z @ X], axis=1)[..., 0]
        path = np.concatenate([yields, one - Z @ yields], axis=1)
        covariance = path @ self.own @ np.swapaxes(path.conj(), 1, 2)
        level = rig.level
        covariance[:, :d, :d] += level.encoder_step**2 / 12 * one
        covariance[:, d:, d:] += (level.force_sd**2 + level.force_step**2 / 12) * one
        return mean, covariance

    def information(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What mean and covariance tell of the parameters, (p, p) each."""
        inverse = np.linalg.inv(self.moments(theta)[1])
        by_mean, by_spread = [], []
        for i, value in enumerate(theta):
            step = np.zeros_like(theta)
            step[i] = 1e-5 * max(abs(value), 1e-3)
            (up, wide), (down, narrow) = (self.moments(theta + k * step) for k in (1, -1))
            by_mean.append((up - down) / (2 * step[i]))
            by_spread.append(inverse @ ((wide - narrow) / (2 * step[i])))
        dm, dS = np.array(by_mean), np.array(by_spread)
        mean = 2 * np.einsum("pli,lij,qlj->pq", dm.conj(), inverse, dm).real
        return mean, np.einsum("plij,qlji->pq", dS, dS).real


def restrictions(truth: RandomTruth) -> Iterator[tuple[str, np.ndarray]]:
    """What may be known beforehand: name, and the parameters' derivative by those that are free."""
    K, R = truth.K_e.ravel(), truth.K_e_reflex.ravel()
    q = len(K)
    yield "nothing", np.eye(4 * q + 1)
    yield "the delay", np.eye(4 * q + 1)[:, :-1]
    like = np.zeros((4 * q + 1, 3 * q + 2))
    like[: 3 * q, : 3 * q] = np.eye(3 * q)
    like[3 * q : 4 * q, 2 * q : 3 * q] = (R @ K) / (K @ K) * np.eye(q)
    like[3 * q : 4 * q, 3 * q], like[-1, -1] = K, 1.0
    yield "R is proportional to K", like


def bounds(rig: RandomRig, seed: int) -> Iterator[str]:
    """Rms over the sessions of one seed, each of what may be known."""
    recording, truth = simulate_random(
        seed=seed, axes=rig.axes, imposed=rig.imposed, trials=rig.trials, force_n=rig.force_n,
        duration_s=rig.duration_s, reflex=rig.reflex,
    )  # fmt: skip
    parts = (truth.M_e_with_handle, truth.B_e, truth.K_e, truth.K_e_reflex)
    theta = np.append(np.concatenate([m.ravel() for m in parts]), truth.reflex_delay_s)
    rows = slice(2 * rig.axes**2, 3 * rig.axes**2)
    found: dict[str, list[tuple[float, float]]] = {}
    command = np.stack(list(recording.extra.values()), axis=1)
    for row in range(recording.n_trials):
        mean, spread = Lines(rig, command[recording.samples_of(row)]).information(theta)
        for known, D in restrictions(truth):
            for name, J in ((known, mean), (f"{known}, and the noise's spectrum", mean + spread)):
                C = D @ np.linalg.inv(D.T @ J @ D) @ D.T
                found.setdefault(name, []).append((np.trace(C[rows, rows]), C[-1, -1]))
    for name, each in found.items():
        K, delay = np.sqrt(np.mean(each, axis=0))
        yield (
            f"  {name + ':':56s} K {100 * K / np.linalg.norm(truth.K_e):5.2f} %, "
            f"delay {1e3 * delay:5.2f} ms"
        )


def main() -> None:
    """Print the bounds of the forces that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--force-n", type=float, nargs="+", default=[4.0, 8.6])
    parser.add_argument("--axes", type=int, default=2, choices=(2, 3))
    parser.add_argument("--sessions", type=int, default=6)
    parser.add_argument("--seed", type=int, default=7301)
    asked = parser.parse_args()
    for force in asked.force_n:
        rig = RandomRig(
            axes=asked.axes, imposed="force", trials=asked.sessions, duration_s=60.0,
            force_n=force, reflex=Reflex(0.25, 0.040),
        )  # fmt: skip
        print(f"{asked.axes} axes, {force:g} N rms imposed for a minute; known beforehand:")
        for line in bounds(rig, asked.seed):
            print(line, flush=True)


if __name__ == "__main__":
    main()
