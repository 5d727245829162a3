"""The method "smoother": integrated random walks with noise levels of maximum likelihood."""

from __future__ import annotations

from typing import Final

from armimpedance.elbow.varying.beginning import Beginning
from armimpedance.elbow.varying.estimated import EstimatedCourse, grid
from armimpedance.elbow.varying.method import VaryingMethod, VaryingOptions
from armimpedance.elbow.varying.smoother import smooth

#: +-30 % at 2 Hz asks for about so much; at 3 Hz, twice, bands of 95 % cover some 60 %.
FAST: Final = 12.0
#: Residuals above this many times the sensor's noise are told.
MUCH_NOISE: Final = 3.0


def smoother(begun: Beginning, options: VaryingOptions) -> EstimatedCourse:
    """Integrated random walks with noise levels of maximum likelihood."""
    data = begun.data
    # levels chosen together with the subject's torque are near; else the search begins wide
    near = begun.levels if data.own.order else None
    made = smooth(data, begun.course, near=near, tick=options.tick)
    at, course = grid(data, options.every_s), made.course
    levels = made.levels
    warnings = []
    if levels.torque > MUCH_NOISE and not data.own.order:
        warnings.append(
            f"residuals are {levels.torque:.1f} times the torque sensor's noise: a torque of the "
            "subject's own, or a joint that is not of second order; the bands take it in"
        )
    for name, level in (("B", levels.B), ("K", levels.K)):
        if level > FAST:
            warnings.append(
                f"{name} varies so fast (intensity {level:.3g} s^-1.5) that its band is too narrow"
            )
    return EstimatedCourse(
        at=at,
        B=course.B[at],
        K=course.K[at],
        sd_B=made.sd_B[at],
        sd_K=made.sd_K[at],
        inertia=course.inertia,
        sd_inertia=made.sd_inertia,
        notes=(
            "integrated random walks, by likelihood: relative second derivatives of intensity "
            f"{levels.B:.3g} (B) and {levels.K:.3g} (K) s^-1.5, torque noise {levels.torque:.3g} "
            "times the channel's floor",
        ),
        warnings=tuple(warnings),
        details={
            "intensity": {"B": levels.B, "K": levels.K},
            "torque_noise_over_floor": levels.torque,
            "log_likelihood": made.log_likelihood,
        },
    )


METHOD = VaryingMethod(
    "smoother",
    "integrated random walks, their noise levels chosen by likelihood",
    "",
    "H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450",
    smoother,
)
