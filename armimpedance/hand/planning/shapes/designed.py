"""The shape that needs the fewest trials for K."""

from __future__ import annotations

from armimpedance.hand.planning.profile import designed_shape

#: Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2, nominal noise, an arm at rest: the fewest
#: trials for K (degree 5, goal K alone).
SHAPE = designed_shape("designed", (0.0, -9.625238, 0.0, -6.828925, 0.0, -2.989463))
