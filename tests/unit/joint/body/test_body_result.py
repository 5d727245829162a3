"""What an identification hands on: names, intervals and lines that agree with one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.core.errors import InputError
from armimpedance.joint.body.base_parameters import scaled_condition
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.methods import METHODS
from armimpedance.joint.body.regressor import parameter_names
from armimpedance.joint.body.rows import RowChoice


@pytest.fixture(scope="module")
def noisy(small, rigs):
    exact = rigs.moving(small, 4, trials=4, size=0.3)[0]
    rng = np.random.default_rng(0)
    noise = np.array([1.0, 1, 1, 0.3, 0.3, 0.3]) * rng.standard_normal(exact.wrenches.shape)
    return replace(exact, wrenches=exact.wrenches + noise)


def identified(recording, **how):
    return identify_body(recording, choice=RowChoice(), check=False, **how)


@pytest.mark.parametrize("method", METHODS)
def test_a_summary_says_what_the_fit_says(noisy, method):
    found = identified(noisy, method=method, motions=2)
    summary = found.summary
    assert summary.rank == 26 == len(summary.parameters)
    assert {p.name for p in summary.parameters} <= set(parameter_names(noisy.skeleton))
    np.testing.assert_allclose([p.value for p in summary.parameters], found.parameters.values)
    for p, sd in zip(summary.parameters, found.parameters.sd, strict=True):
        low, high = p.ci95
        assert high - low == pytest.approx(2 * 1.96 * sd, rel=0.01)
    assert np.linalg.eigvalsh(found.parameters.covariance).min() > -1e-12
    assert (found.phi is None) == (method in ("ls", "weighted"))
    assert (found.phi_sd is not None) == (method == "prior")


def test_a_prior_narrows_every_interval(noisy):
    free, held = (identified(noisy, method=m, motions=None) for m in ("weighted", "prior"))
    # where independent noise needs no inflation to speak of, data and prior know more than data
    assert 0.5 < free.inflation < 2
    assert (held.parameters.plain_sd < 1.1 * free.parameters.plain_sd).all()


def test_motions_may_be_chosen_named_or_all(noisy):
    greedy = identified(noisy, motions=2)
    assert len(greedy.choice.chosen) <= 2
    assert set(greedy.held_out.motions) | set(greedy.choice.motions) == {
        f"motion{i}" for i in range(4)
    }
    named = identified(noisy, motions=("motion1", "motion3"))
    assert named.choice.motions == ("motion1", "motion3")
    assert named.held_out.motions == ("motion0", "motion2")
    both = body_equations(noisy, RowChoice()).subset([1, 3])
    assert named.choice.conditions == (scaled_condition(both, named.base),)
    assert identified(noisy, motions=None).held_out is None


def test_lines_tell_forces_and_moments_apart(noisy):
    lines = identified(noisy, motions=2).lines
    held = next(line for line in lines if line.startswith("held-out"))
    assert "forces" in held
    assert "moments" in held
    assert all("\n" not in line for line in lines)


def test_a_skeleton_without_masses_needs_a_prior(noisy, small):
    bare = replace(
        small,
        segments=tuple(
            replace(s, mass_kg=0.0, com_m=np.zeros(3), inertia_kgm2=np.zeros((3, 3)))
            for s in small.segments
        ),
    )
    recording = replace(noisy, skeleton=bare)
    with pytest.raises(InputError, match="no mass of trunk"):
        identified(recording, method="prior")
    with_prior = identified(recording, method="prior", prior=small)
    np.testing.assert_allclose(
        with_prior.parameters.values,
        identified(noisy, method="prior").parameters.values,
        rtol=1e-9,
    )


def test_the_same_data_give_the_same_bits(noisy):
    a, b = (identified(noisy, method="prior", motions=None) for _ in range(2))
    assert np.array_equal(a.phi, b.phi)
    assert np.array_equal(a.parameters.covariance, b.parameters.covariance)
