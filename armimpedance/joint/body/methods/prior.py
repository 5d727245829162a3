"""The weighted fit among possible parameters, near the masses and inertias that are expected."""

from __future__ import annotations

from armimpedance.joint.body.estimate import prior_solution
from armimpedance.joint.body.methods import BodyMethod

METHOD = BodyMethod(
    "prior",
    "the segments' masses are known to some per cent",
    "levels",
    prior_solution,
)
