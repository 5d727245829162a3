"""Least squares with every row divided by the level of its residuals."""

from __future__ import annotations

from armimpedance.joint.body.methods import BodyMethod

METHOD = BodyMethod("weighted", "each row of the wrench has a level of noise of its own", "levels")
