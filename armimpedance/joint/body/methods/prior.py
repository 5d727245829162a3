"""The weighted fit among possible parameters, near the masses and inertias that are expected."""

from __future__ import annotations

from armimpedance.joint.body.methods import Method
from armimpedance.joint.body.solution import prior_solution

METHOD = Method(
    "prior",
    "the segments' masses are known to some per cent",
    "levels",
    prior_solution,
)
