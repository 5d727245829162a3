"""Raw EMG of two muscles whose activation is known."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.records import Recording
from manipulandum_sim.elbow.emg import Electrodes, raw_emg

MUSCLES = ("biceps", "triceps")
MVC_V = np.array([4e-4, 6e-4])
RATE_HZ = 1000.0


@pytest.fixture(scope="session")
def emg_recording():
    """A function (activation (T, S, 2), seed, electrodes, extra_V (T, S, 2)) -> Recording."""

    def made(activation, seed=0, *, noise_V=0.0, extra_V=0.0, rest=False):
        trials, samples, muscles = activation.shape
        rng = np.random.default_rng(seed)
        electrodes = Electrodes(noise_V=noise_V, hum_V=0.0, artefact=0.0)
        still = np.zeros(samples)
        raw = [raw_emg(rng, one, MVC_V, still, electrodes, converted=False) for one in activation]
        table = pd.DataFrame({"trial": range(1, trials + 1), "condition": "held"})
        for muscle, mvc in zip(MUSCLES, MVC_V, strict=True):
            table[f"mvc_{muscle}_V"] = mvc
            if rest:
                table[f"rest_{muscle}_V"] = electrodes.rest_V
        return Recording(
            kind="joint",
            sample_rate_hz=RATE_HZ,
            trials=table,
            offsets=samples * np.arange(trials + 1),
            time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
            position=np.zeros((trials * samples, 1)),
            force=np.zeros((trials * samples, 1)),
            emg=(np.array(raw) + extra_V).reshape(-1, muscles),
            muscles=MUSCLES,
            perturbation="stochastic",
            torque="interaction",
        )

    return made
