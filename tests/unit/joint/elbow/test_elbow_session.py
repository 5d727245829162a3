"""The trials of one joint as each other's witness."""

from __future__ import annotations

from dataclasses import replace

import pytest

from armimpedance.joint.elbow.show import elbow
from manipulandum_sim.elbow import simulate_bench


def five(gain):
    """Five trials whose torque has a gain of its own in each."""
    recording, _ = simulate_bench(0.07, 1.2, 20.0, trials=5, duration_s=10.0, snr_db=20.0, seed=2)
    force = recording.force.copy()
    for row in range(5):
        force[recording.samples_of(row)] *= gain(row)
    return replace(recording, force=force)


def session(fit):
    (one,) = (check for check in fit.checks if check.name == "session")
    return one


def test_a_clean_session_is_no_alarm():
    fit = elbow(five(lambda _: 1.0))
    assert session(fit).verdict == "ok"
    assert not [text for text in fit.warnings if text.startswith("session")]


@pytest.mark.parametrize(
    ("gain", "says"),
    [
        (lambda row: 0.5 if row >= 3 else 1.0, ("-50 %", "from trial 4 on")),
        (lambda row: 1 + 0.025 * row, ("from the first trial to the last", "gain")),
    ],
)
def test_a_gain_of_the_torque_that_changes_is_named(gain, says):
    fit = elbow(five(gain))
    assert session(fit).verdict == "warning"
    for words in says:
        assert words in session(fit).message
    assert any(text.startswith("session: ") for text in fit.warnings)
