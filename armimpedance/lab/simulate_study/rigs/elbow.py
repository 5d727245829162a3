"""One elbow in a powered exoskeleton under a random torque (Ruiz 2011)."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from armimpedance.joint.elbow import METHODS, JointSamples, from_recording, identify_elbow
from armimpedance.lab.simulate_study.fields import Field, Settings, number, one_of, whole
from armimpedance.lab.simulate_study.rig import (
    SHORTCUT,
    FittedNumbers,
    Numbers,
    Rig,
    Seeds,
    StudyQuantity,
    extras_of,
    numbers_of,
)

if TYPE_CHECKING:
    from armimpedance.core.arrays import FloatArray

QUANTITIES: Final = (
    StudyQuantity("I", "kg m^2"),
    StudyQuantity("B", "N m s/rad"),
    StudyQuantity("K", "N m/rad"),
)


def _conditions(_settings: Settings) -> tuple[str, ...]:
    return ("posture",)


def _simulate(
    settings: Settings, seeds: Seeds, sessions: range
) -> list[tuple[JointSamples, FloatArray]]:
    from manipulandum_sim.elbow import simulate_elbow

    made = []
    for session in sessions:
        recording, truth = simulate_elbow(
            "posture",
            seed=seeds.of(session),
            subject=str(settings["subject"]),
            noise=settings["noise"],  # type: ignore[arg-type]
            perturbation=settings["disturbance"],  # type: ignore[arg-type]
            repetitions=int(settings["sets"]),  # type: ignore[arg-type]
            duration_s=float(settings["duration_s"]),  # type: ignore[arg-type]
        )
        true = np.array([truth.I, truth.B.mean(), truth.K.mean()])
        made.append((from_recording(recording), true))
    return made


def _estimate(settings: Settings, made: list[tuple[JointSamples, FloatArray]]) -> Numbers:
    method = str(settings["method"])
    fits = (partial(_fit, samples, truth, method) for samples, truth in made)
    return numbers_of(fits, len(made), len(QUANTITIES))


def _fit(samples: JointSamples, truth: FloatArray, method: str) -> FittedNumbers:
    fitted = identify_elbow(samples, method=method).parameters
    return FittedNumbers(fitted.values, fitted.sd, fitted.dof, truth)


RIG: Final = Rig(
    line="an elbow under a random torque: inertia, viscosity, stiffness",
    fields=(
        Field("subject", "1", one_of(lambda: ("1", "2", "3", "4"))),
        Field("noise", "nominal", one_of(lambda: ("nominal", "sensor", "none"))),
        Field("sets", 5, whole(1, 1000)),
        Field("disturbance", "white", one_of(lambda: ("white", "prbs"))),
        Field("duration_s", 10.0, number(2, 600)),
        Field("method", METHODS.default, one_of(lambda: METHODS.names), simulated=False),
    ),
    quantities=QUANTITIES,
    extras=extras_of(len(QUANTITIES)),
    conditions=_conditions,
    simulate=_simulate,
    estimate=_estimate,
    shortcut=lambda: SHORTCUT,
)
