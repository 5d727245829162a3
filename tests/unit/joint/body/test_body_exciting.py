"""The greedy choice: condition numbers are those of the samples, and only ever fall."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.base_parameters import (
    choose_motions,
    essential_base_parameters,
    motion_conditions,
    scaled_condition,
)
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.rows import RowChoice, each_trial


@pytest.fixture(scope="module")
def motions(small, rigs):
    """Six motions, the first of which moves the trunk alone."""
    rng = np.random.default_rng(2)
    n = len(small.coordinates)
    parts = [rigs.splined(n, 2.0, rng, size=size) for size in (0.4, 0.2, 0.3, 0.4, 0.5, 0.6)]
    parts[0] = tuple(np.copy(x) for x in parts[0])
    for x in parts[0][1:]:
        x[:, 6:] = 0
    forces = [rigs.contact_wrench(small, *p[1:]) for p in parts]
    return rigs.record(small, parts, forces)


def scaled_cond(W):
    return np.linalg.cond(W / np.linalg.norm(W, axis=0))


def test_conditions_are_those_of_the_stacked_samples(motions, small):
    base = essential_base_parameters(small)
    equations = body_equations(motions, RowChoice())
    W = [t.W[..., base.leading].reshape(-1, base.rank) for t in each_trial(motions, RowChoice())]
    alone = motion_conditions(equations, base)
    assert np.isinf(alone[0])
    for t in range(1, 6):
        assert alone[t] == pytest.approx(scaled_cond(W[t]), rel=1e-6)
    assert scaled_condition(equations, base) == pytest.approx(
        scaled_cond(np.concatenate(W)), rel=1e-6
    )
    choice = choose_motions(equations, base, most=3)
    chosen = np.concatenate([W[t] for t in choice.chosen])
    assert choice.conditions[-1] == pytest.approx(scaled_cond(chosen), rel=1e-6)


def test_each_motion_added_lowers_the_condition_most(motions, small):
    base = essential_base_parameters(small)
    equations = body_equations(motions, RowChoice())
    choice = choose_motions(equations, base, most=6)
    assert all(b < a for a, b in itertools.pairwise(choice.conditions))
    for k, reached in enumerate(choice.conditions):
        before = list(choice.chosen[:k])
        for other in set(range(6)) - set(before):
            tried = scaled_condition(equations.subset([*before, other]), base)
            assert tried >= reached * (1 - 1e-9)
    assert set(choice.rest) | set(choice.chosen) == set(range(6))
    assert choice.motions == tuple(equations.motions[t] for t in choice.chosen)


def test_no_motions_are_refused(motions, small):
    with pytest.raises(InputError, match="1 or more"):
        choose_motions(
            body_equations(motions, RowChoice()), essential_base_parameters(small), most=0
        )
