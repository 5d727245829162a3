"""The table of the shapes of disturbances; the entries lie in the folder `shapes`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.hand.planning.profile import Shape

SHAPES: Final[MethodTable[Shape]] = MethodTable(
    "armimpedance.hand.planning.shapes", "SHAPE", "shape"
)
