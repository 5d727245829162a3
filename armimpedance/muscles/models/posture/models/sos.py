"""Positive semidefinite at every posture, moment arms that depend on both angles."""

from __future__ import annotations

from armimpedance.muscles.models.posture.models import PostureMethod
from armimpedance.muscles.models.posture.sos import sos_fit

MODEL = PostureMethod(
    "sos",
    "sum of squares: stiffness and viscosity are positive semidefinite at every posture",
    sos_fit("full"),
)
