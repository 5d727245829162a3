"""Table of the estimators of passive joints."""

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
    """An estimator of a passive joint's parameters.

    `assumes`: assumption of the estimate, in one sentence.
    `equations`: torque equations of a single joint for its validation.
    `solve`: estimates a single joint's parameters.
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
    """The source's method: smoothed motion, sign of its velocity, ordinary least squares.

    Unlike the torque, the sign is not filtered, and the ends of the trials are used: h and f are
    biased.
    """
    from armimpedance.joint.relaxed.linear import solver

    return solver(_plain)(samples, terms)


def _parallel(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Least squares with every column, including the sign, passed through the torque's filter."""
    from armimpedance.joint.relaxed.linear import solver

    return solver(_filtered, filtered=True)(samples, terms)


def _output_error(samples: PassiveSamples, terms: Terms) -> TwoFits:
    """Fit the measured motion itself, without noisy derivatives.

    A hinge with known inertia is simulated forward (`swing`). If only angle and torque were
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
