"""Errors that all rows have in common: they stay in the intervals of what is fitted to the rows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import armimpedance as ai
from armimpedance.limb.arm import arm_named
from armimpedance.muscles.models import JointRows, MuscleModel, triple
from armimpedance.muscles.models.rows import main_errors, spread_of

PLACES = np.array([[s, e] for s in (0.4, 0.8, 1.2, 1.6) for e in (0.9, 1.3, 1.7)])
K = np.array([[16.0, 5.0], [5.0, 14.0]]) + 2 * np.sin(PLACES).sum(axis=1)[:, None, None] * np.eye(2)
FIELDS = ("stiffness_shared", "viscosity_shared")


def _symmetric(z):
    return (z + z.swapaxes(1, 2)) / 2


def rows_of(stiffness, shared=None, activation=None, angles=PLACES):
    """Rows with errors of 1 N m/rad and .05 N m s/rad, and what they share, (s, P, 2, 2)."""
    part = None if shared is None else np.swapaxes(shared, 0, 1)
    sd = np.ones_like(stiffness)
    return JointRows(
        angles,
        stiffness,
        stiffness / 20,
        stiffness_sd=sd,
        viscosity_sd=sd / 20,
        activation=activation,
        activation_sd=None if activation is None else np.full_like(activation, 1e-4),
        stiffness_shared=part,
        viscosity_shared=None if part is None else part / 20,
    )


def without(rows):
    """The same rows that say nothing of what they share."""
    return replace(rows, **dict.fromkeys(FIELDS))


def muscle_rows(seed=3):
    """Conditions at one place whose muscles are active each in its own way, and a common error."""
    rng = np.random.default_rng(seed)
    alpha = rng.uniform(0.02, 0.4, (30, 6))
    arm = arm_named("planar6")
    q = np.array([0.9, 1.5])
    G = arm.paths.moment_arms(q)
    patterns = np.einsum("mi,mj->mij", G, G)
    stiffness = np.tensordot(2e4 * alpha + 500, patterns, 1)
    error = 0.1 * stiffness
    noisy = stiffness + 0.3 * _symmetric(rng.normal(size=(30, 2, 2)))
    return rows_of(noisy, error[None], alpha, np.tile(q, (30, 1)))


def predicted(model, rows):
    """K and B that a model says of its own rows, with their covariances."""
    if isinstance(model, MuscleModel):
        return model.predict(rows.joint_angles, rows.activation)
    return model.predict(rows.activation)


def test_an_error_that_a_linear_model_follows_is_in_its_intervals_whole():
    # a reflex adds a tenth to every row: a polynomial follows it wherever it follows K itself
    shared = 0.1 * K[None]
    rows = rows_of(K, shared)
    wide, narrow = (ai.fit_posture(r, model="polynomial", order=1) for r in (rows, without(rows)))
    moved = ai.fit_posture(rows_of(1.1 * K), model="polynomial", order=1)
    for name in ("stiffness", "viscosity"):
        said, bare = wide.predict(PLACES), narrow.predict(PLACES)
        np.testing.assert_array_equal(getattr(said, name), getattr(bare, name))
        d = getattr(moved.predict(PLACES), name) - getattr(bare, name)
        more = getattr(said, f"{name}_covariance") - getattr(bare, f"{name}_covariance")
        np.testing.assert_allclose(more, d[:, :, None] * d[:, None], atol=1e-9)


@pytest.mark.parametrize("fit", [ai.fit_activation, ai.fit_muscles])
def test_models_of_muscles_move_as_their_intervals_say(fit):
    """Finite differences of the whole fit against the linear gain."""
    rows = muscle_rows()
    step = 0.02
    error = rows.stiffness_shared[:, 0]
    wide, bare = predicted(fit(rows), rows), predicted(fit(without(rows)), rows)
    up, down = (
        predicted(fit(replace(without(rows), stiffness=rows.stiffness + s * error)), rows)
        for s in (step, -step)
    )
    d = (up.stiffness - down.stiffness) / (2 * step)
    more = np.diagonal(wide.stiffness_covariance - bare.stiffness_covariance, axis1=1, axis2=2)
    # weights, activations and bounds move too, which the linear gain leaves out
    np.testing.assert_allclose(np.sqrt(more), np.abs(d), rtol=0.1, atol=0.05 * np.abs(d).max())
    assert np.median(wide.sd("stiffness") / bare.sd("stiffness")) > 1.5


@pytest.mark.study
@pytest.mark.parametrize(("model", "persons"), [("polynomial", 40), ("separable", 12)])
def test_intervals_hold_what_rows_with_a_common_error_say(model, persons):
    """Persons whose rows all err by a part of K of 8 % sd, beside their own errors."""
    rng = np.random.default_rng(11)
    K_0 = np.tile(np.array([[16.0, 5.0], [5.0, 14.0]]), (len(PLACES), 1, 1))
    held, held_bare = [], []
    for _ in range(persons):
        own = _symmetric(rng.normal(size=K_0.shape))
        noisy = K_0 * (1 + 0.08 * rng.standard_normal()) + own
        rows = rows_of(noisy, 0.08 * K_0[None])
        for r, out in ((rows, held), (without(rows), held_bare)):
            said = ai.fit_posture(r, model=model, order=1).predict(PLACES[4])
            out.append(np.abs(said.stiffness - triple(K_0[:1])) <= said.half_width("stiffness"))
    # elements that move together: the standard error of .95 is that of one number a person
    assert np.mean(held) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / persons)
    assert np.mean(held_bare) < 0.85


def test_few_errors_stand_for_many():
    rng = np.random.default_rng(5)
    direction = rng.normal(size=(7, 3))
    shared = rng.normal(size=(6, 1, 1)) * direction
    sd = rng.uniform(0.5, 2, (7, 3))
    kept = main_errors(shared, sd)
    assert len(kept) == 1
    np.testing.assert_allclose(
        np.einsum("sai,sbj->aibj", kept, kept),
        np.einsum("sai,sbj->aibj", shared, shared),
        atol=1e-9,
    )
    many = main_errors(rng.normal(size=(4, 7, 3)), None)
    assert len(many) > 2
    assert (
        len(main_errors(np.zeros((0, 7, 3)), sd)) == len(main_errors(np.zeros((2, 7, 3)), sd)) == 0
    )


def test_the_gain_of_a_weighted_fit_is_that_of_its_normal_equations():
    rng = np.random.default_rng(8)
    X, f = rng.normal(size=(5, 3, 4)), rng.normal(size=(2, 5, 3))
    W = rng.normal(size=(5, 3, 3))
    flat = (W @ X).reshape(15, 4)
    d = np.array([np.linalg.lstsq(flat, np.einsum("pij,pj->pi", W, one).ravel())[0] for one in f])
    spread = spread_of(np.linalg.inv(flat.T @ flat), W @ X, W, f)
    np.testing.assert_allclose(spread, d.T @ d, rtol=1e-9)


def test_rows_keep_what_they_share_when_some_are_chosen():
    rows = rows_of(K, np.stack([0.1 * K, 0.2 * K]))
    some = rows.select([3, 1])
    np.testing.assert_array_equal(some.shared("K")[1], 0.2 * triple(K)[[3, 1]])
    np.testing.assert_allclose(some.shared("B")[0], 0.1 * triple(K / 20)[[3, 1]], rtol=1e-12)
    assert without(rows).shared("K").shape == (0, len(K), 3)


def test_a_cause_that_some_rows_do_not_name_is_none_of_theirs():
    errors = [{"reflex": np.arange(12.0)}, {}, {"gain x": np.ones(12), "reflex": np.ones(12)}]
    fields = JointRows.shared_of(errors, 2)
    assert fields["stiffness_shared"].shape == (3, 2, 2, 2)
    np.testing.assert_array_equal(fields["stiffness_shared"][:, 0, 1, 1], [11, 0, 1])
    np.testing.assert_array_equal(fields["viscosity_shared"][:, 1, 0, 0], [0, 0, 1])
    assert JointRows.shared_of([{}, {}], 2) == {}
