"""A push forwards and one backwards, alike."""

from __future__ import annotations

from armimpedance.hand.planning.profile import designed_shape

SHAPE = designed_shape("biphasic", [0.0, -1.0])
