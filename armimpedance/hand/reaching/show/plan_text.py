"""A plan of pushes of a moving hand, as text."""

from __future__ import annotations

from armimpedance.hand.reaching.plan import MovementPlan
from armimpedance.show.text import counted


def movement_plan_text(plan: MovementPlan) -> str:
    """The table of shapes, the best first, and what it means.

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
