"""Predictions of a model at a posture and an activation, at the joints and at the hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Final

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES, element_names
from armimpedance.core.errors import InputError, NotIdentifiableError
from armimpedance.limb.arm import Arm
from armimpedance.muscles.models.packed import (
    congruence,
    kept_elements,
    matrix,
    order_of,
    triple,
    unpacked,
)
from armimpedance.muscles.models.workspace import angle_columns
from armimpedance.numerics.regression import t_factor

if TYPE_CHECKING:
    import pandas as pd

#: Predictions that a short text shows.
_MOST_SHOWN: Final = 9


class Predicted(FrozenRecord):
    """Common parts of predictions at the joints and at the hand: two matrices and errors."""

    stiffness: FloatArray
    viscosity: FloatArray
    stiffness_covariance: FloatArray
    viscosity_covariance: FloatArray
    dof: float

    @property
    def stiffness_matrices(self) -> FloatArray:
        """(P, n, n), N m/rad or N/m."""
        return matrix(self.stiffness)

    @property
    def viscosity_matrices(self) -> FloatArray:
        """(P, n, n), N m s/rad or N s/m."""
        return matrix(self.viscosity)

    @property
    def place(self) -> list[dict[str, Any]]:
        """Where each prediction stands: level, posture and activation, by their columns' names."""
        raise NotImplementedError

    @property
    def flags(self) -> list[dict[str, Any]]:
        """Flags of each prediction: extrapolated (0 or 1), and the reason."""
        raise NotImplementedError

    def matrix_rows(self, symbol: str) -> list[dict[str, float]]:
        """Elements ``K_ij`` (or B) with ``sd_``, ``ci_low_`` and ``ci_high_``, a mapping a row."""
        which = "stiffness" if symbol == "K" else "viscosity"
        matrices = matrix(getattr(self, which))
        n = matrices.shape[-1]
        values = matrices.reshape(-1, n * n)
        variance = np.einsum("pii->pi", self.element_covariance(which))
        sd = np.sqrt(np.maximum(variance, 0.0))
        half = t_factor(self.dof) * sd
        tables = {"": values, "sd_": sd, "ci_low_": values - half, "ci_high_": values + half}
        names = [prefix + name for prefix in tables for name in element_names(symbol, n)]
        return [named_numbers(names, row) for row in np.hstack(list(tables.values()))]

    def to_frame(self) -> pd.DataFrame:
        """One row a prediction: posture, K and B with 95 % limits, what is extrapolated."""
        import pandas as pd

        parts = (self.place, self.matrix_rows("K"), self.matrix_rows("B"), self.flags)
        return pd.DataFrame([a | b | c | d for a, b, c, d in zip(*parts, strict=True)])

    def to_dict(self) -> list[dict[str, Any]]:
        """The rows of `to_frame` as mappings of plain numbers and texts."""
        return self.to_frame().to_dict("records")  # type: ignore[return-value]

    def _head(self) -> str:
        outside = sum(flag["extrapolated"] for flag in self.flags)
        return f"{len(self.stiffness)} predictions, {outside} of them extrapolated"

    def __repr__(self) -> str:
        lines = [
            f"{', '.join(f'{n} {v:.3g}' for n, v in list(place.items())[1:3])}: "
            f"K {', '.join(f'{k:.4g} ± {h:.2g}' for k, h in zip(K, half, strict=True))}"
            for place, K, half, _ in zip(
                self.place,
                self.stiffness,
                self.half_width("stiffness"),
                range(_MOST_SHOWN),
                strict=False,
            )
        ]
        more = ["..."] if len(self.stiffness) > _MOST_SHOWN else []
        return "\n".join([self._head(), *lines, *more])

    def _repr_html_(self) -> str:
        table = self.to_frame().to_html(max_rows=_MOST_SHOWN, float_format="{:.4g}".format)
        return f"<p>{self._head()}</p>{table}"

    def sd(self, which: str) -> FloatArray:
        """Standard errors (P, E) of "stiffness" or "viscosity"."""
        return standard_errors(getattr(self, f"{which}_covariance"))

    def element_covariance(self, which: str) -> FloatArray:
        """Covariance (P, n n, n n) of the matrices' elements row by row."""
        covariance = getattr(self, f"{which}_covariance")
        E = covariance.shape[-1]
        # elements row by row (n n,) from packed ones (E,)
        unfold = unpacked(np.eye(E), order_of(E)).reshape(E, -1).T
        return np.asarray(unfold @ covariance @ unfold.T)

    def half_width(self, which: str, level: float = 0.95) -> FloatArray:
        """Half the length (P, E) of the confidence intervals."""
        return t_factor(self.dof, level) * self.sd(which)


@dataclass(frozen=True, repr=False)
class JointPrediction(Predicted):
    """Predicted joint stiffness and viscosity with their errors.

    Attributes
    ----------
    joint_angles : (P, n)
        rad.
    stiffness, viscosity : (P, E)
        ``ss, se, ee`` (`rows.triple`); symmetric by construction.
    stiffness_covariance, viscosity_covariance : (P, E, E)
        Covariance of the predicted elements: of the model's mean, not of a new measurement.
    dof : float
        Degrees of freedom of the t distribution for intervals; inf = normal.
    extrapolated : (P,) bool
        Whether it lies outside of what was measured.
    reasons : (P,) tuple of str
        Why it does; empty where it lies inside.
    activation : (P, m) or None
        Activation of each muscle, 0..1.

    Examples
    --------
    >>> import armimpedance as ai
    >>> known = [[[0.0] * 3] * 3]
    >>> joint = ai.JointPrediction(
    ...     [[1.0, 1.5]], [[15.0, 6.0, 16.0]], [[1.0, 0.4, 1.0]], known, known, 10.0, [False], [""]
    ... )
    >>> float(joint.to_frame()["K_12"][0])
    6.0
    """

    joint_angles: Annotated[FloatArray, "p n"]
    stiffness: Annotated[FloatArray, "p e"]
    viscosity: Annotated[FloatArray, "p e"]
    stiffness_covariance: Annotated[FloatArray, "p e e"]
    viscosity_covariance: Annotated[FloatArray, "p e e"]
    dof: float
    extrapolated: Annotated[BoolArray, "p"]
    reasons: Annotated[tuple[str, ...], "p"]
    activation: Annotated[FloatArray, "p _"] | None = None

    @property
    def place(self) -> list[dict[str, Any]]:
        """Level, joint angles and activations of each prediction, by their columns' names."""
        columns = angle_columns(self.joint_angles.shape[1])
        rows = [{"level": "joint", **named_numbers(columns, q)} for q in self.joint_angles]
        if self.activation is None:
            return rows
        muscles = [f"alpha_{i}" for i in range(1, self.activation.shape[1] + 1)]
        return [
            row | named_numbers(muscles, alpha)
            for row, alpha in zip(rows, self.activation, strict=True)
        ]

    @property
    def flags(self) -> list[dict[str, Any]]:
        """Flags of each prediction: extrapolated (0 or 1), and the reason."""
        return [
            {"extrapolated": int(outside), "reason": reason}
            for outside, reason in zip(self.extrapolated, self.reasons, strict=True)
        ]


def named_numbers(names: Sequence[str], values: FloatArray) -> dict[str, float]:
    """Numbers under their columns' names."""
    return dict(zip(names, map(float, values), strict=True))


def standard_errors(covariance: FloatArray) -> FloatArray:
    """Roots of the diagonals (..., E) of covariances (..., E, E)."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("...ii->...i", covariance), 0.0)))


# A predicted joint impedance as the hand's, at postures where nobody measured.

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
        """Flags of each prediction: extrapolated (0 or 1), and the reason."""
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
