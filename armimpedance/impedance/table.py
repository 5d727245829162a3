"""The table of estimators for returning disturbances: one file each in `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.impedance.prepared import Method

METHODS: Final[MethodTable[Method]] = MethodTable(
    "armimpedance.impedance.methods", "METHOD", "method", default="weighted"
)
