"""Truth of a reach: the plant, differentiated along its course without variability.

Nothing here maps one level to another by a formula: hand and joint matrices come from separate
differences of the plant's force and torque.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from manipulandum_sim.hand import (
    STEP_M,
    STEP_RAD,
    STEP_RATE,
    Arm,
    Motion,
    MuscleCommand,
    SimulatedSubject,
    derivative,
    find_subject,
    force_on_handle,
    joint_basis,
    muscle_stretch,
)
from manipulandum_sim.movement.path import Courses, Motion2
from manipulandum_sim.movement.rig import MovementRig
from manipulandum_sim.movement.run import Reaches, commands_of, intended
from manipulandum_sim.truth_file import reading_values, write_values


@dataclass(frozen=True)
class MovementTruth(FrozenRecord):
    """Impedance along the course that nobody disturbs, at S times.

    Attributes
    ----------
    time_s : (S,)
        Since the movement's onset.
    travelled_m : (S,)
    hand, velocity, force : (S, 2)
        Hand from the shoulder, its velocity, and the force by the limb on what it holds.
    posture : (S, 2)
        rad.
    M_e, B_e, K_e : (S, 2, 2)
        ``-dF/da``, ``-dF/dv``, ``-dF/dx`` of the limb along the course: Coriolis and configuration
        terms are in B_e and K_e, which are therefore not symmetric.
    M_j, B_j, K_j : (S, 2, 2)
        Joint inertia; derivatives of the torque of muscles and joints by rates and angles.
    K_e_reflex : (S, 2, 2)
        What the delayed reflex adds to K_e once it has answered.
    reflex_delay_s : float
    """

    time_s: Annotated[FloatArray, "S"]
    travelled_m: Annotated[FloatArray, "S"]
    hand: Annotated[FloatArray, "S 2"]
    velocity: Annotated[FloatArray, "S 2"]
    force: Annotated[FloatArray, "S 2"]
    posture: Annotated[FloatArray, "S 2"]
    M_e: Annotated[FloatArray, "S 2 2"]
    B_e: Annotated[FloatArray, "S 2 2"]
    K_e: Annotated[FloatArray, "S 2 2"]
    M_j: Annotated[FloatArray, "S 2 2"]
    B_j: Annotated[FloatArray, "S 2 2"]
    K_j: Annotated[FloatArray, "S 2 2"]
    K_e_reflex: Annotated[FloatArray, "S 2 2"]
    reflex_delay_s: float = 0.0

    def at(self, name: str, travelled_m: float) -> FloatArray:
        """A course (S, ...) where the hand has travelled this far."""
        moving = np.flatnonzero(np.diff(self.travelled_m) > 0)
        rows = np.arange(moving[0], moving[-1] + 2)
        where = np.interp(travelled_m, self.travelled_m[rows], rows.astype(float))
        low = min(int(where), len(self.time_s) - 2)
        values: FloatArray = getattr(self, name)
        return np.asarray(values[low] + (where - low) * (values[low + 1] - values[low]))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON; a file of that name is replaced at once or not at all."""
        write_values({f.name: getattr(self, f.name) for f in fields(self)}, path)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> MovementTruth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not such a truth.
        """
        with reading_values(path, "a truth of a movement") as plain:
            values: dict[str, Any] = {
                k: np.array(v) if isinstance(v, list) else v for k, v in plain.items()
            }
            return cls(**values)


def find_truth(
    rig: MovementRig, subject: str | SimulatedSubject = "A", step_s: float = 0.005
) -> MovementTruth:
    """The truth of a rig's reach.

    Parameters
    ----------
    rig : MovementRig
    subject : {"A", "B", "C", "D"} or SimulatedSubject
    step_s : float
        Between two times.
    """
    arm = Arm.of(find_subject(subject))
    time = np.arange(0.0, rig.line.duration_s + 0.2, step_s)
    reaches = Reaches(arm, rig, Courses.nominal(rig.line, 0.0), np.array([-1]), np.zeros((2, 1)))
    motion = intended(reaches, time)
    told = MuscleCommand(*(part[:, :, 0] for part in commands_of(reaches, time)))
    return _differentiated(arm, rig, time, Motion2(*(part[:, :, 0] for part in motion)), told)


def _differentiated(
    arm: Arm, rig: MovementRig, time: FloatArray, motion: Motion2, told: MuscleCommand
) -> MovementTruth:
    x, v, a = (np.ascontiguousarray(part.T) for part in motion)
    end = arm.link.end_motion(*motion.position, *motion.velocity)
    q, w = np.stack(arm.link.angles(end), axis=1), np.stack([end.w1, end.w2], axis=1)

    def force(x: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        return np.stack(force_on_handle(arm, Motion(*x.T, *v.T, *a.T), told, 0.0), axis=-1)

    def torque(q: FloatArray, w: FloatArray) -> FloatArray:
        tau, _ = arm.joint_torque(joint_basis(*q.T), (w[:, 0], w[:, 1]), told, 0.0)
        return np.stack(tau, axis=-1)

    K_reflex, delay = np.zeros((len(time), 2, 2)), 0.0
    if rig.reflex is not None:
        K_reflex, delay = -_reflex(arm, x, told), rig.reflex.delay_s
    return MovementTruth(
        time_s=time,
        travelled_m=(x - rig.line.start_m) @ rig.line.along,
        hand=x,
        velocity=v,
        force=force(x, v, a),
        posture=q,
        M_e=-derivative(lambda at: force(x, v, at), a, STEP_RATE),
        B_e=-derivative(lambda at: force(x, at, a), v, STEP_RATE),
        K_e=-derivative(lambda at: force(at, v, a), x, STEP_M),
        M_j=_joint_inertia(arm, q),
        B_j=-derivative(lambda at: torque(q, at), w, STEP_RATE),
        K_j=-derivative(lambda at: torque(at, w), q, STEP_RAD),
        K_e_reflex=K_reflex,
        reflex_delay_s=delay,
    )


def _reflex(arm: Arm, x: FloatArray, told: MuscleCommand) -> FloatArray:
    """``dF/dx`` (S, 2, 2) of the delayed reflex alone, the muscles where they are."""
    zero = np.zeros_like(x)

    def answered(past: FloatArray) -> FloatArray:
        stretch = muscle_stretch(arm, past[:, 0], past[:, 1], told, np.zeros(len(x)))
        motion = Motion(*x.T, *zero.T, *zero.T)
        return np.stack(force_on_handle(arm, motion, told, 0.0, stretch), axis=-1)

    return derivative(answered, x, STEP_M)


def _joint_inertia(arm: Arm, q: FloatArray) -> FloatArray:
    """(S, 2, 2) kg m^2."""
    link, cosine = arm.link, np.cos(q[:, 1])
    M = np.empty((len(q), 2, 2))
    M[:, 0, 0] = link.inertia1 + link.inertia2 + 2 * link.coupling * cosine
    M[:, 0, 1] = M[:, 1, 0] = link.inertia2 + link.coupling * cosine
    M[:, 1, 1] = link.inertia2
    return M
