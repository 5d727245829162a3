"""A linear limb that is moved as it is told: M, B, K known by construction, no simulated arm.

What the estimator makes of the simulated arm besides, its bends and its robot, is not in it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Window
from armimpedance.hand.planning import SHAPES, Profile
from armimpedance.hand.still import Group
from armimpedance.lab.simulate_study.fields import (
    Field,
    Settings,
    names_or_all,
    number,
    one_of,
    whole,
)
from armimpedance.lab.simulate_study.hand_numbers import (
    ESTIMATOR,
    EXTRAS,
    QUANTITIES,
    PreparedWindows,
    estimate_all,
    shortcut,
)
from armimpedance.lab.simulate_study.rig import Rig, Seeds

RATE_HZ: Final = 1000.0
#: Before the onset and after the return, s.
REST_S: Final = 0.16
#: M (kg), B (N s/m), K (N/m) of a relaxed arm of a 70 kg man in the nominal posture.
LIMB: Final = np.array(
    [
        [[1.731, -0.655], [-0.655, 1.001]],
        [[8.63, -6.40], [-6.40, 13.86]],
        [[104.8, -74.4], [-74.4, 179.3]],
    ]
)
#: Condition -> factors of M, B and K.
CONDITIONS: Final = {
    "nominal": (1.0, 1.0, 1.0),
    #: The size of K's ellipse is 1.3 times as large.
    "stiffer": (1.0, 1.0, 1.3**0.5),
}
NOISE: Final = ("nominal", "sensor", "none")


def linear_window(
    noise: str,
    rng: np.random.Generator,
    *,
    limb: FloatArray = LIMB,
    trials: int = 40,
    shape: str = "minimum_jerk",
    amplitude_m: float = 0.005,
    duration_s: float = 0.3,
    rest_s: float = REST_S,
) -> Window:
    """One experiment on a linear limb, with the same kinds of noise as the simulated arm.

    `limb` (3, 2, 2): M, B, K, SI.
    `shape`: name of a disturbance in `hand.planning.SHAPES`.
    """
    t = np.arange(-rest_s, duration_s + rest_s + 1e-9, 1 / RATE_HZ)
    moved = Profile(SHAPES.named(shape), amplitude_m, duration_s).at(t)
    angle = np.arange(trials) * np.pi / 4
    u = np.column_stack([np.cos(angle), np.sin(angle)])[:, None, :]
    force = -sum(x[None, :, None] * u @ m.T for x, m in zip(moved[::-1], limb, strict=True))
    force = np.asarray(force)
    position = moved[0][None, :, None] * u
    if noise != "none":
        force = force + rng.normal(0, 0.03, (trials, len(t), 2))
        position = position + rng.uniform(0, 2e-5, (trials, 1, 2))
    if noise == "nominal":
        force = force + _unsteadiness(rng, t, trials, limb[2])
    if noise != "none":
        force = np.round(force / 0.05) * 0.05
        position = np.round(position / 2e-5) * 2e-5
    position = position + [-0.14, 0.43]
    before = t <= 0
    return Window(
        sample_rate_hz=RATE_HZ,
        lag_s=t,
        position=position,
        force=force,
        duration_s=np.full(trials, duration_s),
        trial=np.arange(trials),
        usable=np.ones(trials, dtype=bool),
        position_at_onset=position[:, before].mean(axis=1),
        force_at_onset=force[:, before].mean(axis=1),
        disturbance=np.arange(trials) % 8,
    )


def _unsteadiness(
    rng: np.random.Generator, t: FloatArray, trials: int, stiffness: FloatArray
) -> FloatArray:
    """Tremor (0.08 N rms at 9 Hz), slow voluntary force, drift of the virtual position."""
    phase = rng.uniform(0, 2 * np.pi, (trials, 1, 2))
    force = 0.08 * np.sqrt(2) * np.sin(2 * np.pi * 9.0 * t[None, :, None] + phase)
    keep = np.exp(-1 / (RATE_HZ * 0.4))
    slow = rng.normal(0, 0.25, (trials, 2))
    for n in range(len(t)):
        force[:, n] += slow
        slow = keep * slow + np.sqrt(1 - keep**2) * rng.normal(0, 0.25, (trials, 2))
    drift = rng.normal(0, 0.003, (trials, 1, 2)) * t[None, :, None]
    return np.asarray(force + drift @ stiffness.T)


def _conditions(settings: Settings) -> tuple[str, ...]:
    asked = settings["conditions"]
    for name in asked if isinstance(asked, tuple) else ():
        if name not in CONDITIONS:
            raise InputError(
                f"conditions: unknown {name!r}", expected=f"among {', '.join(CONDITIONS)}"
            )
    return asked if isinstance(asked, tuple) else ("nominal",)


def _simulate(settings: Settings, seeds: Seeds, sessions: range) -> list[PreparedWindows]:
    made = []
    for name in _conditions(settings):
        limb = LIMB * np.array(CONDITIONS[name])[:, None, None]
        key = list(CONDITIONS).index(name)
        windows = [
            linear_window(
                str(settings["noise"]),
                np.random.default_rng(seeds.sequence(key, session)),
                limb=limb,
                trials=8 * int(settings["sets"]),  # type: ignore[arg-type]
                shape=str(settings["disturbance"]),
                amplitude_m=float(settings["amplitude_m"]),  # type: ignore[arg-type]
                duration_s=float(settings["duration_s"]),  # type: ignore[arg-type]
            )
            for session in sessions
        ]
        made.append(PreparedWindows(windows, Group("hand", {"condition": name}), limb))
    return made


RIG: Final = Rig(
    line="a linear limb that is moved exactly: inertia, viscosity, stiffness, their ellipses",
    fields=(
        Field("conditions", None, names_or_all),
        Field("noise", "nominal", one_of(lambda: NOISE)),
        Field("sets", 5, whole(1, 1000)),
        Field("disturbance", "minimum_jerk", one_of(lambda: SHAPES.names)),
        Field("amplitude_m", 0.005, number(1e-4, 0.05)),
        Field("duration_s", 0.3, number(0.02, 5)),
        *ESTIMATOR,
    ),
    quantities=QUANTITIES,
    extras=EXTRAS,
    conditions=_conditions,
    simulate=_simulate,
    estimate=estimate_all,
    shortcut=shortcut,
)
