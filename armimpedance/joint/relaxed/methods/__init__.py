"""What an estimator of passive joints is, and the table of those that there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import MethodTable

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.equations import Equations, Terms
    from armimpedance.joint.relaxed.linear import TwoFits
    from armimpedance.joint.relaxed.samples import PassiveSamples


@dataclass(frozen=True)
class PassiveMethod:
    """An estimator.

    `assumes`: what must hold for the estimate to be right, in one sentence.
    `equations`: the torque equations of a single joint that its validation uses.
    `solve`: the estimate of a single joint.
    """

    assumes: str
    reference: str
    equations: Callable[[PassiveSamples, Terms], Equations]
    solve: Callable[[PassiveSamples, Terms], TwoFits]


METHODS: Final = MethodTable[PassiveMethod](
    "armimpedance.joint.relaxed.methods", "METHOD", "method", default="output-error", joint="-"
)
