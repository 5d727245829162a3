"""The method "cascade-jumps": constant between jumps."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.cascade.fit import in_rounds
from armimpedance.joint.elbow.cascade.task import CascadeMethod

METHOD = CascadeMethod(
    "cascade-jumps",
    "constant between jumps",
    "R. E. Kearney, R. B. Stein, L. Parameswaran, IEEE TBME 44 (1997) 493-504",
    1,
    partial(in_rounds, prior="jumps"),
)
