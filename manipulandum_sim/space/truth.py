"""Truth of a spatial arm: the plant itself, differentiated numerically.

No mapping from joints to the hand is used. The force of the hand at a place, a velocity or an
acceleration comes from the plant's equations with the hand held there; a free elbow has come to
rest at that place, where its stiffness is asked for, and has not yet moved, where viscosity and
inertia are.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from manipulandum_sim.hand import STEP_M, STEP_RAD, STEP_RATE
from manipulandum_sim.space.plant import Plant
from manipulandum_sim.space.slow_motion import slow_motion, slowest_mode
from manipulandum_sim.truth_file import row_of, write_values

#: Newton's rounds and what they leave, m and N m.
ROUNDS: Final = 40
LEFT: Final = 1e-12


@dataclass(frozen=True)
class SpaceTruth(FrozenRecord):
    """Truth of every condition at its posture; C conditions, n joints of which r move, m muscles.

    Attributes
    ----------
    conditions : tuple of str
    elbow : str
    posture : (C, n) rad
    hand, force : (C, 3)
        Hand location (m) and force by the hand (N).
    tension : (C, m)
    M_e, B_e, K_e : (C, 3, 3)
        ``-dF/da`` and ``-dF/dv`` at once, ``-dF/dx`` at rest; the limb's own inertia.
    M_e_slow, B_e_slow : (C, 3, 3)
        Of a motion so slow that inner joints keep their balance (`slow_motion`); with as many
        joints as directions they are M_e and B_e.
    M_e_with_handle : (C, 3, 3)
    M_j, B_j, K_j : (C, n, n)
        Of all joints, by torques of the muscles and tissue alone.
    gravity_gradient : (C, n, n)
    jacobian : (C, 3, n)
    G : (C, m, n)
    swivel_hz, swivel_damping : (C,)
        Natural frequency and damping ratio of the slowest motion of the arm while the hand is held;
        0 where nothing moves.
    """

    conditions: Annotated[tuple[str, ...], "C"]
    elbow: str
    posture: Annotated[FloatArray, "C n"]
    hand: Annotated[FloatArray, "C 3"]
    force: Annotated[FloatArray, "C 3"]
    tension: Annotated[FloatArray, "C m"]
    M_e: Annotated[FloatArray, "C 3 3"]
    B_e: Annotated[FloatArray, "C 3 3"]
    K_e: Annotated[FloatArray, "C 3 3"]
    M_e_slow: Annotated[FloatArray, "C 3 3"]
    B_e_slow: Annotated[FloatArray, "C 3 3"]
    M_e_with_handle: Annotated[FloatArray, "C 3 3"]
    M_j: Annotated[FloatArray, "C n n"]
    B_j: Annotated[FloatArray, "C n n"]
    K_j: Annotated[FloatArray, "C n n"]
    gravity_gradient: Annotated[FloatArray, "C n n"]
    jacobian: Annotated[FloatArray, "C 3 n"]
    G: Annotated[FloatArray, "C m n"]
    swivel_hz: Annotated[FloatArray, "C"]
    swivel_damping: Annotated[FloatArray, "C"]

    def index(self, condition: str) -> int:
        """The row of a condition.

        Raises
        ------
        InputError
            If there is no such condition.
        """
        return row_of(condition, self.conditions)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON: every array row by row, one row per condition."""
        write_values({f.name: getattr(self, f.name) for f in fields(self)}, path, indent=1)


def find_space_truth(
    plants: Sequence[Plant],
    forces: FloatArray,
    names: Sequence[str],
    handle_mass_kg: float,
    elbow: str,
) -> SpaceTruth:
    """Differentiate every condition's plant at its posture.

    Parameters
    ----------
    plants : sequence of Plant
    forces : (C, 3)
        By the hand on what it holds, N.
    names : sequence of str
    handle_mass_kg : float
    elbow : str

    Returns
    -------
    SpaceTruth
    """
    rows = [_one(plant, force) for plant, force in zip(plants, forces, strict=True)]
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    with_handle = found["M_e"] + handle_mass_kg * np.eye(3)
    return SpaceTruth(tuple(names), elbow, force=forces, M_e_with_handle=with_handle, **found)


def _one(plant: Plant, force: FloatArray) -> dict[str, FloatArray]:
    q, still = plant.posture[None], np.zeros((1, len(plant.posture)))
    arm = plant.arm
    now = arm.dynamics(q, still)

    def torque(values: FloatArray) -> FloatArray:
        return plant.torque(values, np.zeros_like(values))

    def drag(rates: FloatArray) -> FloatArray:
        return plant.torque(np.repeat(q, len(rates), axis=0), rates)

    def weight(values: FloatArray) -> FloatArray:
        return arm.dynamics(values, np.zeros_like(values)).h

    zero, r = np.zeros((1, 3)), list(plant.moving)
    B_j = -_derivative(drag, still, STEP_RATE)[0]
    bent = -_derivative(lambda v: _resting(plant, v), q[:, r], STEP_RAD)[0]
    bent = bent + _turned_force(plant, q[:, r], force[None])[0]
    part = np.ix_(r, r)
    joints = (now.J[0][:, r], now.M[0][part], B_j[part], bent)
    slow, (hz, damping) = slow_motion(*joints), slowest_mode(*joints)
    return {
        "posture": plant.posture,
        "hand": now.place[0],
        "tension": plant.tension,
        "M_e": -_derivative(lambda a: hand_force(plant, a, "acceleration"), zero, STEP_RATE)[0],
        "B_e": -_derivative(lambda v: hand_force(plant, v, "velocity"), zero, STEP_RATE)[0],
        "K_e": -_derivative(lambda x: hand_force(plant, x, "place"), now.place, STEP_M)[0],
        "M_e_slow": slow[0],
        "B_e_slow": slow[1],
        "M_j": now.M[0],
        "B_j": B_j,
        "K_j": -_derivative(torque, q, STEP_RAD)[0],
        "gravity_gradient": _derivative(weight, q, STEP_RAD)[0],
        "jacobian": now.J[0],
        "G": _derivative(plant.muscles.length, q, STEP_RAD)[0],
        "swivel_hz": hz,
        "swivel_damping": damping,
    }


def hand_force(plant: Plant, values: FloatArray, what: str) -> FloatArray:
    """Force (N, 3) by the hand where its place, velocity or acceleration (N, 3) is imposed."""
    r = list(plant.moving)
    q = np.repeat(plant.posture[None][:, r], len(values), axis=0)
    qd, a = np.zeros_like(q), np.zeros_like(values)
    if what == "place":
        q = settled(plant, values)
    elif what == "acceleration":
        a = values
    else:
        qd = _carried_rates(plant, q, values)
    return _constrained(plant, q, qd, a)[1]


def _constrained(
    plant: Plant, q: FloatArray, qd: FloatArray, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Joint accelerations (N, r) and force (N, 3) by a hand whose acceleration (N, 3) is imposed.

    ``[M J^T; J 0] [qdd; F] = [tau - h; a - Jdot qd]``.
    """
    r = list(plant.moving)
    all_q, all_qd = plant.full(q), np.zeros((len(q), len(plant.posture)))
    all_qd[:, r] = qd
    now = plant.arm.dynamics(all_q, all_qd)
    push = (plant.torque(all_q, all_qd) - now.h)[:, r]
    solved = _held(now.M[:, r][:, :, r], now.J[:, :, r], push, a - now.drift)
    return solved[:, : len(r)], solved[:, len(r) :]


def _held(M: FloatArray, J: FloatArray, upper: FloatArray, lower: FloatArray) -> FloatArray:
    """Solve ``[M J^T; J 0] z = [upper; lower]`` for N systems."""
    N, k = M.shape[0], M.shape[1]
    whole = np.zeros((N, k + 3, k + 3))
    whole[:, :k, :k], whole[:, :k, k:], whole[:, k:, :k] = M, np.swapaxes(J, 1, 2), J
    right = np.concatenate([upper, lower], axis=1)
    return np.asarray(np.linalg.solve(whole, right[..., None])[..., 0])


def _carried_rates(plant: Plant, q: FloatArray, velocity: FloatArray) -> FloatArray:
    """Rates (N, r) that a blow to the hand leaves: of least kinetic energy at its velocity."""
    r = list(plant.moving)
    all_q = plant.full(q)
    now = plant.arm.dynamics(all_q, np.zeros_like(all_q))
    M, J = now.M[:, r][:, :, r], now.J[:, :, r]
    return _held(M, J, np.zeros_like(q), velocity)[:, : len(r)]


def settled(plant: Plant, place: FloatArray) -> FloatArray:
    """Angles (N, r) of the moving joints at rest with the hand at `place` (N, 3).

    Raises
    ------
    InputError
        The hand does not reach there.
    """
    r = list(plant.moving)
    q = np.repeat(plant.posture[None][:, r], len(place), axis=0)
    for _ in range(ROUNDS):
        full = plant.full(q)
        now = plant.arm.dynamics(full, np.zeros_like(full))
        J = now.J[:, :, r]
        swivel = np.linalg.svd(J)[2][:, 3:]  # (N, r - 3, r)
        push = _resting(plant, q)
        miss = place - now.place
        slope = _derivative(lambda values: _resting(plant, values), q, STEP_RAD)
        # the hand's place and the torque about the swivel: as many equations as joints
        force = (np.linalg.pinv(np.swapaxes(J, 1, 2)) @ push[..., None])[..., 0]
        slope = slope - _turned_force(plant, q, force)
        A = np.concatenate([J, swivel @ slope], axis=1)
        b = np.concatenate([miss, -(swivel @ push[..., None])[..., 0]], axis=1)
        q = q + np.linalg.solve(A, b[..., None])[..., 0]
        if max(np.abs(b[:, :3]).max(), np.abs(b[:, 3:]).max(initial=0.0)) < LEFT:
            return np.asarray(q)
    raise InputError("the hand does not come to rest there", expected="a place within reach")


def _resting(plant: Plant, q: FloatArray) -> FloatArray:
    """Torque (N, r) of muscles, tissue and weight at rest."""
    full = plant.full(q)
    still = np.zeros_like(full)
    h = plant.arm.dynamics(full, still).h
    return np.asarray((plant.torque(full, still) - h)[:, list(plant.moving)])


def _turned_force(plant: Plant, q: FloatArray, force: FloatArray) -> FloatArray:
    """``d(J^T F)/dq`` (N, r, r) for forces (N, 3) that stay."""

    def borne(values: FloatArray) -> FloatArray:
        full = plant.full(values)
        J = plant.arm.dynamics(full, np.zeros_like(full)).J[:, :, list(plant.moving)]
        return np.asarray(np.einsum("nkr,nk->nr", J, np.tile(force, (len(J) // len(force), 1))))

    return _derivative(borne, q, STEP_RAD)


def _derivative(
    function: Callable[[FloatArray], FloatArray], at: FloatArray, step: float
) -> FloatArray:
    """Five-point central differences (N, ..., k) of (N, k) -> (N, ...), all points in one call.

    A row of the function's values depends on that row of its arguments alone; it may have any
    number of rows.
    """
    N, k = at.shape
    # (4, k, N, k): steps, variables, rows
    away = np.array([1.0, -1.0, 2.0, -2.0])[:, None, None] * step * np.eye(k)
    values = function((at + away[:, :, None]).reshape(-1, k))
    near, back, far, beyond = values.reshape(4, k, N, *values.shape[1:])
    return np.moveaxis((8 * (near - back) - (far - beyond)) / (12 * step), 0, -1)
