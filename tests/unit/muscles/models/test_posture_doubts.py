"""What a model over posture doubts: a course it cannot follow, rows that scatter, the unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.rows import JointRows

SD = 0.5
GRID = np.stack(
    np.meshgrid(np.linspace(0.5, 1.6, 6), np.linspace(0.9, 2.1, 5), indexing="ij"), axis=-1
).reshape(-1, 2)


def stiffness(q, ripple=0.0):
    """Three muscles with moment arms linear in the angles, and a ripple over the elbow's."""
    s, e = (q - [1.05, 1.5]).T
    one, two = 1 + 0.3 * s, 1 - 0.4 * e + ripple * np.sin(6 * e)
    arms = np.stack(
        [np.stack([one, 0 * s], 1), np.stack([0 * s, two], 1), np.stack([one, two], 1)], axis=1
    )
    return np.einsum("m,pmi,pmj->pij", [14.0, 12.0, 6.0], arms, arms)


def rows(seed, ripple=0.0, factor=1.0, told=SD, q=GRID):
    """The factor multiplies K, row by row."""
    rng = np.random.default_rng(seed)
    K = stiffness(q, ripple) * np.broadcast_to(factor, len(q))[:, None, None]
    K, B = (
        M + (E + E.transpose(0, 2, 1)) / np.sqrt(2)
        for M, E in ((K, SD * rng.standard_normal(K.shape)), (K, SD * rng.standard_normal(K.shape)))
    )
    sd = np.full(K.shape, told)
    return JointRows(q, K, B, stiffness_sd=sd, viscosity_sd=sd)


def checks(made):
    """Names of those that warn."""
    return {one.name for one in made.summary.checks if one.verdict == "warning"}


def _untold(made):
    """Names of the checks that cannot tell."""
    return [one.name for one in made.summary.checks if one.verdict == "cannot tell"]


@pytest.mark.parametrize("seed", range(4))
def test_rows_that_obey_the_model_raise_nothing(seed):
    made = fit_posture_model(rows(seed, told=1.5 * SD), order=1, judged=False)
    assert not checks(made)
    assert {one.name for one in made.summary.checks} == {"lack of fit", "scatter", "units"}
    assert all(one.smallest for one in made.summary.checks if one.name != "units")


@pytest.mark.parametrize("told", [True, False])
def test_a_ripple_is_named_and_allowed_for_whether_errors_are_told_or_not(told):
    there = np.array([[0.9, 1.3], [1.2, 1.7], [0.8, 1.9]])
    true = stiffness(there, 0.3)[:, [0, 0, 1], [0, 1, 1]]
    for seed in range(5):
        given = rows(seed, ripple=0.3)
        if not told:
            given = replace(given, stiffness_sd=None, viscosity_sd=None)
        made = fit_posture_model(given, order=1, judged=False)
        assert "lack of fit" in checks(made)
        found = made.predict(there)
        assert (np.abs(found.stiffness - true) < 1.5 * found.half_width("stiffness")).all()


def test_a_course_that_a_higher_order_follows_is_none():
    given = rows(2, told=1.5 * SD)
    arms = 1 + 4 * (GRID[:, 1] - 1.5) ** 2
    bent = np.array([[15.0, 6.0], [6.0, 16.0]]) * arms[:, None, None] ** 2
    given = replace(given, stiffness=bent + given.stiffness - stiffness(GRID))
    assert "lack of fit" in checks(fit_posture_model(given, order=1, judged=False))
    higher = fit_posture_model(given, order=2, model="polynomial", judged=False)
    assert "lack of fit" not in checks(higher)


def test_a_person_who_is_not_equally_relaxed_scatters_without_a_course():
    factor = 1 + 0.2 * np.random.default_rng(5).standard_normal(len(GRID))
    made = fit_posture_model(rows(5, factor=factor, told=1.5 * SD), order=1, judged=False)
    assert checks(made) == {"scatter"}
    sentence = next(w for w in made.summary.warnings if w.startswith("scatter"))
    assert "no row stands out" in sentence


def test_one_wrong_row_is_named():
    factor = np.ones(len(GRID))
    factor[7] = 3.0
    made = fit_posture_model(rows(6, factor=factor, told=1.5 * SD), order=1, judged=False)
    said = [w for w in made.summary.warnings if w.startswith("scatter")]
    assert said
    assert "row 8: look at it first" in said[0]


def test_few_postures_cannot_tell():
    q = np.random.default_rng(7).uniform([0.5, 0.9], [1.6, 2.1], (9, 2))
    made = fit_posture_model(rows(7, q=q), order=1, judged=False)
    assert _untold(made) == ["lack of fit", "lack of fit"]


def test_no_course_is_promised_where_none_could_be_seen():
    # twenty places leave five numbers of an element over, of which a course takes all or none
    q = np.random.default_rng(7).uniform([0.5, 0.9], [1.6, 2.1], (20, 2))
    for ripple in (0.0, 30.0):
        given = rows(7, ripple=ripple, q=q)
        made = fit_posture_model(given, order=2, model="separable", judged=False)
        course = [c.verdict for c in made.summary.checks if c.name == "lack of fit"]
        assert "ok" not in course
    assert not _untold(fit_posture_model(rows(7), order=1, judged=False))


@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_stiffness_of_no_arm_is_named_by_its_unit(factor):
    given = rows(8)
    given = replace(
        given, stiffness=factor * given.stiffness, stiffness_sd=factor * given.stiffness_sd
    )
    assert "units" in checks(fit_posture_model(given, order=1, judged=False))
