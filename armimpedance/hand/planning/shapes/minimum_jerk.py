"""The bump of least jerk."""

from __future__ import annotations

from armimpedance.hand.planning.profile import designed_shape

SHAPE = designed_shape("minimum_jerk", [1.0])
