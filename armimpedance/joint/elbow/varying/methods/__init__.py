"""The table of time-varying methods: one file each in the folder `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.joint.elbow.varying.method import VaryingMethod

#: The methods by their names.
VARYING_METHODS: Final[MethodTable[VaryingMethod]] = MethodTable(
    "armimpedance.joint.elbow.varying.methods", "METHOD", "method", default="smoother", joint="-"
)
