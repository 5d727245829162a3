"""The table of stationary methods: one file each in the folder `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.joint.elbow.stationary.method import ElbowMethod

#: The methods by their names.
METHODS: Final[MethodTable[ElbowMethod]] = MethodTable(
    "armimpedance.joint.elbow.stationary.methods", "METHOD", "method", default="iv", joint="-"
)
