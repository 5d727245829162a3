"""The weighted fit among possible parameters, near the masses and inertias that are expected."""

from __future__ import annotations

from functools import partial

from armimpedance.body.method import Method
from armimpedance.body.solution import consistent_solution

METHOD = Method(
    "prior",
    "the segments' masses are known to some per cent",
    "levels",
    partial(consistent_solution, trusted=True),
)
