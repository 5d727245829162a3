"""A relaxed elbow that is filmed while it swings (Venture 2009): stiffness, viscosity, friction."""

from __future__ import annotations

from functools import partial
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.motion import MotionRecording
from armimpedance.joint.relaxed import METHODS, from_motion, identify_passive
from armimpedance.lab.simulate_study.fields import Field, Settings, number, one_of
from armimpedance.lab.simulate_study.rig import (
    BLOCK,
    SHORTCUT,
    FittedNumbers,
    Numbers,
    Rig,
    Seeds,
    StudyQuantity,
    extras_of,
    numbers_of,
)
from armimpedance.limb.mocap import joint_motion

JOINT: Final = "right_elbow_flexion"
QUANTITIES: Final = (
    StudyQuantity("k", "N m/rad"),
    StudyQuantity("h", "N m s/rad"),
    StudyQuantity("f", "N m"),
)
#: Motion from markers, rest angle (rad), and k, h, f.
Filmed = tuple[MotionRecording, float, FloatArray]


def _subjects() -> tuple[str, ...]:
    from manipulandum_sim.passive import PASSIVE_SUBJECTS

    return tuple(PASSIVE_SUBJECTS)


def _conditions(_settings: Settings) -> tuple[str, ...]:
    return ("relaxed",)


def _simulate(settings: Settings, seeds: Seeds, sessions: range) -> list[Filmed]:
    """A whole block side by side, however many are wanted: the last bits hang on the number."""
    from manipulandum_sim.passive import simulate_passive_many
    from manipulandum_sim.studio import Studio

    block = range(sessions.start, sessions.start + BLOCK)
    recordings = simulate_passive_many(
        settings["experiment"],  # type: ignore[arg-type]
        [seeds.of(session) for session in block],
        subject=str(settings["subject"]),
        studio=Studio(float(settings["marker_noise_m"])),  # type: ignore[arg-type]
    )
    made = []
    for markers, truth in recordings[: len(sessions)]:
        i = truth.joints.index(JOINT)
        true = np.array([truth.k[i], truth.h[i], truth.f[i]])
        made.append((joint_motion(markers).motion, float(truth.q_r[i]), true))
    return made


def _estimate(settings: Settings, made: list[Filmed]) -> Numbers:
    method, cutoff = str(settings["method"]), float(settings["cutoff_hz"])  # type: ignore[arg-type]
    fits = (partial(_fit, filmed, method, cutoff) for filmed in made)
    return numbers_of(fits, len(made), len(QUANTITIES))


def _fit(filmed: Filmed, method: str, cutoff_hz: float) -> FittedNumbers:
    motion, rest, truth = filmed
    samples = from_motion(motion, [JOINT], cutoff_hz=cutoff_hz)
    (fit,) = identify_passive(samples, rest_angle=rest, method=method, cross_validate=False)
    fitted = [fit.parameters[quantity.name] for quantity in QUANTITIES]
    values, sd = (np.array([getattr(p, name) for p in fitted]) for name in ("value", "sd_robust"))
    return FittedNumbers(values, sd, fitted[0].dof, truth)


RIG: Final = Rig(
    line="a relaxed elbow under motion capture: stiffness, viscosity, dry friction",
    fields=(
        Field("experiment", "p5", one_of(lambda: ("p5", "release"))),
        Field("subject", "1", one_of(_subjects)),
        Field("marker_noise_m", 0.5e-3, number(0, 0.1)),
        Field("cutoff_hz", 8.0, number(1, 14), simulated=False),
        Field("method", METHODS.default, one_of(lambda: METHODS.names), simulated=False),
    ),
    quantities=QUANTITIES,
    extras=extras_of(len(QUANTITIES)),
    conditions=_conditions,
    simulate=_simulate,
    estimate=_estimate,
    shortcut=lambda: SHORTCUT,
)
