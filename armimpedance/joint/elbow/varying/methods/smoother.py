"""The method "smoother": integrated random walks with noise levels of maximum likelihood."""

from __future__ import annotations

from typing import Final

from armimpedance.joint.elbow.varying.beginning import Beginning
from armimpedance.joint.elbow.varying.method import (
    EstimatedCourse,
    VaryingMethod,
    VaryingOptions,
    grid,
)
from armimpedance.joint.elbow.varying.rivals import explained, hull

#: Intensity of about +-30 % at 2 Hz. At 3 Hz, twice that, 95 % bands cover only some 60 %.
FAST: Final = 12.0


def smoother(begun: Beginning, options: VaryingOptions) -> EstimatedCourse:
    """Smooth with integrated random walks and noise levels of maximum likelihood."""
    comparison = explained(begun, options.tick)
    data, smoothed = comparison.data, comparison.made
    at, course = grid(data, options.every_s), smoothed.course
    levels = smoothed.levels
    sd_B, sd_K = smoothed.sd_B[at], smoothed.sd_K[at]
    for rival in comparison.others:
        sd_B = hull(course.B[at], sd_B, rival.course.B[at], rival.sd_B[at])
        sd_K = hull(course.K[at], sd_K, rival.course.K[at], rival.sd_K[at])
    warnings = []
    for name, level in (("B", levels.B), ("K", levels.K)):
        if level > FAST:
            warnings.append(
                f"{name} varies so fast (intensity {level:.3g} s^-1.5) that its band is too narrow"
            )
    return EstimatedCourse(
        at=at,
        B=course.B[at],
        K=course.K[at],
        sd_B=sd_B,
        sd_K=sd_K,
        inertia=course.inertia,
        sd_inertia=smoothed.sd_inertia,
        notes=(
            "integrated random walks, by likelihood: relative second derivatives of intensity "
            f"{levels.B:.3g} (B) and {levels.K:.3g} (K) s^-1.5, torque noise {levels.torque:.3g} "
            "times the channel's floor",
        ),
        warnings=tuple(warnings),
        checks=(comparison.finding,),
        own=data.own,
        details={
            "intensity": {"B": levels.B, "K": levels.K},
            "torque_noise_over_floor": levels.torque,
            "log_likelihood": smoothed.log_likelihood,
        },
    )


METHOD = VaryingMethod(
    "smoother",
    "integrated random walks, their noise levels chosen by likelihood",
    "",
    "H. E. Rauch, F. Tung, C. T. Striebel, AIAA J. 3 (1965) 1445-1450",
    smoother,
)
