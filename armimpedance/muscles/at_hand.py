"""A predicted joint impedance as the hand's, at postures where nobody measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.arm import TwoLinkArm
from armimpedance.arrays import FloatArray
from armimpedance.errors import InputError, NotIdentifiableError
from armimpedance.muscles.packed import congruence
from armimpedance.muscles.prediction import JointPrediction, Predicted, named_numbers
from armimpedance.muscles.rows import triple

#: A posture with a worse condition of the Jacobian is singular: the arm is stretched.
_SINGULAR = 1e8


@dataclass(frozen=True, repr=False)
class HandPrediction(Predicted):
    """Predicted stiffness and viscosity of the hand.

    Attributes
    ----------
    hand_position : (P, 2)
        Position of the hand from the shoulder, m.
    stiffness, viscosity : (P, 3)
        ``xx, xy, yy``, N/m and N s/m.
    stiffness_covariance, viscosity_covariance : (P, 3, 3)
    dof : float
    joint : JointPrediction
        The prediction at the joints that it follows from.
    """

    hand_position: Annotated[FloatArray, "p 2"]
    stiffness: Annotated[FloatArray, "p 3"]
    viscosity: Annotated[FloatArray, "p 3"]
    stiffness_covariance: Annotated[FloatArray, "p 3 3"]
    viscosity_covariance: Annotated[FloatArray, "p 3 3"]
    dof: float
    joint: JointPrediction

    @property
    def place(self) -> list[dict[str, Any]]:
        """Level, joint angles, hand position and activations, by their columns' names."""
        rows = []
        for joint, hand in zip(self.joint.place, self.hand_position, strict=True):
            angles = {name: joint.pop(name) for name in ("q_shoulder_rad", "q_elbow_rad")}
            at = named_numbers(("hand_x_m", "hand_y_m"), hand)
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
    prediction: JointPrediction, arm: TwoLinkArm, force: ArrayLike | None = None
) -> HandPrediction:
    """``K_e = J^-T (K_j + Gamma(F) + dg/dq) J^-1``, ``B_e = J^-T B_j J^-1`` at each posture.

    Parameters
    ----------
    prediction : JointPrediction
    arm : TwoLinkArm
    force : (2,) or (P, 2), optional
        Force by the hand on the environment, N; none: no force.

    Returns
    -------
    HandPrediction

    Raises
    ------
    NotIdentifiableError
        A posture is singular.
    InputError
        More than two joints, or the force has another shape.
    """
    q = prediction.joint_angles
    if q.shape[1] != 2:
        raise InputError(
            f"a prediction of {q.shape[1]} joints", expected="two; of more, `Live` says the hand's"
        )
    J = arm.jacobian(q)
    if (np.linalg.cond(J) > _SINGULAR).any():
        row = int(np.argmax(np.linalg.cond(J)))
        raise NotIdentifiableError(
            f"posture {row + 1}: the arm is stretched, its joints do not set the hand's stiffness"
        )
    F = np.zeros((len(q), 2)) if force is None else np.asarray(force, dtype=float)
    if F.shape not in ((2,), (len(q), 2)):
        raise InputError(f"hand force of shape {F.shape}", expected=f"(2,) or ({len(q)}, 2)")
    derivative = arm.jacobian_derivative(q)
    gamma = np.einsum("pk,pkij->pij", np.broadcast_to(F, (len(q), 2)), derivative)
    T = congruence(np.asarray(np.linalg.inv(J), dtype=float))
    joint_K = prediction.stiffness + triple(gamma + arm.gravity_gradient(q))

    def moved(triples: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("pij,pj->pi", T, triples))

    def spread(covariance: FloatArray) -> FloatArray:
        return np.asarray(T @ covariance @ T.transpose(0, 2, 1))

    return HandPrediction(
        hand_position=arm.hand_position(q),
        stiffness=moved(joint_K),
        viscosity=moved(prediction.viscosity),
        stiffness_covariance=spread(prediction.stiffness_covariance),
        viscosity_covariance=spread(prediction.viscosity_covariance),
        dof=prediction.dof,
        joint=prediction,
    )
