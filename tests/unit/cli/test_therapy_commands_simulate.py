"""Options of `simulate` that do not belong to the therapy robot, and its own elsewhere."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("experiment", "option", "belongs"),
    [
        ("postures", ("--lowering",), "it with therapy)"),
        ("elbow", ("--lowering",), "it with therapy)"),
        ("body", ("--mismatched",), "it with therapy-validation)"),
        ("therapy", ("--mismatched",), "it with therapy-validation)"),
        ("therapy-mockup", ("--lowering",), "it with therapy)"),
        ("therapy-mockup", ("--subject", "S1"), "it with therapy)"),
        ("therapy-calibration", ("--subject", "S1"), "it with therapy)"),
        ("therapy-calibration", ("--sets", "2"), "it with therapy or therapy-mockup)"),
        ("therapy-calibration", ("--sets", "0"), "it with therapy or therapy-mockup)"),
        ("therapy", ("--duration-s", "3"), "an experiment that has it"),
        ("therapy", ("--amplitude-mm", "3"), "an experiment that has it"),
        ("therapy", ("--servo", "ideal"), "an experiment that has it"),
        ("therapy", ("--reflex", "0.2"), "an experiment that has it"),
        ("therapy", ("--disturbance", "biphasic"), "an experiment that has it"),
        ("therapy", ("--markers",), "an experiment that has it"),
        ("therapy", ("--commanded",), "it with an elbow test"),
        ("therapy", ("--law", "linear"), "it with an elbow test"),
        ("therapy", ("--frequency-hz", "1"), "it with an elbow test"),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, tuple) else str(v),
)
def test_options_belong_to_their_experiment(refusal, experiment, option, belongs):
    said = refusal("simulate", experiment, "--out", "session", *option)
    assert f"{option[0]} with {experiment}" in said
    assert belongs in said


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--noise", "sensor", "nominal or none"),
        ("--subject", "Z9", "one of S1, S2"),
        ("--sets", "0", "1 to 100"),
        ("--seed", "-1", "0 or more"),
    ],
)
def test_an_experiment_with_what_it_does_not_have(refusal, option, value, expected):
    said = refusal("simulate", "therapy", "--out", "session", option, value)
    assert value in said
    assert expected in said
