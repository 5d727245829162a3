"""The table of estimators for passive joints: one record, one file each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from armimpedance.errors import look_up
from armimpedance.passive import ls, output_error, parallel
from armimpedance.passive.equations import Equations
from armimpedance.passive.linear import TwoFits
from armimpedance.passive.samples import PassiveSamples
from armimpedance.passive.terms import Terms


@dataclass(frozen=True)
class Method:
    """An estimator.

    Attributes
    ----------
    name : str
    assumes : str
        What must hold for the estimate to be right, in one sentence.
    reference : str
    equations : function
        The torque equations of a single joint that its validation uses.
    solve : function
        The estimate of a single joint.
    """

    name: str
    assumes: str
    reference: str
    equations: Callable[[PassiveSamples, Terms], Equations]
    solve: Callable[[PassiveSamples, Terms], TwoFits]


METHODS: Final = {
    method.name: method
    for method in (
        Method(
            "ls",
            "the smoothed motion is exact, its ends and its reversals included",
            "Venture elbow, eqs. (8)-(11)",
            ls.equations,
            ls.solve,
        ),
        Method(
            "parallel",
            "noise of the smoothed velocity is small against the swing",
            "every column through the filter of Y, as in M. Gautier, ICRA 1997, pp. 2203-2208",
            parallel.equations,
            parallel.solve,
        ),
        Method(
            "output-error",
            "the skeleton's inertia and the other coordinates' motion are right; of a joint "
            "recording: noise of angle and torque is white",
            "L. Ljung, System Identification: Theory for the User (1999), chapters 4 and 7",
            parallel.equations,
            output_error.solve,
        ),
    )
}

DEFAULT_METHOD: Final = "parallel"


def method_named(name: str) -> Method:
    """Look up a method.

    Raises
    ------
    InputError
        If there is none of that name; lists those that there are.
    """
    return look_up(METHODS, name, "method")
