"""The weighted fit among the parameters that some distribution of mass could have.

The prior only chooses among what the motion cannot show.
"""

from __future__ import annotations

from armimpedance.joint.body.estimate import consistent_solution
from armimpedance.joint.body.methods import BodyMethod

METHOD = BodyMethod(
    "consistent",
    "every segment is a body with mass",
    "levels",
    consistent_solution,
)
