"""The method "cascade": smooth courses or courses that jump, as the record asks."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.cascade.fit import in_rounds
from armimpedance.joint.elbow.cascade.task import CascadeMethod

METHOD = CascadeMethod(
    "cascade",
    "smooth courses or courses that jump, as the record asks",
    "R. E. Kearney, R. B. Stein, L. Parameswaran, IEEE TBME 44 (1997) 493-504",
    1,
    partial(in_rounds, prior=None),
)
