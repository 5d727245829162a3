"""The shape that tells K and a reflex apart with the fewest trials."""

from __future__ import annotations

from armimpedance.hand.planning.profile import designed_shape

#: Found by `design` at 5 mm, 0.3 s, at most 5.3 m/s^2: K and the answer to what was 40 to 70 ms
#: earlier, the delay not known (degree 9).
_COEFFICIENTS = (
    *(0.056824, -8.970596, 2.063219, -7.981409, 6.097356),
    *(-6.788630, 5.362087, -3.584803, 1.616960, -1.455224),
)
SHAPE = designed_shape("reflex_separating", _COEFFICIENTS)
