"""Inertia, viscosity and stiffness of the hand while it reaches, at each phase of the reach.

Examples:
  armimpedance simulate reaches --out reaches              something to try it on
  armimpedance movement reaches --out moving.csv --figure moving.png
  armimpedance movement reaches --course --out course.csv --figure course.png
  armimpedance movement reaches --level joint --out joints.csv
  armimpedance movement reaches --inertia posture.csv --out moving.csv
  armimpedance movement reaches --method mean_difference --out as_gomi.csv

Some reaches are pushed and come back, others are free. trials.csv holds three more columns:
phase (a name for when the push comes), push_deg (its direction) and push_onset_s, all empty where
nobody pushed; push_end_s where it is known. recording.json says "perturbation": "moving" and holds
the arm's two lengths and the shoulder's place.

M, B and K are told for the middle of the fitted window. The turning of the arm stands in the
hand's B and K, which are therefore not symmetric. The inertia is fitted with the rest; --inertia
takes it from the same person's posture experiment, and says if the pushes show another one.
"""

from __future__ import annotations

from typing import Final

from armimpedance.hand.reaching.show.verb import MOVEMENT
from armimpedance.show.command.verb import Command

_COMMAND: Final = Command(
    MOVEMENT,
    progress="fitting {recording}",
    call="armimpedance.hand.reaching.show.verb:movement",
    out="the results, one row a condition and phase",
    text="armimpedance.hand.show.text:summary_table",
    figure="ellipses of M, B and K along the path",
    draw="armimpedance.hand.reaching.show.plot:plot_movement",
    caption="The undisturbed path (a), with ellipses of the hand's stiffness and their 95 % bands, "
    "and the force of the robot on the hand (arrows); elements of K (b) and B (c) with 95 % "
    "intervals over the way. The arm's turning stands in the hand's K and B.",
    rows=len,
)
configure, run = _COMMAND.configure, _COMMAND.run
