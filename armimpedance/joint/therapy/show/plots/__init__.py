"""Drawings of the therapy robot, of a person's arm in it, and of the person's contribution."""

from __future__ import annotations

from armimpedance.joint.therapy.show.plots.calibration import (
    plot_friction,
    plot_passive_arm,
    plot_passive_axis,
    plot_robot_calibration,
    plot_spring,
)
from armimpedance.joint.therapy.show.plots.view import (
    contribution_text,
    plot_contribution,
    plot_feedback,
)

__all__ = [
    "contribution_text",
    "plot_contribution",
    "plot_feedback",
    "plot_friction",
    "plot_passive_arm",
    "plot_passive_axis",
    "plot_robot_calibration",
    "plot_spring",
]
