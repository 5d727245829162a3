"""What an estimator of passive joints is, and the table of those that there are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from armimpedance.core.method_table import RecordTable

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


def _plain(samples: PassiveSamples, terms: Terms) -> Equations:
    from armimpedance.joint.relaxed.equations import plain_equations

    return plain_equations(samples, terms)


def _filtered(samples: PassiveSamples, terms: Terms) -> Equations:
    from armimpedance.joint.relaxed.equations import parallel_equations

    return parallel_equations(samples, terms)


def _least_squares(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """The source's: smoothed motion, sign of its velocity, ordinary least squares.

    The sign is not filtered as the torque is, and the ends of the trials count: h and f come out
    biased.
    """
    from armimpedance.joint.relaxed.linear import solver

    return solver(_plain)(samples, terms)


def _parallel(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Least squares with every column, the sign included, through the filter of the torque."""
    from armimpedance.joint.relaxed.linear import solver

    return solver(_filtered, filtered=True)(samples, terms)


def _output_error(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """The measured motion itself is fitted, and no noisy derivative enters.

    A hinge whose inertia is known is simulated forward (`swing`). Where only angle and torque were
    measured, a spline of the motion and the torque are fitted together (`joint_spline`).
    """
    from armimpedance.joint.relaxed.joint_spline import solve_joint_spline
    from armimpedance.joint.relaxed.swing import solve_swing

    chosen = solve_joint_spline if samples.hinges is None else solve_swing
    return chosen(samples, terms)


METHODS: Final = RecordTable(
    {
        "ls": PassiveMethod(
            "the smoothed motion is exact, its ends and its reversals included",
            "Venture elbow, eqs. (8)-(11)",
            _plain,
            _least_squares,
        ),
        "output-error": PassiveMethod(
            "the skeleton's inertia and the other coordinates' motion are right; of a joint "
            "recording: noise of angle and torque is white",
            "L. Ljung, System Identification: Theory for the User (1999), chapters 4 and 7",
            _filtered,
            _output_error,
        ),
        "parallel": PassiveMethod(
            "noise of the smoothed velocity is small against the swing",
            "every column through the filter of Y, as in M. Gautier, ICRA 1997, pp. 2203-2208",
            _filtered,
            _parallel,
        ),
    },
    "method",
    default="output-error",
)
