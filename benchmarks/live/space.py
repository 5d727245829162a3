"""Live stiffness of a hand in space, on a plant that is not ours: MyoSuite's arm in MuJoCo.

    python benchmarks/live/space.py 30x2 20x2 36x1 held lines [--seeds 6] [--answer force-length]

A laboratory measures joint stiffness and viscosity at some postures (the corners of a box of four
angles, drawn in a little at random, the rest inside) and levels of activity, with errors of 6 %:
of an element, of the geometric mean of its joints' own. A person there bears the arm's weight and a
hand force of 8 N (sd of each axis) with activations near to a random co-contraction. They are known
with errors of 10 %, as they are in what follows. Anatomy is known from a generic arm: moment arms
over posture as polynomials of order 2, every term of them wrong by 20 %, maximum tensions by 20 %,
one stiffness per tension for all muscles. Kinematics and weight are known.

Asked are 50 postures anywhere in the box, with other activations and forces: the error of the
hand's stiffness with a free elbow (Frobenius norm), what the 95 % bands of its six elements hold.

- ``30x2``: 30 postures, two levels each, all ten elements of the joints' stiffness.
- ``held``: the hand's stiffness with the upper arm kept from turning about its axis, mapped to the
  three joints that move: 6 of 10 elements; errors of 6 % at the hand.
- ``free``: the hand's stiffness with the elbow free, and no viscosity.
- ``lines``: the generic moment arms are lines over posture only.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import sys
import time
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from myoarm import MUSCLES, RANGE, SHORT_RANGE, MyoArm

from armimpedance.limb.arm import MuscularArm, PolynomialPaths, fit_paths
from armimpedance.muscles.live import Live
from armimpedance.muscles.models import HandRows, JointRows, fit_muscle_model

NOISE, OF_ACTIVATION, OF_ANATOMY = 0.06, 0.1, 0.2
#: Of the joints, those that move while the upper arm is kept from turning about its axis.
MOVING = [0, 1, 3]


def generic_arm(plant: MyoArm, rng: np.random.Generator, order: int = 2) -> MuscularArm:
    """What a laboratory knows of the person's muscles."""
    grid = np.array(list(product(*(np.linspace(*limits, 4) for limits in RANGE))))
    G = np.array([plant.moment_arms(q) for q in grid])
    paths = fit_paths(MUSCLES, grid, G, order, np.abs(G).max(axis=0) > 1.5e-3, box=RANGE).paths
    wrong = np.maximum(1 + OF_ANATOMY * rng.normal(size=paths.coefficients.shape), 0.2)
    tension = plant.strongest_of_muscles * np.exp(OF_ANATOMY * rng.normal(size=len(MUSCLES)))
    return MuscularArm(
        name="generic",
        paths=PolynomialPaths(MUSCLES, paths.exponents, paths.coefficients * wrong, RANGE),
        max_tension=tension,
        stiffness_per_tension=SHORT_RANGE / float(np.median(plant.fibre_of_muscles)),
        angle_range=RANGE,
        source="the person's, with errors",
    )


def calibrated_postures(rng: np.random.Generator, count: int) -> np.ndarray:
    """Corners of the box, then postures inside of it."""
    corners = np.array(list(product((-1.0, 1.0), repeat=4))) * rng.uniform(0.85, 1.0, (16, 4))
    inside = rng.uniform(-0.8, 0.8, (max(count - 16, 0), 4))
    u = np.vstack([corners, inside])[:count]
    return RANGE.mean(axis=1) + u * np.ptp(RANGE, axis=1) / 2


def borne(plant: MyoArm, q: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A hand force (3,) and activations (23,) that hold it and the arm's weight."""
    force = rng.normal(0, 8, 3)
    wish = rng.uniform(0.01, 0.2) * rng.uniform(0.2, 1.8, len(MUSCLES))
    return force, plant.held(q, force, wish)


def errors_of(A: np.ndarray, part: float) -> np.ndarray:
    """Standard errors of elements that are a part of the geometric mean of both diagonal ones."""
    size = np.sqrt(np.abs(np.einsum("...ii->...i", A)))
    return part * size[..., :, None] * size[..., None, :]


def symmetric_noise(rng: np.random.Generator, sd: np.ndarray) -> np.ndarray:
    upper = np.triu(rng.normal(size=sd.shape))
    return sd * (upper + np.triu(upper, 1).swapaxes(-1, -2))


def measured_rows(
    plant: MyoArm, rng: np.random.Generator, postures: int, levels: int, case: str
) -> JointRows | HandRows:
    """What the laboratory measures."""
    q, alpha, K, B, tau, J, F = [], [], [], [], [], [], []
    for where in calibrated_postures(rng, postures):
        for _ in range(levels):
            force, active = borne(plant, where, rng)
            q.append(where)
            alpha.append(active)
            K.append(plant.joint_stiffness(where, active))
            B.append(plant.joint_viscosity(where, active))
            J.append(plant.jacobian(where))
            tau.append(plant.weight(where) + J[-1].T @ force)
            F.append(force)
    active, known = np.array(alpha), {}
    wrong = 1 + OF_ACTIVATION * rng.normal(size=active.shape)
    muscular = {
        "activation": np.clip(active * wrong, 0, 1),
        "activation_sd": OF_ACTIVATION * active,
        "torque": np.array(tau),
        "muscles": MUSCLES,
    }
    if case == "free":
        hand = np.array([plant.hand_stiffness(*one) for one in zip(q, alpha, F, strict=True)])
        sd = errors_of(hand, NOISE)
        hand = hand + symmetric_noise(rng, sd)
        told = {"stiffness": hand, "stiffness_sd": sd}
        return HandRows.of(plant, q, force=F, **told, **muscular)
    for name, every in (("stiffness", np.array(K)), ("viscosity", np.array(B))):
        A = (every + every.swapaxes(1, 2)) / 2
        sd = errors_of(A, NOISE)
        if case == "held":
            A, sd = held_elements(rng, A, np.array(J)[:, :, MOVING])
        else:
            A = A + symmetric_noise(rng, sd)
        known |= {name: A, f"{name}_sd": sd}
    return JointRows(joint_angles=np.array(q), **known, **muscular)


def held_elements(
    rng: np.random.Generator, A: np.ndarray, J: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Elements (P, 4, 4) of joints that move, from the hand's matrix; the others are not known.

    The noise is put on the hand's ``J^-T A J^-1``; of its errors at the joints the correlation is
    lost.
    """
    own = A[:, MOVING][:, :, MOVING]
    V = np.linalg.inv(J)
    at_hand = V.swapaxes(1, 2) @ own @ V
    sd = errors_of(at_hand, NOISE)
    noisy = J.swapaxes(1, 2) @ (at_hand + symmetric_noise(rng, sd)) @ J
    draws = [J.swapaxes(1, 2) @ symmetric_noise(rng, sd) @ J for _ in range(400)]
    # an element that nobody measured: zero, with an error that says nothing
    values, errors = np.zeros_like(A), np.full_like(A, 1e4)
    for i, a in enumerate(MOVING):
        for j, b in enumerate(MOVING):
            values[:, a, b], errors[:, a, b] = noisy[:, i, j], np.std(draws, axis=0)[:, i, j]
    return values, errors


def one_study(plant: MyoArm, case: str, seed: int) -> tuple[np.ndarray, ...]:
    """Errors of K (50,), held elements (50, 6), extrapolation flags (50,)."""
    rng = np.random.default_rng(seed)
    arm = generic_arm(plant, rng, order=1 if case == "lines" else 2)
    count, levels = (int(x) for x in case.split("x")) if "x" in case else (30, 2)
    rows = measured_rows(plant, rng, count, levels, case)
    before = time.process_time()
    model = fit_muscle_model(rows, arm, moment_arm_order=1)
    spent, live = time.process_time() - before, Live(model, plant)
    error, held, flagged = [], [], []
    packed = np.triu_indices(3)
    for _ in range(50):
        q = rng.uniform(*RANGE.T)
        force, alpha = borne(plant, q, rng)
        seen = np.clip(alpha * (1 + OF_ACTIVATION * rng.normal(size=alpha.shape)), 0, 1)
        now = live.update(seen, q=q, force=force, signal_sd=OF_ACTIVATION * seen)
        true = plant.hand_stiffness(q, alpha, force)
        error.append(np.linalg.norm(now.stiffness - true) / np.linalg.norm(true))
        held.append(np.abs(now.stiffness - true)[packed] <= now.half_width())
        flagged.append(now.extrapolating)
    print(
        f"  {case} seed {seed}: {len(rows.joint_angles)} rows, {len(model.values)} parameters, fit "
        f"{spent:.0f} s, scatter {model.scatter[0]:.3f}, error {100 * np.median(error):.1f} %, "
        f"held {100 * np.mean(held):.1f} %",
        flush=True,
    )
    return np.array(error), np.array(held), np.array(flagged)


def summary(name: str, error: np.ndarray, held: np.ndarray) -> str:
    """A line of the table."""
    if not len(error):
        return f"{name}: none"
    return (
        f"{name}: {len(error)} places, error of K median {100 * np.median(error):.1f} %, 95 % "
        f"below {100 * np.quantile(error, 0.95):.1f} %; bands hold {100 * held.mean():.1f} %, "
        "by element " + " ".join(f"{100 * x:.0f}" for x in held.mean(axis=0))
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("case", nargs="+")
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--answer", default="short-range")
    asked = parser.parse_args()
    arm = MyoArm(asked.answer)
    for case in asked.case:
        every = range(asked.first, asked.first + asked.seeds)
        error, held, flagged = (
            np.concatenate(x) for x in zip(*(one_study(arm, case, s) for s in every), strict=True)
        )
        print(summary(f"{case} all", error, held))
        print(summary("  not flagged", error[~flagged], held[~flagged]))
        print(summary("  flagged", error[flagged], held[flagged]), flush=True)
