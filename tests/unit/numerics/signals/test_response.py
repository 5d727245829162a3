"""The smoothed response obeys the impedance equation exactly, drift or not, ends or not."""

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.numerics.signals.response import choose_span, respond
from armimpedance.numerics.signals.windows import cut_windows


def _unbalance(limb, response):
    left = (
        response.acceleration @ limb.M.T
        + response.velocity @ limb.B.T
        + response.displacement @ limb.K.T
    )
    return np.abs(left + response.force).max() / np.abs(response.force).max()


@pytest.mark.parametrize("drift", [0.0, 0.003, 0.05])
def test_equation_holds_after_the_operator_whatever_the_drift(limb, drift):
    window = cut_windows(limb.record(sets=1, drift=drift))
    assert _unbalance(limb, respond(window)) < 1e-4


def test_equation_holds_when_the_hand_does_not_come_back(limb):
    """Fit windows that end in the middle of the motion: nothing assumes a return."""
    recording = limb.record(sets=1)
    trials = recording.trials.assign(end_s=0.25 + 0.21)
    window = cut_windows(replace(recording, trials=trials))
    assert _unbalance(limb, respond(window)) < 1e-4


def test_operator_is_linear_and_blind_to_an_offset(limb):
    window = cut_windows(limb.record(sets=1))
    shifted = replace(window, position=window.position + 0.7, force=window.force - 3.0)
    a, b = respond(window), respond(shifted)
    for name in ("displacement", "velocity", "acceleration", "force"):
        largest = np.abs(getattr(a, name)).max()
        assert np.abs(getattr(a, name) - getattr(b, name)).max() < 1e-9 * max(largest, 1.0)


def test_short_records_narrow_the_kernel_and_say_so(limb):
    window = cut_windows(limb.record(sets=1, before=0.06, after=0.06))
    span = choose_span(window)
    assert "instead of 160 ms" in span.notes[0]
    assert _unbalance(limb, respond(window, span)) < 1e-3


def test_records_without_any_room_are_refused(limb):
    window = cut_windows(limb.record(sets=1, before=0.0, after=0.0, duration=0.05))
    with pytest.raises(InputError, match="at least 150 ms of rest"):
        choose_span(window)
