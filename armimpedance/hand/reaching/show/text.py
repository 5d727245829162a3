"""Texts of a hand that moves: the methods paragraph and the plan of pushes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from armimpedance.core.conventions import Level
from armimpedance.core.program import software
from armimpedance.core.records import ImpedanceEstimate
from armimpedance.hand.reaching.methods import METHODS
from armimpedance.hand.reaching.push_plan import MovementPlan
from armimpedance.show.text import counted

NAGAR: Final = (
    "A. L. Nagar, The bias and moment matrix of the general k-class estimators of the parameters "
    "in simultaneous equations, Econometrica 27 (1959) 575-595."
)

_AT: Final[dict[Level, str]] = {
    "hand": "M, B and K of the hand are -dF/da, -dF/dv and -dF/dx along the undisturbed reach, so "
    "that the turning of the arm stands in B and K",
    "joint": "M, B and K are those of the joints, without the term of the hand's force",
}


def is_moving(estimates: Sequence[ImpedanceEstimate]) -> bool:
    """True if these are results of `movement`."""
    return bool(estimates) and all(estimate.method in METHODS.names for estimate in estimates)


def moving_sentences(estimates: Sequence[ImpedanceEstimate], trials: int) -> list[str]:
    """Sentences for the methods of a paper; `trials` is the number of pushed reaches."""
    level = estimates[0].level
    whose = "hand" if level == "hand" else "arm"
    sentences = [
        f"Inertia M, viscosity B and stiffness K of the reaching {whose} were estimated from "
        f"{trials} pushed reaches with {software()}"
    ]
    for name in dict.fromkeys(estimate.method for estimate in estimates):
        if name == METHODS.default:
            sentences += [
                "With joint angles q, the hand's force F and the links' dynamics Y phi, the torque "
                "w = J^T F + Y phi + K q + B dq/dt + R q(t - 55 ms) was taken to have the same "
                "distribution in pushed and in free reaches",
                "K and B change over the window by a straight line and a little by a parabola; R, "
                "a reflex, is small and not told",
                "The unknowns were found by weighted least squares whose instruments are the parts "
                "of the regressors that the pushes explain (Nagar 1959), their intervals by "
                "leaving out each pushed reach in turn",
                _AT[level],
            ]
        else:
            sentences.append(f"Estimator: {name} ({METHODS[name].reference})")
    return sentences


# A plan of pushes of a moving hand, as text.


def movement_plan_text(plan: MovementPlan) -> str:
    """Table of shapes, the best first, and its explanation.

    Parameters
    ----------
    plan : MovementPlan

    Returns
    -------
    str
        Lines of at most 100 characters.
    """
    K = plan.stiffness
    head = (
        f"Condition {plan.condition}, phase {plan.phase}: the pilot's K is "
        f"[{K[0, 0]:.0f} {K[0, 1]:.0f}; {K[1, 0]:.0f} {K[1, 1]:.0f}] N/m\n"
    )
    rows = [f"{'push':26s}{'largest':>18s}{'error of K':>13s}{'trials for':>13s}"]
    wanted = f"{plan.wanted_percent:g} %"
    rows.append(f"{'':26s}{'force, way':>18s}{'of 40 trials':>13s}{wanted:>13s}")
    for push in plan.pushes:
        size = f"{push.force_n:.1f} N, {1e3 * push.displacement_m:.1f} mm"
        rows.append(f"{push.shape.name:26s}{size:>18s}{push.k_percent:>11.1f} %{push.trials:>13d}")
    best = plan.pushes[0]
    tail = (
        f"\nBest: {best.shape.name}, {counted(best.trials, 'trial')} at this phase, an equal share "
        "in each of eight\ndirections. 95 of 100 experiments stay below the error that is told; "
        "inertia is fitted with the rest.\nForces are those of the limb; a displacement takes a "
        "servo that holds against them."
    )
    return "\n".join([head, *rows, tail])
