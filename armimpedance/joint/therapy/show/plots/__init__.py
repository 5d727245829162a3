"""Drawings of the therapy robot, of a person in it, and of what that person contributes."""

from __future__ import annotations

from armimpedance.joint.therapy.show.plots.arm import plot_passive_arm, plot_passive_axis
from armimpedance.joint.therapy.show.plots.number import contribution_text
from armimpedance.joint.therapy.show.plots.robot import (
    plot_friction,
    plot_robot_calibration,
    plot_spring,
)
from armimpedance.joint.therapy.show.plots.view import plot_contribution, plot_feedback

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
