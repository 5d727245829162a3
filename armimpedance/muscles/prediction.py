"""What a model says of joint impedance at a posture and an activation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.arrays import BoolArray, FloatArray, frozen_array
from armimpedance.errors import InputError
from armimpedance.muscles.rows import matrix
from armimpedance.regression import t_factor

#: Elements row by row (4,) from ``ss, se, ee`` (3,).
_UNFOLD = np.array([[1, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]], dtype=float)


class Predicted:
    """What predictions at the joints and at the hand share: two matrices and their errors."""

    stiffness: FloatArray
    viscosity: FloatArray
    stiffness_covariance: FloatArray
    viscosity_covariance: FloatArray
    dof: float

    @property
    def stiffness_matrices(self) -> FloatArray:
        """(P, 2, 2), Nm/rad or N/m."""
        return matrix(self.stiffness)

    @property
    def viscosity_matrices(self) -> FloatArray:
        """(P, 2, 2), Nms/rad or Ns/m."""
        return matrix(self.viscosity)

    def sd(self, which: str) -> FloatArray:
        """Standard errors (P, 3) of "stiffness" or "viscosity"."""
        return standard_errors(getattr(self, f"{which}_covariance"))

    def element_covariance(self, which: str) -> FloatArray:
        """Covariance (P, 4, 4) of the matrices' elements row by row."""
        return np.asarray(_UNFOLD @ getattr(self, f"{which}_covariance") @ _UNFOLD.T)

    def half_width(self, which: str, level: float = 0.95) -> FloatArray:
        """Half the length (P, 3) of the confidence intervals."""
        return t_factor(self.dof, level) * self.sd(which)


@dataclass(frozen=True)
class JointPrediction(Predicted):
    """Predicted joint stiffness and viscosity, with what is known of their errors.

    Attributes
    ----------
    joint_angles : (P, 2)
        rad.
    stiffness, viscosity : (P, 3)
        ``ss, se, ee`` (`muscles.joint_rows.triple`); symmetric by construction.
    stiffness_covariance, viscosity_covariance : (P, 3, 3)
        Of those, of the model's mean (not of a new measurement).
    dof : float
        Of the t distribution for intervals; inf = normal.
    extrapolated : (P,) bool
        Outside of what was measured.
    reasons : (P,) tuple of str
        Why; empty where it is inside.
    activation : (P, m) or None
    """

    joint_angles: FloatArray
    stiffness: FloatArray
    viscosity: FloatArray
    stiffness_covariance: FloatArray
    viscosity_covariance: FloatArray
    dof: float
    extrapolated: BoolArray
    reasons: tuple[str, ...]
    activation: FloatArray | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "joint_angles", frozen_array(self.joint_angles, "joint_angles", (None, 2)))
        p = len(self.joint_angles)
        for name in ("stiffness", "viscosity"):
            put(self, name, frozen_array(getattr(self, name), name, (p, 3)))
            covariance = f"{name}_covariance"
            put(self, covariance, frozen_array(getattr(self, covariance), covariance, (p, 3, 3)))
        put(self, "extrapolated", frozen_array(self.extrapolated, "extrapolated", (p,), np.bool_))
        put(self, "reasons", tuple(self.reasons))
        if self.activation is not None:
            put(self, "activation", frozen_array(self.activation, "activation", (p, None)))
        if len(self.reasons) != p:
            raise InputError(f"{len(self.reasons)} reasons for {p} predictions")


def standard_errors(covariance: FloatArray) -> FloatArray:
    """Roots of the diagonals (..., 3) of covariances (..., 3, 3)."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("...ii->...i", covariance), 0.0)))
