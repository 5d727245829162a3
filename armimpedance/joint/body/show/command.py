"""Base parameters of a body from its motion and contact forces, or of a robot from its torques.

Examples:
  armimpedance simulate body --out session               something to try it on
  armimpedance body session --out fit.json
  armimpedance body session --method prior --prior-sd-percent 30 --motions 4 --figure check.png
  armimpedance body session --motions walk,squat,all_joints --cutoff-hz 8 --out fit.json
  armimpedance body robot --rows all --term viscosity --term friction --term offset --motions all

The recording is a folder of kind "motion" (joint angles, force plates or joint torques, and
skeleton.json) or of kind "markers" with force plates. Fitted are the combinations of masses, first
moments and inertias that such motion can show; from the six equations of the root alone, so that no
joint torque is needed (Venture). The motions that excite best are chosen (--motions: how many, all,
or which), the others are predicted. Methods: ls, weighted (rows by their residuals; default),
consistent (every segment physically possible), prior (the same, near the skeleton's own masses).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from armimpedance.joint.body.show.verb import BODY
from armimpedance.show.command.verb import Command

if TYPE_CHECKING:
    from armimpedance.joint.body.result import BodyFit


def _caption(fit: BodyFit) -> str:
    shown = "fitted" if fit.held_out is None else "held-out"
    return (
        f"Measured and predicted wrench (or joint torques) of the {shown} motion whose moments "
        "vary most."
    )


_COMMAND: Final = Command(
    BODY,
    progress="identifying",
    call="armimpedance.joint.body.show.verb:body",
    out="all that is known of the base parameters (FIT.json), or a row a parameter",
    text="armimpedance.joint.body.show.text:body_text",
    figure="the wrench and its prediction",
    draw="armimpedance.joint.body.show.plot:body_figure",
    caption=_caption,
)
configure, run = _COMMAND.configure, _COMMAND.run
