"""Options of `simulate` that do not belong to the therapy robot, and its own elsewhere."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("experiment", "option"),
    [
        ("postures", ("--lowering",)),
        ("elbow", ("--lowering",)),
        ("body", ("--mismatched",)),
        ("therapy", ("--mismatched",)),
        ("therapy-mockup", ("--lowering",)),
        ("therapy-mockup", ("--subject", "S1")),
        ("therapy-calibration", ("--subject", "S1")),
        ("therapy-calibration", ("--sets", "2")),
        ("therapy-calibration", ("--sets", "0")),
        ("therapy", ("--duration-s", "3")),
        ("therapy", ("--amplitude-mm", "3")),
        ("therapy", ("--servo", "ideal")),
        ("therapy", ("--reflex", "0.2")),
        ("therapy", ("--disturbance", "biphasic")),
        ("therapy", ("--markers",)),
        ("therapy", ("--commanded",)),
        ("therapy", ("--law", "linear")),
        ("therapy", ("--frequency-hz", "1")),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, tuple) else str(v),
)
def test_options_belong_to_their_experiment(refusal, experiment, option):
    said = refusal("simulate", experiment, "--out", "session", *option)
    assert f"simulate {experiment}: no such option here: {' '.join(option)}" in said


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--noise", "sensor", "none"),
        ("--subject", "Z9", "one of S1, S2"),
        ("--sets", "0", "1 to 100"),
        ("--seed", "-1", "0 or more"),
    ],
)
def test_an_experiment_with_what_it_does_not_have(refusal, option, value, expected):
    said = refusal("simulate", "therapy", "--out", "session", option, value)
    assert value in said
    assert expected in said
