"""Table of estimators for returning disturbances: one file each in `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.hand.still.prepared import Method

METHODS: Final[MethodTable[Method]] = MethodTable(
    "armimpedance.hand.still.methods", "METHOD", "method", default="weighted"
)
