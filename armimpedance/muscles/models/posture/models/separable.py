"""Positive semidefinite, moment arms that depend on the own joint's angle only."""

from __future__ import annotations

from armimpedance.muscles.models.posture.models import PostureMethod
from armimpedance.muscles.models.posture.sos import sos_fit

MODEL = PostureMethod(
    "separable",
    "as sos, for moment arms that depend on the angle of their own joint only",
    sos_fit("separable"),
)
