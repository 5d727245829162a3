"""Positive semidefinite at every posture, moment arms that depend on both angles."""

from __future__ import annotations

from armimpedance.muscles.models.posture.sos import sos_fit
from armimpedance.muscles.models.posture.table import PostureMethod

MODEL = PostureMethod(
    "sos",
    "sum of squares: stiffness and viscosity are positive semidefinite at every posture",
    sos_fit("full"),
)
