"""Table of estimators of a moving hand: one file each in `methods`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.hand.reaching.fitted import ReachMethod

METHODS: Final[MethodTable[ReachMethod]] = MethodTable(
    "armimpedance.hand.reaching.methods", "METHOD", "method", default="latent"
)
