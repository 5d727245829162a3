"""A predicted joint impedance as the hand's, at postures where nobody measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm import Arm
from armimpedance.muscles.models.angle_scaling import angle_columns
from armimpedance.muscles.models.packed import congruence, kept_elements, triple, unpacked
from armimpedance.muscles.models.prediction import JointPrediction, Predicted, named_numbers

#: A posture with a worse condition of the Jacobian is singular: the arm is stretched.
_SINGULAR = 1e8
#: N m s/rad: rounding of a viscosity that a model does not know.
_NO_VISCOSITY = 1e-9


@dataclass(frozen=True, repr=False)
class HandPrediction(Predicted):
    """Predicted stiffness and viscosity of the hand.

    Attributes
    ----------
    hand_position : (P, d)
        Position of the hand from the shoulder, m.
    stiffness, viscosity : (P, E)
        ``xx, xy, yy``, in space ``xx, xy, xz, yy, yz, zz``, N/m and N s/m.
    stiffness_covariance, viscosity_covariance : (P, E, E)
    dof : float
    joint : JointPrediction
        The prediction at the joints that it follows from.
    """

    hand_position: Annotated[FloatArray, "p d"]
    stiffness: Annotated[FloatArray, "p e"]
    viscosity: Annotated[FloatArray, "p e"]
    stiffness_covariance: Annotated[FloatArray, "p e e"]
    viscosity_covariance: Annotated[FloatArray, "p e e"]
    dof: float
    joint: JointPrediction

    @property
    def place(self) -> list[dict[str, Any]]:
        """Level, joint angles, hand position and activations, by their columns' names."""
        rows = []
        columns = angle_columns(self.joint.joint_angles.shape[1])
        hands = [f"hand_{axis}_m" for axis in AXES[: self.hand_position.shape[1]]]
        for joint, hand in zip(self.joint.place, self.hand_position, strict=True):
            angles = {name: joint.pop(name) for name in columns}
            at = named_numbers(hands, hand)
            del joint["level"]
            rows.append({"level": "hand", **angles, **at, **joint})
        return rows

    @property
    def flags(self) -> list[dict[str, Any]]:
        """Whether each prediction is extrapolated (0 or 1), and the reason."""
        return self.joint.flags

    @property
    def reference_angle_rad(self) -> FloatArray:
        """Direction (P,) of the line shoulder -> hand."""
        return np.asarray(np.arctan2(self.hand_position[:, 1], self.hand_position[:, 0]))


def at_hand(
    prediction: JointPrediction,
    arm: Arm,
    force: ArrayLike | None = None,
    *,
    moving: tuple[int, ...] | None = None,
) -> HandPrediction:
    """``K_e = (J (K_j + Gamma(F) + dg/dq)^-1 J^T)^-1`` at each posture: compliances add.

    For as many joints as axes it is ``J^-T (K_j + Gamma(F) + dg/dq) J^-1``, ``B_e = J^-T B_j
    J^-1``. Of more joints the viscosity is that of the viscous joints alone, as in
    `hand.levels.to_hand`.

    Parameters
    ----------
    prediction : JointPrediction
    arm : Arm
    force : (d,) or (P, d), optional
        Force by the hand on the environment, N; none: no force.
    moving : tuple of int, optional
        Joints that move, from 0; the others are held. Default: all.

    Returns
    -------
    HandPrediction

    Raises
    ------
    NotIdentifiableError
        A posture is singular.
    InputError
        Another number of joints than the arm's, or the force has another shape.
    """
    q, n = prediction.joint_angles, arm.joints
    if q.shape[1] != n:
        raise InputError(f"a prediction of {q.shape[1]} joints", expected=f"{n}, as the arm")
    free = tuple(range(n)) if moving is None else moving
    J = np.array([arm.jacobian(x) for x in q])[:, :, free]
    if (np.linalg.cond(J) > _SINGULAR).any():
        row = int(np.argmax(np.linalg.cond(J)))
        raise NotIdentifiableError(
            f"posture {row + 1}: the arm is stretched, its joints do not set the hand's stiffness"
        )
    F = np.zeros((len(q), arm.axes)) if force is None else np.asarray(force, dtype=float)
    if F.shape not in ((arm.axes,), (len(q), arm.axes)):
        wanted = f"({arm.axes},) or ({len(q)}, {arm.axes})"
        raise InputError(f"hand force of shape {F.shape}", expected=wanted)
    bend = np.array([arm.jacobian_derivative(x) for x in q])
    gamma = np.einsum("pk,pkij->pij", np.broadcast_to(F, (len(q), arm.axes)), bend)
    added = triple(gamma + np.array([arm.gravity_gradient(x) for x in q]))
    kept = kept_elements(n, free)
    K, B = (prediction.stiffness + added)[:, kept], prediction.viscosity[:, kept]

    def moved(which: str, loaded: FloatArray) -> tuple[FloatArray, FloatArray]:
        # a model of hands with a free elbow knows no viscosity: 0, with what the prior leaves open
        least = np.linalg.eigvalsh(unpacked(loaded, len(free)))[:, :1]
        T = congruence(hand_motion(J, np.where(np.abs(least) > _NO_VISCOSITY, loaded, K)))
        covariance = getattr(prediction, f"{which}_covariance")[:, kept][:, :, kept]
        return np.einsum("pij,pj->pi", T, loaded), T @ covariance @ T.transpose(0, 2, 1)

    stiffness, stiffness_covariance = moved("stiffness", K)
    viscosity, viscosity_covariance = moved("viscosity", B)
    return HandPrediction(
        hand_position=np.array([arm.hand_position(x) for x in q]),
        stiffness=stiffness,
        viscosity=viscosity,
        stiffness_covariance=stiffness_covariance,
        viscosity_covariance=viscosity_covariance,
        dof=prediction.dof,
        joint=prediction,
    )


def hand_motion(J: FloatArray, joint: FloatArray) -> FloatArray:
    """The joints' motion V under a unit of the hand's: ``V = A^-1 J^T (J A^-1 J^T)^-1``.

    A square J sets it whatever A is.

    Parameters
    ----------
    J : (P, d, r)
    joint : (P, E)
        Packed joint matrices A.

    Returns
    -------
    (P, r, d)
    """
    d, r = J.shape[1:]
    if d == r:
        return np.asarray(np.linalg.inv(J), dtype=float)
    yielding = np.linalg.solve(unpacked(joint, r), J.transpose(0, 2, 1))
    return np.asarray(yielding @ np.linalg.inv(J @ yielding))
