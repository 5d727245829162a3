"""The weighted fit among the parameters that some distribution of mass could have.

The prior only chooses among what the motion cannot show.
"""

from __future__ import annotations

from armimpedance.joint.body.methods import Method
from armimpedance.joint.body.solution import consistent_solution

METHOD = Method(
    "consistent",
    "every segment is a body with mass",
    "levels",
    consistent_solution,
)
