"""Positive semidefinite on a stated workspace."""

from __future__ import annotations

from armimpedance.muscles.models.posture.sos import sos_fit
from armimpedance.muscles.models.posture.table import PostureMethod

MODEL = PostureMethod(
    "box",
    "positive semidefinite at every posture of the stated workspace, free outside of it",
    sos_fit("box"),
)
