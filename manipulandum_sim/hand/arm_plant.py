"""The human arm: two links, six muscles, passive joints; force at the hand for a given motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray
from manipulandum_sim.hand.muscles import (
    COURSES,
    MuscleMechanics,
    MusclePaths,
    human_mechanics,
    human_paths,
)
from manipulandum_sim.hand.subjects import SimulatedSubject
from manipulandum_sim.hand.two_link import EndMotion, TwoLink, end_force


@dataclass(frozen=True)
class PassiveJoints:
    """Springs and dampers of the joints' own tissue, shoulder and elbow.

    Attributes
    ----------
    stiffness : pair of float
        N m/rad; the elbow's lies in the .4-1.8 of Wiegner and Watts 1986.
    viscosity : pair of float
        N m s/rad.
    rest : pair of float
        Rest angles of the springs (rad).
    """

    stiffness: tuple[float, float] = (1.0, 1.0)
    viscosity: tuple[float, float] = (0.2, 0.2)
    rest: tuple[float, float] = (1.0, 1.4)


class MuscleCommand(NamedTuple):
    """Commands of the nervous system, each (6, ...) to broadcast over the batch.

    ``f = tension + stiffness (L - L_v) + viscosity dL + reflex stretch``, f >= 0, with the virtual
    length ``L_v = virtual_length + virtual_velocity t``.
    """

    tension: FloatArray
    stiffness: FloatArray
    viscosity: FloatArray
    virtual_length: FloatArray
    virtual_velocity: FloatArray
    reflex: FloatArray

    def over_time(self) -> MuscleCommand:
        """The same command with a last axis for time."""
        return MuscleCommand(*(part[..., None] for part in self))


class Stretch(NamedTuple):
    """Muscles' lengthening beyond their virtual length (6, ...) and its rate."""

    length: FloatArray
    velocity: FloatArray


@dataclass(frozen=True)
class Arm:
    """Everything of a subject's arm that does not change during an experiment."""

    link: TwoLink
    paths: MusclePaths
    mechanics: MuscleMechanics
    passive: PassiveJoints = PassiveJoints()

    @classmethod
    def of(cls, subject: SimulatedSubject) -> Arm:
        """The arm of a subject."""
        link = TwoLink.from_segments(
            subject.upper_arm_m,
            subject.forearm_hand_m,
            subject.upper_arm,
            subject.forearm_hand,
        )
        return cls(
            link, human_paths(COURSES[subject.moment_arms]), human_mechanics(subject.strength)
        )

    def passive_torque(
        self, q1: FloatArray, q2: FloatArray, w1: FloatArray, w2: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Torque of the passive joints (N m), each (...,)."""
        p = self.passive
        tau1 = -p.stiffness[0] * (q1 - p.rest[0]) - p.viscosity[0] * w1
        tau2 = -p.stiffness[1] * (q2 - p.rest[1]) - p.viscosity[1] * w2
        return tau1, tau2

    def joint_torque(
        self,
        basis: FloatArray,
        rates: tuple[FloatArray, FloatArray],
        command: MuscleCommand,
        time: FloatArray | float,
        delayed: FloatArray | float = 0.0,
    ) -> tuple[tuple[FloatArray, FloatArray], Stretch]:
        """Torque of muscles and passive joints, and the muscles' stretch.

        Parameters
        ----------
        basis : (6, ...)
            The values of `joint_basis` at the joint angles.
        rates : pair of (...,)
            Shoulder and elbow, rad/s.
        command : MuscleCommand
        time : (...,) or float
            Since the onset, s.
        delayed : (6, ...) or 0
            The stretch that the reflex answers to.

        Returns
        -------
        (tau1, tau2), stretch
        """
        w1, w2 = rates
        G1, G2 = self.paths.moment_arms(basis)
        rate = G1 * w1
        rate += G2 * w2
        length = self.paths.length(basis)
        length -= command.virtual_length
        length -= command.virtual_velocity * time
        f = command.stiffness * length
        f += command.tension
        f += command.viscosity * rate
        if np.ndim(delayed):
            f += command.reflex * delayed
        np.maximum(f, 0.0, out=f)
        tau1, tau2 = self.passive_torque(basis[0], basis[3], w1, w2)
        # tau = -G^T f, (2,) = (2, 6) (6,)
        tau1 -= np.add.reduce(G1 * f, axis=0)
        tau2 -= np.add.reduce(G2 * f, axis=0)
        rate -= command.virtual_velocity
        return (tau1, tau2), Stretch(length, rate)

    def muscle_force_at_hand(
        self,
        motion: EndMotion,
        command: MuscleCommand,
        time: FloatArray | float,
        delayed: FloatArray | float = 0.0,
    ) -> tuple[tuple[FloatArray, FloatArray], Stretch]:
        """Force at the hand that muscles and passive joints make, ``J^-T tau``, and the stretch."""
        basis, rates = basis_at(self.link, motion), (motion.w1, motion.w2)
        tau, stretch = self.joint_torque(basis, rates, command, time, delayed)
        return end_force(motion, *tau), stretch


def basis_at(link: TwoLink, motion: EndMotion) -> FloatArray:
    """The basis (6, ...) of the muscles' paths where the hand is."""
    s1, c1, s2, c2 = link.sines(motion)
    return np.stack([np.arctan2(s1, c1), s1, c1, np.arctan2(s2, c2), s2, c2])


class Motion(NamedTuple):
    """Hand position, velocity and acceleration, each component (...,)."""

    x: FloatArray
    y: FloatArray
    vx: FloatArray
    vy: FloatArray
    ax: FloatArray
    ay: FloatArray


def force_on_handle(
    arm: Arm,
    motion: Motion,
    command: MuscleCommand,
    time: FloatArray | float,
    delayed: FloatArray | float = 0.0,
) -> tuple[FloatArray, FloatArray]:
    """Force of the hand on what it holds, for a prescribed motion: inverse dynamics, no ODE.

    ``F = J^-T tau - (L a + b)``, each component (...,).
    """
    end = arm.link.end_motion(motion.x, motion.y, motion.vx, motion.vy)
    (fx, fy), _ = arm.muscle_force_at_hand(end, command, time, delayed)
    fx = fx - (end.Lxx * motion.ax + end.Lxy * motion.ay + end.bx)
    fy = fy - (end.Lxy * motion.ax + end.Lyy * motion.ay + end.by)
    return fx, fy


def muscle_stretch(
    arm: Arm, x: FloatArray, y: FloatArray, command: MuscleCommand, time: FloatArray
) -> FloatArray:
    """Stretch (6, ...) of the muscles with the hand at (x, y)."""
    still = np.zeros_like(x)
    length = arm.paths.length(basis_at(arm.link, arm.link.end_motion(x, y, still, still)))
    return length - command.virtual_length - command.virtual_velocity * time
