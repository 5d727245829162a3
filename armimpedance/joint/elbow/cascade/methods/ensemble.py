"""The method "ensemble": every instant by itself, over realizations."""

from __future__ import annotations

from functools import partial

from armimpedance.joint.elbow.cascade.fit import over_realizations
from armimpedance.joint.elbow.cascade.task import CascadeMethod

METHOD = CascadeMethod(
    "ensemble",
    "every instant by itself, over realizations",
    "MacNeil, Kearney, Hunter, IEEE TBME 39 (1992) 697-704",
    10,
    partial(over_realizations, segment_s=0.0),
)
