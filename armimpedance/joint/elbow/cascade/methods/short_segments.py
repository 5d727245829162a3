"""The method "short-segments": segments of 0.1 s, over realizations."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.cascade.fit import over_realizations
from armimpedance.joint.elbow.cascade.task import CascadeMethod

METHOD = CascadeMethod(
    "short-segments",
    "segments of 0.1 s, over realizations",
    "D. Ludvig, E. J. Perreault, IEEE TBME 59 (2012) 3541-3549",
    10,
    partial(over_realizations, segment_s=0.1),
)
