"""Live stiffness: equality with the batch result, time of an update, ten hours, truth.

    python benchmarks/live/measure.py equality speed truth changing drifted hours

Times are processor time of one update on one core, posture by posture ("new") or with the part that
depends on the posture kept ("kept"), as parts of 1 ms. The truth is the plant of the simulated
subject A: postures inside of the hull of experiment 1 that no row has, activations up to the
highest measured ones, known or from raw EMG after 1.2 s.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import json
import resource
import sys
from collections.abc import Callable
from pathlib import Path
from time import thread_time_ns
from typing import Any, Literal

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from activation_fits import COCONTRACTION, FORCE, PLANAR6, POSTURES, Study

from armimpedance.limb.arm import monomial_exponents
from armimpedance.muscles.live import EmgLevels, Live, StiffnessForm
from armimpedance.muscles.models import MuscleModel, Region, at_hand, fit_muscle_model, matrix
from manipulandum_sim.emg_carrier import carrier
from manipulandum_sim.hand import find_subject, hand_jacobian, simulate
from manipulandum_sim.space import simulate_space

STUDY = Study("A")
PERSON = find_subject("A").record
EVERY = (POSTURES, COCONTRACTION, FORCE)
ELBOWS: tuple[Literal["held", "free"], ...] = ("held", "free")


def fitted(seed: int) -> MuscleModel:
    """The model of one simulated experiment."""
    return fit_muscle_model(STUDY.rows(EVERY, seed), PLANAR6, torque=True)


def levels() -> EmgLevels:
    """The simulated electrodes', from a session."""
    session, _ = simulate("cocontraction", seed=1, sets=1, conditions=["cocontraction_10"])
    return EmgLevels.of(session, PLANAR6.paths.muscles)


def places(model: MuscleModel, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Postures inside the hull, and activations."""
    rng = np.random.default_rng(2000 + seed)
    hull = STUDY.truths[POSTURES].posture
    q = rng.dirichlet(np.ones(len(hull)), count) @ hull
    return q, rng.uniform(0, model.highest, (count, 6)) * rng.random((count, 1))


def equality() -> None:
    """Largest difference to the batch result, over the largest element."""
    model = fitted(0)
    live, (q, alpha) = Live(model, PERSON), places(model, 5000, 0)
    force = np.random.default_rng(1).normal(0, 10, (len(q), 2))
    batch = at_hand(model.predict(q, alpha), live.arm, force)
    worst = np.zeros(2)
    for p in range(len(q)):
        one = live.update(alpha[p], q=q[p], force=force[p])
        K, sd = batch.stiffness_matrices[p], batch.sd("stiffness")[p]
        off = np.abs(one.stiffness - K).max() / np.abs(K).max()
        off_sd = np.abs(one.sd - sd).max() / sd.max()
        worst = np.maximum(worst, (off, off_sd) if one.definite else 0)
        assert one.extrapolating == batch.joint.extrapolated[p]
    print(f"{len(q)} places: K differs by {worst[0]:.1e}, its standard errors by {worst[1]:.1e}")


class SevenJoints:
    """A chain of seven hinges, three at the shoulder, one elbow, three at the wrist."""

    joints, axes = 7, 3
    hinges = np.array([[0, 0, 1], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    links = np.array([0, 0, 0.3, 0.13, 0.12, 0, 0.1])

    def _chain(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        R, at, axes, places = np.eye(3), np.zeros(3), [], []
        for angle, axis, link in zip(q, self.hinges, self.links, strict=True):
            axes.append(R @ axis)
            places.append(at)
            cross = np.cross(np.eye(3), axis)
            turn = np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
            R = R @ turn
            at = at + R @ [link, 0, 0]
        return np.array(axes), np.array(places), at

    def hand_position(self, q: np.ndarray) -> np.ndarray:
        """Hand from the shoulder, m."""
        return self._chain(q)[2]

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """(3, 7)."""
        axes, places, hand = self._chain(q)
        return np.cross(axes, hand - places).T

    def gravity_gradient(self, q: np.ndarray) -> np.ndarray:
        """None: the arm has no weight here."""
        return np.zeros((len(q), len(q)))


def made_up(joints: int, muscles: int) -> StiffnessForm:
    """Made-up muscles: lengths of order 2 in all angles, two corrections each."""
    rng = np.random.default_rng(0)
    exponents = monomial_exponents(joints, 2)
    shape = (muscles, len(exponents))
    return StiffnessForm(
        muscles=tuple(f"m{i}" for i in range(muscles)),
        exponents=exponents,
        lengths=rng.normal(0, 0.02, shape) * (rng.random(shape) < 0.4),
        muscle=np.repeat(np.arange(muscles), 2),
        change=rng.normal(0, 0.002, (2 * muscles, len(exponents))),
        box=np.tile([-0.5, 1.5], (joints, 1)),
        rising=np.eye(2),
        highest=np.full(muscles, 0.4),
        stiffness=rng.uniform(2e3, 8e3, (muscles, 2)),
        per_tension=1 / 75,
        passive=np.full(joints, 1.0),
        covariance=np.diag(
            np.r_[np.ones(2 * muscles), np.full(2 * muscles, 300.0**2), np.full(joints, 0.1**2)]
        ),
        dof=30.0,
    )


def timed(name: str, update: Callable[[int], Any], count: int = 20_000) -> None:
    """Print median and 99.9th percentile of the processor time of `update`."""
    for k in range(200):
        update(k)
    spent = np.empty(count)
    for k in range(count):
        before = thread_time_ns()
        update(k + 200)
        spent[k] = (thread_time_ns() - before) * 1e-6
    print(f"{name:58} {np.median(spent):.2f}  99.9 %: {np.quantile(spent, 0.999):.2f}")


def speed() -> None:
    """Updates of a planar arm, with EMG, as packets; of seven joints."""
    model, rng = fitted(0), np.random.default_rng(3)
    q, alpha = places(model, 4096, 0)
    raw = rng.normal(0, 1e-4, (4096, 6))
    live = Live(model, PERSON)
    by_emg = Live(model, PERSON, levels=levels(), limit_N_m_s=2e4)
    arm = Live(made_up(7, 26), SevenJoints(), posture_step_rad=0.0)
    spatial = {e: Live(made_up(4, 23), simulate_space(seed=1, sets=1)[0], elbow=e) for e in ELBOWS}
    joints, active = rng.uniform(0.2, 0.8, (512, 7)), rng.uniform(0, 0.4, (512, 26))
    timed("planar, 6 muscles, new", on(live, alpha, q))
    timed("planar, 6 muscles, kept", on(live, alpha, q[:1]))
    timed("... raw EMG and a limited rate, new", on(by_emg, raw, q))
    timed("... raw EMG and a limited rate, kept", on(by_emg, raw, q[:1]))
    one = live.update(alpha[0], q=q[0])
    timed("a result as a line of JSON", lambda _: json.dumps(one.to_dict()))
    timed("7 joints, 26 muscles, 3 axes, new", on(arm, active, joints), 5000)
    timed("7 joints, 26 muscles, 3 axes, kept", on(arm, active, joints[:1]))
    for elbow, one in spatial.items():
        timed(
            f"arm in space, elbow {elbow}, 23 muscles, new", on(one, active[:, :23], joints[:, :4])
        )
        timed(
            f"arm in space, elbow {elbow}, 23 muscles, kept",
            on(one, active[:, :23], joints[:1, :4]),
        )


def on(live: Live, samples: np.ndarray, q: np.ndarray) -> Callable[[int], Any]:
    """Updates with errors of the activations, one sample and posture after the other."""
    sd = np.full(samples.shape[1], 0.01)
    return lambda k: live.update(samples[k % len(samples)], q=q[k % len(q)], signal_sd=sd)


def hours() -> None:
    """Ten hours of activations at 20 Hz, ten minutes of raw EMG at 1 kHz: memory, and no drift."""
    model, rng = fitted(0), np.random.default_rng(4)
    q, alpha = places(model, 1000, 0)
    raw = rng.normal(0, 1e-4, (4000, 6)) * rng.uniform(0.5, 1.5, (4, 1000, 1)).reshape(4000, 1)
    for name, rate, length, samples, options in (
        ("activation", 20.0, 10, alpha, {}),
        ("raw EMG", 1000.0, 1 / 6, raw, {"levels": levels()}),
    ):
        live = Live(model, PERSON, rate_hz=rate, limit_N_m_s=2e4, **options)
        count = int(length * 3600 * rate)
        for k in range(count):
            one = live.update(samples[k % len(samples)], q=q[(k // 7) % 1000], time_s=k / rate)
            if k == count // 10:
                early = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        late = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        fresh = Live(model, PERSON, rate_hz=rate, limit_N_m_s=2e4, **options)
        for j in range(count - min(count, 20_000), count):
            again = fresh.update(samples[j % len(samples)], q=q[(j // 7) % 1000], time_s=j / rate)
        off = np.abs(one.commanded - again.commanded).max() / np.abs(one.commanded).max()
        print(
            f"{name}: {count} samples, {length:.3g} h; against one that began 20,000 samples ago "
            f"{off:.1e}; largest memory {early} kB after a tenth, {late} kB at the end",
            flush=True,
        )


def true_stiffness(q: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """The plant's stiffness of the hand (P, 2, 2)."""
    K_j = matrix(STUDY.truth_at(q, alpha)[0])
    V = np.linalg.inv([hand_jacobian(STUDY.plant, one) for one in q])
    return V.transpose(0, 2, 1) @ K_j @ V


def raw_emg(alpha: np.ndarray, known: EmgLevels, seed: int) -> np.ndarray:
    """Raw EMG (S, 6) at 1 kHz of activations (S, 6)."""
    sd = np.hypot(alpha * known.maximum_V, known.rest_V) * np.sqrt(np.pi / 2)
    return carrier(np.random.default_rng(seed), *alpha.shape) * sd


def truth(repeats: int = 10, count: int = 50) -> None:
    """Error and coverage at postures that were never calibrated."""
    known, packed = levels(), np.triu_indices(2)
    errors: dict[str, list[float]] = {"known": [], "EMG": [], "outside": []}
    inside: dict[str, list[bool]] = {"known": [], "EMG": [], "outside": []}
    flagged: dict[str, list[bool]] = {"known": [], "EMG": [], "outside": []}
    for seed in range(repeats):
        model = fitted(seed)
        q, alpha = places(model, count, seed)
        middle = STUDY.truths[POSTURES].posture.mean(axis=0)
        away = middle + 2.0 * (q - middle) / np.abs(q - middle).max(axis=1)[:, None] * 0.45
        away = away[~Region(model.measured).contains(_scaled(model, away))]
        live, by_emg = Live(model, PERSON), Live(model, PERSON, levels=known)
        for name, where in (("known", q), ("EMG", q), ("outside", away)):
            for p, K in enumerate(true_stiffness(where, alpha[: len(where)])):
                if name == "EMG":
                    by_emg.reset()
                    steady = np.tile(alpha[p], (1200, 1))
                    for x in raw_emg(steady, known, 1000 * seed + p):
                        one = by_emg.update(x, q=where[p])
                else:
                    one = live.update(alpha[p], q=where[p])
                errors[name].append(np.linalg.norm(one.stiffness - K) / np.linalg.norm(K))
                inside[name] += (np.abs(one.stiffness - K)[packed] <= one.half_width()).tolist()
                flagged[name].append(one.extrapolating)
    for name, values in errors.items():
        print(
            f"{name:8} {len(values)} places: error of K median {100 * np.median(values):.1f} %, "
            f"95 % below {100 * np.quantile(values, 0.95):.1f} %; bands hold "
            f"{100 * np.mean(inside[name]):.1f} %; flagged {100 * np.mean(flagged[name]):.0f} %"
        )


def drifted(repeats: int = 6, count: int = 50) -> None:
    """Gains that have changed since the model was fitted, muscle by muscle."""
    packed = np.triu_indices(2)
    for part in (0.0, 0.1, 0.2):
        errors, inside, told = [], [], []
        for seed in range(repeats):
            model, rng = fitted(seed), np.random.default_rng(5000 + seed)
            live, (q, alpha) = Live(model, PERSON), places(model, count, seed)
            gain = np.maximum(1 + part * rng.normal(size=6), 0.1)
            for p, K in enumerate(true_stiffness(q, alpha)):
                seen = np.minimum(gain * alpha[p], 1.0)
                one = live.update(seen, q=q[p])
                sure = live.update(seen, q=q[p], signal_sd=part * seen)
                told += (np.abs(one.stiffness - K)[packed] <= sure.half_width()).tolist()
                errors.append(np.linalg.norm(one.stiffness - K) / np.linalg.norm(K))
                inside += (np.abs(one.stiffness - K)[packed] <= one.half_width()).tolist()
        print(
            f"gains {100 * part:.0f} % off: error of K median {100 * np.median(errors):.1f} %, "
            f"95 % below {100 * np.quantile(errors, 0.95):.1f} %; bands hold "
            f"{100 * np.mean(inside):.1f} %, where signal_sd tells it {100 * np.mean(told):.1f} %",
            flush=True,
        )


def changing() -> None:
    """Error of K while all activations rise and fall, from raw EMG."""
    model, known = fitted(0), levels()
    q, t = STUDY.truths[POSTURES].posture.mean(axis=0), np.arange(20_000) / 1000
    for hz in (0.1, 0.5, 1.0, 2.0):
        live = Live(model, PERSON, levels=known)
        alpha = (0.4 + 0.35 * np.sin(2 * np.pi * hz * t))[:, None] * model.highest
        K = np.array([live.update(x, q=q).stiffness for x in raw_emg(alpha, known, 5)])
        seen = slice(2000, None, 50)
        true = true_stiffness(np.tile(q, (len(alpha[seen]), 1)), alpha[seen])
        off = np.sqrt(((K[seen] - true) ** 2).sum(axis=(1, 2)).mean())
        size = np.sqrt((true**2).sum(axis=(1, 2)).mean())
        swing = np.sqrt(((true - true.mean(axis=0)) ** 2).sum(axis=(1, 2)).mean())
        print(f"{hz:g} Hz: {100 * off / size:.1f} % of K, {100 * off / swing:.0f} % of its swing")


def _scaled(model: MuscleModel, q: np.ndarray) -> np.ndarray:
    return (q - model.box.mean(axis=1)) / ((model.box[:, 1] - model.box[:, 0]) / 2)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parts = {"equality": equality, "speed": speed, "truth": truth}
    parts |= {"changing": changing, "drifted": drifted, "hours": hours}
    parser.add_argument("part", nargs="+", choices=parts)
    for part in parser.parse_args().part:
        parts[part]()
