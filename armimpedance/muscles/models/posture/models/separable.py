"""Positive semidefinite, moment arms that depend on the own joint's angle only."""

from __future__ import annotations

from armimpedance.muscles.models.posture.sos import sos_fit
from armimpedance.muscles.models.posture.table import PostureMethod

MODEL = PostureMethod(
    "separable",
    "as sos, for moment arms that depend on the angle of their own joint only",
    sos_fit("separable"),
)
