"""The contribution by a reference torque, (18)-(19): what the same movement needed when passive.

``C' = 100 (1 - mean support / mean reference support)`` needs no model of the arm, but its own
passive repetitions of every movement. The reference stands for what this repetition would have
needed; repetitions differ by the scatter s of the R references, so that it errs by
``s sqrt(1 + 1/R)``, with R - 1 degrees of freedom. Errors of the robot's model are those of the
reference too: they cancel out as far as the person is passive.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from armimpedance.joint.therapy.arm.passive_arm import Reference
from armimpedance.joint.therapy.share.judgement import Judgement
from armimpedance.joint.therapy.share.result import ReferenceContribution
from armimpedance.joint.therapy.share.sums import ABS_ARM, ABS_SUPPORT, ARM, ONE, USER

#: The mean reference must be this many of its own standard errors away from zero.
AWAY_SD: Final = 3.0
#: And this share of the mean size of the torques that it stands for.
LEAST_SHARE: Final = 0.2
#: A movement whose own mean tau_h differs from the reference by more than this share, and by more
#: than the errors, was made with another timing.
OTHER_SHARE: Final = 0.1
#: A movement that starts or ends further from the reference's is another movement, rad.
OTHER_RAD: Final = np.deg2rad(10.0)


def reference_contribution(
    judgement: Judgement, reference: Reference, from_rad: float, to_rad: float
) -> ReferenceContribution:
    """``C'`` (19) and its standard error, from the scatter of the reference's repetitions.

    Parameters
    ----------
    judgement : Judgement
        Judgement of the sums (6, k) of the movement.
    reference : Reference
        The support of its passive repetitions.
    from_rad, to_rad : float
        Where this movement starts and ends.
    """
    sums, law, repetitions = judgement.sums, judgement.law, len(reference.support_Nm)
    total = sums[ONE]
    n = total[ONE]
    support = (total[ARM] - total[USER]) / n
    mean = float(reference.support_Nm.mean())
    scatter = float(reference.support_Nm.std(ddof=1)) if repetitions > 1 else float("nan")
    error = scatter * np.sqrt(1 + 1 / repetitions)
    size = max(total[ABS_ARM], total[ABS_SUPPORT]) / n
    why_not = _why_not(mean, error, float(size)) or _other_timing(mean, error, judgement)
    away = max(abs(from_rad - reference.from_rad), abs(to_rad - reference.to_rad))
    if away > OTHER_RAD:
        why_not = f"starts or ends {np.degrees(away):.0f} degrees from where the reference does"
    if mean == 0:
        return ReferenceContribution(float("nan"), float("nan"), mean, False, why_not)
    # the robot's errors are in the support and in the reference: dC' = 100 (1 - s / ref) dr / ref
    robot = (1 - support / mean) ** 2 * law.variance_of_robot_sum(sums) / n**2
    # noise of the mean support: variance law.noise / n
    sd = 100 / abs(mean) * np.sqrt((support / mean * error) ** 2 + robot + law.noise / n)
    return ReferenceContribution(
        float(100 * (1 - support / mean)), float(sd), mean, not why_not, why_not
    )


def _why_not(mean: float, error: float, size: float) -> str:
    """Why the reference is no denominator; empty where it is one."""
    if np.isnan(error):
        return "one repetition of the reference: its scatter is not known"
    if not abs(mean) >= AWAY_SD * error:
        return f"the mean reference {mean:.3g} N m is less than {AWAY_SD:g} times its error"
    if not abs(mean) >= LEAST_SHARE * size:
        return f"the mean reference {mean:.3g} N m is small against the torques of {size:.3g} N m"
    return ""


def _other_timing(mean: float, error: float, judgement: Judgement) -> str:
    """Why the reference is that of another course; empty where it is of this one."""
    sums = judgement.sums
    needs = float(sums[ONE, ARM] / sums[ONE, ONE])
    known = float(judgement.law.variance_of_arm_sum(sums)) / sums[ONE, ONE] ** 2
    apart = abs(needs - mean)
    if apart > max(OTHER_SHARE * abs(mean), AWAY_SD * float(np.hypot(error, np.sqrt(known)))):
        return (
            f"the arm needs {needs:.3g} N m over this movement, {mean:.3g} N m over the reference"
        )
    return ""
