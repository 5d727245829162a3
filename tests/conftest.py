"""A linear limb with known M, B, K: the smallest recording that the estimators must invert."""

from __future__ import annotations

import gc
import os
from collections import Counter
from types import SimpleNamespace

# One thread for the matrix libraries, as the command line has it: the last bits depend on it.
for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

# Thousands of tests are collected and stay: nothing of them is garbage (`pytest_runtestloop`).
gc.disable()

import numpy as np
import pandas as pd
import pytest
from hypothesis import settings
from therapy_sessions import (  # noqa: F401 - fixtures of several folders
    therapy_able,
    therapy_alone,
    therapy_calibration,
    therapy_mockup,
    therapy_people,
)

from armimpedance.core.records import Recording

# No test depends on time, and every run tries the same examples.
settings.register_profile("armimpedance", deadline=None, derandomize=True)
settings.load_profile("armimpedance")

#: Modules that look at the same simulated sessions: one process makes each session once.
_TOGETHER = {
    "tests/recovery/test_therapy_recovery.py": "therapy sessions",
    "tests/unit/app/cli/test_therapy_commands.py": "therapy sessions",
    "tests/unit/manipulandum_sim/test_therapy_plant_sessions.py": "therapy sessions",
    "tests/unit/manipulandum_sim/test_therapy_session_runs.py": "therapy sessions",
    "tests/unit/hand/reaching/test_course.py": "pushed reaches",
    "tests/unit/hand/reaching/test_movement.py": "pushed reaches",
    "tests/unit/hand/reaching/test_plan.py": "pushed reaches",
    "tests/unit/hand/space/test_free_wrist.py": "sessions in space",
    "tests/unit/hand/space/test_inner_mode.py": "sessions in space",
    "tests/unit/hand/space/test_space_plan.py": "sessions in space",
    "tests/unit/hand/space/test_space_rig.py": "sessions in space",
    "tests/unit/hand/space/test_spatial_arm.py": "sessions in space",
}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Share out the tests by their files, and by sessions that several files look at."""
    from xdist.scheduler import LoadFileScheduling

    class Scheduling(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            return _TOGETHER.get(file, file)

    return Scheduling(config, log)


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop():
    """From here on garbage is looked for, among what the tests themselves make."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Cases beyond the first ones, where a test says how many are enough, are studies."""
    seen = Counter()
    for item in items:
        mark = item.get_closest_marker("first_cases")
        if mark is not None:
            seen[item.nodeid.partition("[")[0]] += 1
            if seen[item.nodeid.partition("[")[0]] > mark.args[0]:
                item.add_marker(pytest.mark.study)


RATE = 1000.0
M = np.array([[1.731, -0.655], [-0.655, 1.001]])
B = np.array([[8.63, -6.40], [-6.40, 13.86]])
K = np.array([[104.8, -74.4], [-74.4, 179.3]])


def bump(t, duration, amplitude):
    """Minimum-jerk bump 64 s^3 (1 - s)^3 and its first two derivatives."""
    s = np.clip(t / duration, 0, 1)
    p = np.polynomial.Polynomial([0, 0, 0, 64, -192, 192, -64])
    inside = (t >= 0) & (t <= duration)
    return [
        amplitude * inside * p.deriv(k)(s) / duration**k if k else amplitude * inside * p(s)
        for k in range(3)
    ]


def linear_recording(
    *,
    inertia=M,
    viscosity=B,
    stiffness=K,
    sets=5,
    duration=0.3,
    before=0.25,
    after=0.25,
    amplitude=0.005,
    force_noise=0.0,
    drift=0.0,
    directions=8,
    seed=0,
    rate=RATE,
    kind="hand",
    **fields,
):
    """F = -(M X'' + B X' + K (X - X_v)) on prescribed bumps; X_v drifts at constant velocity."""
    rng = np.random.default_rng(seed)
    d = len(inertia)
    t = np.arange(round((before + duration + after) * rate) + 1) / rate
    x, v, a = bump(t - before, duration, amplitude)
    trials, positions, forces = [], [], []
    for number in range(sets * directions):
        angle = 2 * np.pi * (number % directions) / directions
        u = np.array([np.cos(angle), np.sin(angle), np.cos(2 * angle + 1)])[:d]
        u = np.array([1.0 if number % 2 else -1.0]) if d == 1 else u
        virtual = rng.normal(0, drift, d) * t[:, None] if drift else np.zeros((len(t), d))
        force = -(
            np.outer(a, inertia @ u)
            + np.outer(v, viscosity @ u)
            + (np.outer(x, u) - virtual) @ stiffness.T
        )
        positions.append(0.3 + np.outer(x, u))
        forces.append(force + rng.normal(0, force_noise, force.shape) if force_noise else force)
        trials.append(
            {
                "trial": number + 1,
                "condition": "c",
                "set": number // directions + 1,
                "direction_deg": np.rad2deg(angle),
                "onset_s": before,
                "end_s": before + duration,
            }
        )
    n = len(trials)
    return Recording(
        kind=kind,
        sample_rate_hz=rate,
        trials=pd.DataFrame(trials),
        offsets=np.arange(n + 1) * len(t),
        time_s=np.tile(t, n),
        position=np.concatenate(positions),
        force=np.concatenate(forces),
        **fields,
    )


@pytest.fixture(scope="session")
def limb():
    """Truth and a maker of recordings of it."""
    return SimpleNamespace(M=M, B=B, K=K, record=linear_recording, bump=bump, rate=RATE)
