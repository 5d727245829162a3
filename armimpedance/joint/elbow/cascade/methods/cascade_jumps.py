"""The method "cascade-jumps": constant between jumps."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.cascade.method import CascadeMethod
from armimpedance.joint.elbow.cascade.rounds import in_rounds

METHOD = CascadeMethod(
    "cascade-jumps",
    "constant between jumps",
    "R. E. Kearney, R. B. Stein, L. Parameswaran, IEEE TBME 44 (1997) 493-504",
    1,
    partial(in_rounds, prior="jumps"),
)
