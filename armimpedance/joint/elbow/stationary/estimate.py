"""What every stationary method returns: I, B, K of one joint, all positive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.joint.elbow.result import NAMES
from armimpedance.joint.elbow.stationary.rows import Solved


@dataclass(frozen=True, eq=False)
class Estimate(Solved):
    """I, B, K of one method.

    Attributes
    ----------
    parameters, n, conditioning, moved
        As of `rows.Solved`; the parameters are I, B and K.
    details : mapping
    warnings, notes : tuple of str
        What a reader must know, and what the intervals allow for already.

    Raises
    ------
    EstimationError
        One of the three is not positive.
    """

    details: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        values = self.parameters.values
        if not (values > 0).all():
            shown = ", ".join(f"{n} {v:.3g}" for n, v in zip(NAMES, values, strict=True))
            raise EstimationError(
                f"{shown}: a joint has positive ones; does the torque have the wrong sign "
                "(force_by), or does the joint not move?"
            )

    def widened(
        self,
        by: FloatArray,
        warnings: tuple[str, ...] = (),
        notes: tuple[str, ...] = (),
        **details: Any,
    ) -> Estimate:
        """The same, more uncertain by what is known to be off; further sentences and details."""
        # What may be off by d (3,) is uncertain by it: C (3, 3) + d d^T
        covariance = self.parameters.covariance + np.outer(by, by)
        return replace(
            self,
            parameters=replace(self.parameters, covariance=covariance),
            warnings=(*self.warnings, *warnings),
            notes=(*self.notes, *notes),
            details={**self.details, **details},
            moved=None,
        )


def estimate_of(solved: Solved, **details: Any) -> Estimate:
    """Where the parameters that were solved for are I, B, K themselves.

    Raises
    ------
    EstimationError
        One is not positive.
    """
    return Estimate(solved.parameters, solved.n, solved.conditioning, solved.moved, details)
