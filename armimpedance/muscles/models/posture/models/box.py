"""Positive semidefinite on a stated workspace."""

from __future__ import annotations

from armimpedance.muscles.models.posture.models import PostureMethod
from armimpedance.muscles.models.posture.sos import sos_fit

MODEL = PostureMethod(
    "box",
    "positive semidefinite at every posture of the stated workspace, free outside of it",
    sos_fit("box"),
)
