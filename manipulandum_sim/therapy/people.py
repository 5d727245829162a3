"""From a list of trials to arrays over them: what plant, controller and people need."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.therapy.arm import LINKS, TherapyArm
from manipulandum_sim.therapy.control import ASSIST
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice
from manipulandum_sim.therapy.dynamics import Payload
from manipulandum_sim.therapy.effort import (
    FOLLOW_DAMPING,
    LEAD_DAMPING,
    LEAD_STIFFNESS,
    Effort,
    slow_torque,
)
from manipulandum_sim.therapy.plan import TherapyOptions, TherapyTrial
from manipulandum_sim.therapy.reference import REST_S, Reference, reference
from manipulandum_sim.therapy.subject import FLUCTUATION_S, FLUCTUATION_Nm

#: Inertia of the robot's links about the shoulder, as a person has learned it, kg m^2.
FELT_kgm2: Final = 1.0
#: Within which a person who leads comes to rest after the own plan's end, s.
SETTLE_S: Final = 0.8


def payload_of(trials: list[TherapyTrial], device: TherapyDevice) -> Payload:
    """The persons' arms on the robot's links."""
    return arm_payload([trial.arm for trial in trials], device)


def arm_payload(arms: list[TherapyArm], device: TherapyDevice) -> Payload:
    """Arms on the robot's links, the robot adjusted to each."""
    names = [link.name for link in device.links]
    count, n = len(arms), len(names)
    mass, com, inertia = np.zeros((count, n)), np.zeros((count, n, 3)), np.zeros((count, n, 3, 3))
    for t, arm in enumerate(arms):
        for body, link in enumerate(LINKS):
            i = names.index(link)
            mass[t, i] = arm.mass_kg[body]
            com[t, i, 2] = -arm.com_m[body]
            inertia[t, i] = np.diag(arm.inertia_kgm2[body])
    return Payload(mass, com, inertia, np.array([arm.upper_arm_m for arm in arms]))


@dataclass(frozen=True)
class PassiveLimbs:
    """``K_s (q - q_0) + tone + b qd`` of T arms, all (T, 5)."""

    k: FloatArray
    rest_rad: FloatArray
    tone_Nm: FloatArray
    damping: FloatArray

    @classmethod
    def of(cls, trials: list[TherapyTrial]) -> PassiveLimbs:
        """Passive limbs of each trial's person in this repetition."""
        k, rest = np.zeros((len(trials), 5)), np.zeros((len(trials), 5))
        k[:, :2] = [trial.k for trial in trials]
        rest[:, :2] = [trial.rest_rad for trial in trials]
        tone = np.array([trial.subject.tone_Nm for trial in trials])
        return cls(k, rest, tone, np.array([trial.subject.damping for trial in trials]))

    def __call__(self, q: FloatArray, qd: FloatArray) -> FloatArray:
        """(..., T, 5)."""
        return np.asarray(self.elastic(q) + self.beside(qd))

    def elastic(self, q: FloatArray) -> FloatArray:
        """Stiffness alone."""
        return np.asarray(self.k * (q - self.rest_rad))

    def beside(self, qd: FloatArray) -> FloatArray:
        """Tone and velocity-dependent resistance."""
        return np.asarray(self.tone_Nm + self.damping * qd)


def reference_of(trials: list[TherapyTrial], speed_deg_s: float) -> Reference:
    """Reference that the controller follows and the screen shows."""
    return reference([trial.movement for trial in trials], speed_deg_s)


def samples_of(trials: list[TherapyTrial], asked: Reference) -> Any:
    """Samples (T,) that a trial may need: the movement in the person's own time, and rest."""
    pace = np.array([trial.pace for trial in trials])
    delay = np.array([trial.delay_s for trial in trials])
    late = np.where([trial.leads for trial in trials], SETTLE_S, 0.0)
    seconds = asked.begin_s + delay + asked.duration_s * pace + late + REST_S
    return np.round(seconds * RATE_HZ).astype(np.int64) + 1


def effort_of(
    trials: list[TherapyTrial],
    asked: Reference,
    device: TherapyDevice,
    samples: int,
    options: TherapyOptions,
) -> Effort:
    """Effort of the persons over `samples` samples, run-in included."""
    rows = np.arange(len(trials))
    axis, limbs = asked.axis, PassiveLimbs.of(trials)
    size = asked.size + [trial.miss_rad for trial in trials]
    plan = replace(
        asked,
        size=size,
        begin_s=asked.begin_s + [trial.delay_s for trial in trials],
        duration_s=asked.duration_s * [trial.pace for trial in trials],
    )
    leads = np.array([trial.leads for trial in trials])
    modes = np.array([trial.mode for trial in trials])
    rotor, felt = device.motor_inertia_kgm2[axis], 1 - options.inertia_compensation
    return Effort(
        plan=plan,
        leads=leads,
        share=np.array([trial.share for trial in trials]),
        stiffness=np.where(leads, np.take(LEAD_STIFFNESS, axis), 0.0),
        damping=np.where(
            leads, np.take(LEAD_DAMPING, axis), np.where(modes == ASSIST, FOLLOW_DAMPING, 0.0)
        ),
        resistance_Nm=np.array([trial.resistance_Nm for trial in trials]),
        level_kgm=np.array([trial.arm.level_kgm for trial in trials]),
        inertia_kgm2=np.array([trial.arm.inertia_level_kgm2 for trial in trials]),
        felt_kgm2=np.where(leads, felt * (FELT_kgm2 + rotor), 0.0),
        k=limbs.k[rows, axis],
        rest_rad=limbs.rest_rad[rows, axis],
        tone_Nm=limbs.tone_Nm[rows, axis],
        viscosity=limbs.damping[rows, axis],
        unsteady_Nm=_unsteady(trials, samples, options.noisy),
    )


def _unsteady(trials: list[TherapyTrial], samples: int, noisy: bool) -> FloatArray:
    """Slow torques (samples, T, 5) of elevation and horizontal rotation."""
    torque = np.zeros((samples, len(trials), 5))
    if noisy:
        for t, trial in enumerate(trials):
            torque[:, t, :2] = slow_torque(
                trial.stream("unsteady"), samples, np.array(FLUCTUATION_Nm), FLUCTUATION_S, RATE_HZ
            )
    return torque
