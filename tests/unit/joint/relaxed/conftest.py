"""A forearm that swings below a moving pivot, with a known passive elbow, by its own equation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from swinging_forearm import CENTRE, ELBOW, INERTIA, MASS, SKELETON

from armimpedance.core.motion import MotionRecording
from armimpedance.core.skeleton import GRAVITY_M_S2

TRUTH = SimpleNamespace(k=2.95, h=0.031, f=0.015, q_r=1.0)


def swings(  # noqa: PLR0913
    trials=3,
    samples=233,
    *,
    rate=30.0,
    seed=0,
    truth=TRUTH,
    shake_m=0.01,
    start=0.4,
    angle_noise=0.0,
    place_noise=0.0,
    substeps=32,
    quadratic=0.0,
    drag=0.0,
):
    """(MotionRecording, exact): trials of a forearm let go, its pivot shaken along x and z.

    ``exact`` holds q, qd, qdd of the elbow and its passive torque at the frames. The sign of the
    simulated friction is tanh(qd / .01 rad/s).
    """
    rng = np.random.default_rng(seed)
    step = 1 / (rate * substeps)
    frequency = rng.uniform(0.4, 1.6, (2, 5, trials))
    phase = rng.uniform(0, 2 * np.pi, (2, 5, trials))
    amplitude = shake_m * rng.uniform(0.3, 1, (2, 5, trials)) / 2
    amplitude[1] *= 0.3
    J = INERTIA + MASS * CENTRE**2

    def pivot(t, order):
        angle = 2 * np.pi * frequency * np.asarray(t)[..., None, None, None] + phase
        waves = (2 * np.pi * frequency) ** order * np.sin(angle + order * np.pi / 2)
        return (amplitude * waves).sum(axis=-2)  # (..., 2, trials)

    def passive(q, v):
        about = q - truth.q_r
        damping = (truth.h + drag * np.abs(v)) * v + truth.f * np.tanh(v / 0.01)
        return truth.k * about + quadratic * about**2 + damping

    def acceleration(q, v, a):
        swing = MASS * CENTRE * (a[0] * np.cos(q) + (a[1] + GRAVITY_M_S2) * np.sin(q))
        return -(passive(q, v) + swing) / J

    half = pivot(np.arange(2 * substeps * (samples - 1) + 1) * step / 2, 2)
    q, v = 0.55 - start * rng.uniform(0.5, 1, trials), np.zeros(trials)
    rows = [(q, v, acceleration(q, v, half[0]))]
    for i in range(substeps * (samples - 1)):
        a0, a1, a2 = half[2 * i : 2 * i + 3]
        k1 = acceleration(q, v, a0)
        k2 = acceleration(q + step / 2 * v, v + step / 2 * k1, a1)
        k3 = acceleration(q + step / 2 * v + step**2 / 4 * k1, v + step / 2 * k2, a1)
        k4 = acceleration(q + step * v + step**2 / 2 * k2, v + step * k3, a2)
        q = q + step * v + step**2 / 6 * (k1 + k2 + k3)
        v = v + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        if (i + 1) % substeps == 0:
            rows.append((q, v, acceleration(q, v, a2)))
    # (3, T, S) -> (T S,) each
    q, v, a = np.array(rows).transpose(1, 2, 0).reshape(3, -1)
    time = np.tile(np.arange(samples) / rate, trials)
    coordinates = np.zeros((len(q), 7))
    coordinates[:, [0, 2]] = pivot(time[:samples], 0).transpose(2, 0, 1).reshape(-1, 2)
    coordinates[:, [0, 2]] += place_noise * rng.standard_normal((len(q), 2))
    coordinates[:, 6] = q + angle_noise * rng.standard_normal(len(q))
    motion = MotionRecording(
        sample_rate_hz=rate,
        trials=pd.DataFrame({"trial": np.arange(trials) + 1, "condition": "p5"}),
        offsets=np.arange(trials + 1) * samples,
        time_s=time,
        coordinates=coordinates,
        skeleton=SKELETON,
    )
    return motion, SimpleNamespace(q=q, qd=v, qdd=a, torque=passive(q, v), offsets=motion.offsets)


@pytest.fixture(scope="session")
def forearm():
    """The rig: `swings`, the truth and the joint's name."""
    return SimpleNamespace(swings=swings, truth=TRUTH, elbow=ELBOW, skeleton=SKELETON)
