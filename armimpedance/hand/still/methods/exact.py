"""Method `exact`: one linear operator on position and force alike.

Smoothing with a spline kernel, its derivatives on the kernel, offset and ramp projected out of
both sides per trial (`numerics.signals.response`), least squares. Right for any motion left at the
end of the disturbance and any virtual position that drifts at constant velocity.
"""

from __future__ import annotations

from armimpedance.core.conventions import Kind
from armimpedance.core.records import Window
from armimpedance.hand.still.prepared import NO_LINEAR_LIMB, Method, Prepared, impedance_factors
from armimpedance.numerics.signals import choose_span, respond


def prepare(window: Window, kind: Kind) -> Prepared:
    """Factors of the impedance equation for one group of trials, and notes on how."""
    span = choose_span(window)
    return Prepared(impedance_factors(respond(window, span), kind), notes=span.notes)


METHOD = Method(
    assumes="the limb's virtual position drifts at a constant velocity at most; the hand may "
    "end anywhere, still or moving",
    reference="both-sided correction of Tsuji (1997), eqs. (22)-(26)",
    prepare=prepare,
    differs=NO_LINEAR_LIMB,
)
