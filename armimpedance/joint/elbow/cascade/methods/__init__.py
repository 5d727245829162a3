"""The table of methods for two pathways: one file each in the folder `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.joint.elbow.cascade.task import CascadeMethod

#: The methods by their names.
CASCADE_METHODS: Final[MethodTable[CascadeMethod]] = MethodTable(
    "armimpedance.joint.elbow.cascade.methods", "METHOD", "method", default="cascade", joint="-"
)
