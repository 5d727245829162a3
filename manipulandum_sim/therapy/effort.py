"""Effort of a person in the therapy robot beside the passive arm: tau_user about the moving axis.

One law for all conditions, T trials at once:

    user = share need + K (q_plan - q) + B (qd_plan - qd) - resistance tanh(qd / v) + unsteadiness

``need`` is what the person's passive arm needs, by the person's own knowledge of it: weight and
inertia of the straight arm, stiffness, tone, damping. Who leads works it out for the own plan and
has learned the robot's inertia too; who lets a share be carried, for the motion as it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.therapy.reference import Reference

#: Neuromuscular impedance of a person who leads, N m/rad and N m s/rad: elevation, horizontal.
LEAD_STIFFNESS: Final = (60.0, 40.0)
LEAD_DAMPING: Final = (8.0, 5.0)
#: Of one who is helped: the speed of the reference is watched, not its place.
FOLLOW_DAMPING: Final = 2.0
#: Speed over which a resistance builds up, rad/s.
RESISTED_rad_s: Final = 0.15


@dataclass(frozen=True)
class Effort:
    """Effort in T trials.

    Attributes
    ----------
    plan : Reference
        The persons' own, with their timing.
    leads : (T,) bool
    share, stiffness, damping, resistance_Nm : (T,)
        Of the law above.
    level_kgm, inertia_kgm2, felt_kgm2 : (T,)
        Of the straight arm about the shoulder: first and second moment of its mass; of the robot,
        as far as the person has learned it.
    k, rest_rad, tone_Nm, viscosity : (T,)
        Of the passive arm about the moving axis.
    unsteady_Nm : (S, T, 5)
        Slow torque of the person, at the samples.
    """

    plan: Reference
    leads: Any
    share: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    resistance_Nm: FloatArray
    level_kgm: FloatArray
    inertia_kgm2: FloatArray
    felt_kgm2: FloatArray
    k: FloatArray
    rest_rad: FloatArray
    tone_Nm: FloatArray
    viscosity: FloatArray
    unsteady_Nm: FloatArray

    def torque(self, k: int, time_s: float, q: FloatArray, qd: FloatArray) -> FloatArray:
        """tau_user (T, 5) at sample k, at angles and rates (T, 5)."""
        rows, axis, plan = np.arange(len(q)), self.plan.axis, self.plan
        place, speed, acceleration = plan.course(time_s)
        planned = plan.start[rows, axis] + place
        own, rate = q[rows, axis], qd[rows, axis]
        at = np.where(self.leads, planned, own)
        needed = self.need(q, at, np.where(self.leads, speed, rate), acceleration)
        effort = self.share * needed
        effort += self.stiffness * (planned - own) + self.damping * (speed - rate)
        effort -= self.resistance_Nm * np.tanh(rate / RESISTED_rad_s)
        torque = self.unsteady_Nm[k].copy()
        torque[rows, axis] += effort
        return torque

    def need(
        self, q: FloatArray, at: FloatArray, rate: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """``I qdd + G + k (q - q_0) + tone + b qd`` (T,) of the moving axis at `at`, `rate`."""
        raised = self.plan.axis == 0
        height = np.where(raised, at, q[:, 0])
        sine = np.sin(height)
        # about the vertical only what reaches away from it counts
        inertia = self.inertia_kgm2 * np.where(raised, 1.0, sine**2) + self.felt_kgm2
        weight = np.where(raised, GRAVITY_M_S2 * self.level_kgm * sine, 0.0)
        passive = self.k * (at - self.rest_rad) + self.tone_Nm + self.viscosity * rate
        return np.asarray(inertia * acceleration + weight + passive)


def slow_torque(
    rng: np.random.Generator, samples: int, sd: FloatArray, time_s: float, rate_hz: float
) -> FloatArray:
    """Ornstein-Uhlenbeck processes (samples, n) of sd (n,) and one time constant."""
    from scipy.signal import lfilter

    white = rng.standard_normal((samples, len(sd)))
    keep = np.exp(-1 / (rate_hz * time_s))
    white[1:] *= np.sqrt(1 - keep**2)
    return np.asarray(lfilter([1.0], [1.0, -keep], white, axis=0) * sd)
