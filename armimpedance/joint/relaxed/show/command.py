"""Stiffness, viscosity and friction of relaxed joints, from markers, joint motion or torque.

Examples:
  armimpedance simulate p5 --out relaxed                  something to try it on
  armimpedance passive relaxed --rest-angle 1.5 --out fit.json
  armimpedance passive relaxed --rest-angle free --mass-sd-percent 3 --out fit.json
  armimpedance passive arm --joint right_elbow_flexion --joint right_wrist_flexion \\
      --rest-angle right_elbow_flexion=1.5 --rest-angle right_wrist_flexion=0 --out fit.json

k (q - q_r) + h qd + f sign(qd) [+ K (q - q_r)^2] is fitted to the passive torque, after Venture.
The recording is a folder of kind "markers" or "motion" with its skeleton.json (the passive torque
is minus that of inertia and gravity), or of kind "joint" whose torque columns hold the passive
torque or its opposite.
Where the rest angle is not known it is fitted (free), which may widen the interval of k several
times; where the data contradict a given one, a warning says where they put it.
k, h and f are proportional to the limb's mass, which no free swing shows: --mass-sd-percent says
how well it is known, and their intervals count it.
Trials are left out in turn and predicted from the others; --validate predicts another recording.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.joint.relaxed.show.verb import PASSIVE
from armimpedance.show.command.verb import Command

if TYPE_CHECKING:
    from armimpedance.joint.relaxed.passive_fit import PassiveFits


def _caption(fits: PassiveFits) -> str:
    return (
        "Torque of each relaxed joint over time: measured, and as its stiffness, viscosity and "
        f"friction (method {fits[0].method}) make it of the joint's motion."
    )


_COMMAND: Final = Command(
    PASSIVE,
    progress="passive joints",
    call="armimpedance.joint.relaxed.show.verb:passive",
    out="all that is known of the parameters (FIT.json), or a row a parameter",
    text="armimpedance.joint.relaxed.show.text:passive_text",
    figure="torque and its prediction",
    draw="armimpedance.joint.relaxed.show.plot:plot_passive_fits",
    caption=_caption,
)
configure, run = _COMMAND.configure, _COMMAND.run
