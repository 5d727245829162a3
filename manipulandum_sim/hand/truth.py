"""Truth of a simulated subject: the plant itself, differentiated numerically.

Nothing here maps one level to another by a formula: hand and joint matrices come from separate
differences of the plant's force and torque, so that the analysis's mappings can be judged by them.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from manipulandum_sim.hand.arm_plant import (
    Arm,
    Motion,
    MuscleCommand,
    force_on_handle,
    muscle_stretch,
)
from manipulandum_sim.hand.equilibrium import muscle_command, solve_activation
from manipulandum_sim.hand.experiments import Condition
from manipulandum_sim.hand.muscles import joint_basis
from manipulandum_sim.truth_file import reading_values, row_of, write_values

#: Steps of the differences: the error of the five-point formula is below 1e-9 of the result.
STEP_M: Final = 5e-4
STEP_RAD: Final = 2e-3
STEP_RATE: Final = 1e-2

Field = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Truth(FrozenRecord):
    """Truth of every condition at its posture, with no drift; C conditions.

    Attributes
    ----------
    conditions : tuple of str
    posture : (C, 2) rad
    hand, force : (C, 2)
        Hand location (m) and force by the hand on the handle (N).
    activation, tension, muscle_stiffness, muscle_viscosity : (C, 6)
    M_e, B_e, K_e : (C, 2, 2)
        Impedance at the hand, ``-dF/da``, ``-dF/dv``, ``-dF/dx``; the limb's own inertia.
    M_e_with_handle : (C, 2, 2)
        Inertia with the mass between sensor and hand.
    M_j, B_j, K_j : (C, 2, 2)
        Impedance at the joints: derivatives of torques over accelerations, rates and angles.
    G : (C, 6, 2)
        Moment arms dL/dq.
    curvature : (C, 6, 2, 2)
        d2L/dq2.
    K_e_reflex : (C, 2, 2)
        What the delayed reflex adds to K_e once it has answered.
    reflex_delay_s : float
        0 without reflex.
    """

    conditions: Annotated[tuple[str, ...], "C"]
    posture: Annotated[FloatArray, "C 2"]
    hand: Annotated[FloatArray, "C 2"]
    force: Annotated[FloatArray, "C 2"]
    activation: Annotated[FloatArray, "C m"]
    tension: Annotated[FloatArray, "C m"]
    muscle_stiffness: Annotated[FloatArray, "C m"]
    muscle_viscosity: Annotated[FloatArray, "C m"]
    M_e: Annotated[FloatArray, "C 2 2"]
    B_e: Annotated[FloatArray, "C 2 2"]
    K_e: Annotated[FloatArray, "C 2 2"]
    M_e_with_handle: Annotated[FloatArray, "C 2 2"]
    M_j: Annotated[FloatArray, "C 2 2"]
    B_j: Annotated[FloatArray, "C 2 2"]
    K_j: Annotated[FloatArray, "C 2 2"]
    G: Annotated[FloatArray, "C m 2"]
    curvature: Annotated[FloatArray, "C m 2 2"]
    K_e_reflex: Annotated[FloatArray, "C 2 2"]
    reflex_delay_s: float = 0.0

    def index(self, condition: str) -> int:
        """The row of a condition.

        Raises
        ------
        InputError
            If there is no such condition.
        """
        return row_of(condition, self.conditions)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON (``truth.json``): every array row by row, one row per condition.

        A file of that name is replaced at once or not at all.
        """
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        write_values(values, path, indent=1)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Truth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not a truth.
        """
        with reading_values(path, "a truth") as plain:
            values: dict[str, Any] = {
                k: np.array(v) if isinstance(v, list) and k != "conditions" else v
                for k, v in plain.items()
            }
            return cls(**values)


def derivative(function: Field, at: FloatArray, step: float) -> FloatArray:
    """Five-point central differences of a batch of functions of k variables.

    Parameters
    ----------
    function : (C, k) -> (C, ...)
    at : (C, k)
    step : float

    Returns
    -------
    (C, ..., k) : the last axis is the variable.
    """
    columns = []
    for unit in np.eye(at.shape[1]):
        near = function(at + step * unit) - function(at - step * unit)
        far = function(at + 2 * step * unit) - function(at - 2 * step * unit)
        columns.append((8 * near - far) / (12 * step))
    return np.stack(columns, axis=-1)


def _hand_field(arm: Arm, command: MuscleCommand, hand: FloatArray, what: str) -> Field:
    """Force by the hand (C, 2) as a function of its position, velocity or acceleration (C, 2)."""

    def force(values: FloatArray) -> FloatArray:
        still = np.zeros_like(hand)
        x = values if what == "position" else hand
        v = values if what == "velocity" else still
        a = values if what == "acceleration" else still
        motion = Motion(*x.T, *v.T, *a.T)
        return np.stack(force_on_handle(arm, motion, command, 0.0), axis=-1)

    return force


def _reflex_field(arm: Arm, command: MuscleCommand, hand: FloatArray) -> Field:
    """Force (C, 2) of the arm held at `hand` as a function of where it was a delay ago."""

    def force(past: FloatArray) -> FloatArray:
        still = np.zeros_like(hand)
        stretch = muscle_stretch(arm, past[:, 0], past[:, 1], command, np.zeros(len(hand)))
        motion = Motion(*hand.T, *still.T, *still.T)
        return np.stack(force_on_handle(arm, motion, command, 0.0, stretch), axis=-1)

    return force


def _joint_field(arm: Arm, command: MuscleCommand, q: FloatArray, what: str) -> Field:
    """Torque (C, 2) of muscles and passive joints as a function of angles or rates (C, 2)."""

    def torque(values: FloatArray) -> FloatArray:
        angles = values if what == "angle" else q
        rates = values if what == "rate" else np.zeros_like(q)
        basis = joint_basis(angles[:, 0], angles[:, 1])
        tau, _ = arm.joint_torque(basis, (rates[:, 0], rates[:, 1]), command, 0.0)
        return np.stack(tau, axis=-1)

    return torque


def _inertial_field(arm: Arm, q: FloatArray) -> Field:
    """Torque (C, 2) that accelerates the arm from rest as a function of the acceleration (C, 2)."""

    def torque(acceleration: FloatArray) -> FloatArray:
        still = np.zeros(len(q))
        m = arm.link.end_motion(*arm.link.end_position(*q.T), still, still)
        a1, a2 = acceleration.T
        # a = J qddot; F = L a; tau = J^T F
        ax, ay = -m.ry * a1 - m.uy * a2, m.rx * a1 + m.ux * a2
        fx, fy = m.Lxx * ax + m.Lxy * ay, m.Lxy * ax + m.Lyy * ay
        return np.stack([m.rx * fy - m.ry * fx, m.ux * fy - m.uy * fx], axis=-1)

    return torque


def _moment_arms(arm: Arm, q: FloatArray) -> FloatArray:
    """dL/dq (C, 6, 2) at joint angles (C, 2)."""
    return derivative(lambda p: arm.paths.length(joint_basis(p[:, 0], p[:, 1])).T, q, STEP_RAD)


def joint_angles(arm: Arm, hand: FloatArray) -> FloatArray:
    """Joint angles at hand locations.

    Parameters
    ----------
    arm : Arm
    hand : (..., 2)
        m, from the shoulder.

    Returns
    -------
    (..., 2)
        Shoulder and elbow, rad.

    Raises
    ------
    InputError
        If a location is out of reach.
    """
    x, y = hand[..., 0], hand[..., 1]
    if not arm.link.reaches(x, y):
        raise InputError("a hand location is out of the arm's reach")
    m = arm.link.end_motion(x, y, np.zeros_like(x), np.zeros_like(x))
    return np.stack(arm.link.angles(m), axis=-1)


def find_truth(
    arm: Arm,
    conditions: Sequence[Condition],
    *,
    handle_mass_kg: float,
    reflex: tuple[float, float] = (0.0, 0.0),
) -> Truth:
    """Solve every condition's activations and differentiate the plant there.

    Parameters
    ----------
    arm : Arm
    conditions : sequence of Condition
    handle_mass_kg : float
    reflex : tuple of float
        Gain and delay (s) of a stretch reflex.

    Returns
    -------
    Truth

    Raises
    ------
    InputError
        If a location is out of reach or a force beyond the subject's strength.
    """
    hand = np.array([c.hand for c in conditions], dtype=float)
    force = np.array([c.force for c in conditions], dtype=float)
    q = joint_angles(arm, hand)
    asked = zip(q, force, [c.cocontraction for c in conditions], strict=True)
    activation = np.array([solve_activation(arm, *each) for each in asked])
    command = muscle_command(arm, q, activation, reflex_gain=reflex[0])

    def at_hand(what: str, step: float) -> FloatArray:
        origin = hand if what == "position" else np.zeros_like(hand)
        return -derivative(_hand_field(arm, command, hand, what), origin, step)

    inertia, still = at_hand("acceleration", STEP_RATE), np.zeros_like(q)
    return Truth(
        tuple(c.name for c in conditions),
        posture=q,
        hand=hand,
        force=force,
        activation=activation,
        tension=arm.mechanics.tension(activation),
        muscle_stiffness=arm.mechanics.stiffness(activation),
        muscle_viscosity=arm.mechanics.viscosity(activation),
        M_e=inertia,
        B_e=at_hand("velocity", STEP_RATE),
        K_e=at_hand("position", STEP_M),
        M_e_with_handle=inertia + handle_mass_kg * np.eye(2),
        M_j=derivative(_inertial_field(arm, q), still, STEP_RATE),
        B_j=-derivative(_joint_field(arm, command, q, "rate"), still, STEP_RATE),
        K_j=-derivative(_joint_field(arm, command, q, "angle"), q, STEP_RAD),
        G=_moment_arms(arm, q),
        curvature=derivative(lambda p: _moment_arms(arm, p), q, STEP_RAD),
        K_e_reflex=-derivative(_reflex_field(arm, command, hand), hand, STEP_M),
        reflex_delay_s=reflex[1],
    )
