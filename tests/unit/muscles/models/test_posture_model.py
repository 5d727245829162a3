"""A model over posture predicts, says where it was not measured, and survives a file."""

from __future__ import annotations

import copy
import json
from functools import cache

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import InputError, RecordError
from armimpedance.muscles.models.posture.fit import fit_posture_model
from armimpedance.muscles.models.posture.model import PostureModel
from armimpedance.muscles.models.posture.models import POSTURE_MODELS
from armimpedance.muscles.models.rows import JointRows

LOW, HIGH = np.array([0.3, 0.8]), np.array([1.6, 2.2])


def rows(seed=0, count=20, **options):
    rng = np.random.default_rng(seed)
    q = rng.uniform(LOW, HIGH, (count, 2))
    K = np.array([[15, 6], [6, 16.0]]) + rng.normal(0, 1, (count, 2, 2)) + q[:, :1, None]
    return JointRows(q, K, 0.1 * K, **options)


@cache
def fitted(name):
    """A model of each kind, and how far its fit was, each time it told."""
    told = []
    made = fit_posture_model(rows(), order=1, model=name, progress=lambda *step: told.append(step))
    return made, told


@pytest.fixture(params=list(POSTURE_MODELS))
def model(request):
    return fitted(request.param)[0]


@pytest.fixture
def plain_model():
    """A sum of squares as it is written to a file."""
    return fitted("sos")[0].as_plain()


def test_predictions_have_symmetric_positive_covariances(model):
    found = model.predict(rows().joint_angles)
    for covariance in (found.stiffness_covariance, found.viscosity_covariance):
        np.testing.assert_allclose(covariance, covariance.transpose(0, 2, 1))
        assert (np.linalg.eigvalsh(covariance) > -1e-12).all()
        assert (np.einsum("pii->pi", covariance) > 0).all()


def test_errors_grow_away_from_what_was_measured(model):
    centre = (LOW + HIGH) / 2
    away = centre + np.linspace(0, 3, 7)[:, None] * (HIGH - LOW)
    sd = model.predict(away).sd("stiffness")
    assert (np.diff(sd[1:, [0, 2]], axis=0) > 0).all()


def test_a_posture_outside_of_the_measured_ones_is_said_to_be():
    measured = rows()
    model = fit_posture_model(measured, order=1, box=np.stack([LOW - 1, HIGH + 1], axis=1))
    inside = model.predict(measured.joint_angles)
    assert not inside.extrapolated.any()
    assert set(inside.reasons) == {""}
    beyond = measured.joint_angles.max(axis=0) + np.deg2rad([20, 30])
    outside = model.predict(beyond)
    assert outside.extrapolated.all()
    assert "outside of what was measured" in outside.reasons[0]


def test_a_corner_of_the_ranges_that_no_posture_reached_is_outside():
    below = rows(count=60)
    triangle = below.select(((below.joint_angles - LOW) / (HIGH - LOW)).sum(axis=1) < 1)
    model = fit_posture_model(triangle, order=1)
    corners = model.predict([triangle.joint_angles.max(axis=0), triangle.joint_angles.min(axis=0)])
    assert corners.extrapolated[0]
    assert model.scaling.scaled(triangle.joint_angles.max(axis=0)) == pytest.approx([1, 1])


def test_one_posture_or_many_and_nothing_else():
    model = fit_posture_model(rows(), order=1)
    one, many = model.predict([1.0, 1.5]), model.predict([[1.0, 1.5], [1.1, 1.2]])
    np.testing.assert_array_equal(one.stiffness[0], many.stiffness[0])
    for wrong in ([1.0], [[1.0, 2.0, 3.0]], [np.nan, 1.0], [[[1.0, 2.0]]]):
        with pytest.raises(RecordError):
            model.predict(wrong)


def test_the_default_is_free_below_order_two_and_a_sum_of_squares_from_there():
    assert [fit_posture_model(rows(), order=L).name for L in (0, 1, 2)] == [
        *("polynomial", "polynomial", "sos")
    ]


def test_quality_has_eight_elements_and_r_rises_with_the_order():
    fits = [fit_posture_model(rows(), order=L, model="polynomial") for L in (0, 1, 2)]
    names = [q.element for q in fits[0].quality]
    assert names == [f"{m}_{e}" for m in "KB" for e in ("ss", "se", "es", "ee")]
    for element in (0, 3, 4, 7):
        r, e = ([getattr(f.quality[element], n) for f in fits] for n in ("r", "e"))
        assert r[0] == 0
        assert np.all(np.diff(r) > 0)
        assert np.all(np.diff(e) < 0)


def test_a_file_gives_back_the_same_model(model):
    text = json.dumps(model.as_plain(), allow_nan=False)
    back = PostureModel.from_plain(json.loads(text))
    assert back.as_plain() == model.as_plain()
    q = np.random.default_rng(1).uniform(LOW - 1, HIGH + 1, (30, 2))
    one, two = model.predict(q), back.predict(q)
    np.testing.assert_array_equal(one.stiffness, two.stiffness)
    np.testing.assert_array_equal(one.viscosity_covariance, two.viscosity_covariance)
    assert one.reasons == two.reasons
    assert back.stiffness.certificate.promise == model.stiffness.certificate.promise


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("name",), 3),
        (("order",), 2),
        (("order",), "1"),
        (("scaling", "box"), [[1, 0], [0, 1]]),
        (("scaling", "box"), "wide"),
        (("dof",), 0),
        (("dof",), True),
        (("dof",), "many"),
        (("stiffness",), None),
        (("stiffness", "coefficients"), [[1, 2, 3]]),
        (("stiffness", "coefficients"), [[1, 2], [3]]),
        (("viscosity", "covariance"), [[1.0]]),
        (("stiffness", "certificate", "at"), [0]),
        (("stiffness", "certificate", "grams"), [{"Q": [[1]]}]),
        (("region", "vertices"), []),
        (("region", "tolerance"), -1),
        (("quality",), [{"element": "K_ss"}]),
        (("summary",), {}),
    ],
)
def test_a_file_with_nonsense_is_refused_in_one_line(plain_model, path, value):
    plain = copy.deepcopy(plain_model)
    place = plain
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    with pytest.raises(InputError) as caught:
        PostureModel.from_plain(plain)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", ["name", "scaling", "dof", "stiffness", "quality", "summary"])
def test_a_file_with_a_field_missing_is_refused(plain_model, missing):
    plain = copy.deepcopy(plain_model)
    del plain[missing]
    with pytest.raises(InputError, match=missing):
        PostureModel.from_plain(plain)


@pytest.mark.parametrize("nothing", [None, [], "model", {}])
def test_what_is_no_model_is_refused(nothing):
    with pytest.raises(InputError, match="not a PostureModel"):
        PostureModel.from_plain(nothing)


def test_a_certificate_that_proves_something_else_is_refused(plain_model):
    plain = copy.deepcopy(plain_model)
    plain["stiffness"]["coefficients"][0][0] += 1
    with pytest.raises(InputError, match="prove nothing"):
        PostureModel.from_plain(plain)


def test_wrong_calls_are_told_what_was_expected():
    with pytest.raises(InputError, match=r"unknown posture model .spline. \(expected one of sos"):
        fit_posture_model(rows(), order=1, model="spline")
    with pytest.raises(InputError, match="moment arms of order 9"):
        fit_posture_model(rows(), order=9)
    with pytest.raises(InputError, match="seed -1"):
        fit_posture_model(rows(), order=1, seed=-1)
    with pytest.raises(InputError, match="no postures"):
        fit_posture_model(rows().select(np.zeros(20, dtype=bool)), order=1)
    with pytest.raises(InputError, match="row 1: shoulder at"):
        fit_posture_model(rows(), order=1, box=[[0.0, 0.1], [0.0, 3.0]])
    with pytest.raises(InputError):
        fit_posture_model(rows(), order=1, box=[0.0, 1.0])


@pytest.mark.parametrize("name", list(POSTURE_MODELS))
def test_progress_ends_when_all_is_done(name):
    done, total = np.array(fitted(name)[1]).T
    assert len(set(total)) == 1
    assert (np.diff(done) > 0).all()
    assert done[-1] == total[0]


def test_a_model_has_every_form_of_a_fit(model, tmp_path):
    for ending in ("csv", "xlsx", "mat", "json"):
        model.write(tmp_path / f"model.{ending}")
    values = [p.value for p in model.summary.parameters]
    np.testing.assert_allclose(pd.read_csv(tmp_path / "model.csv")["value"], values)
    assert len(json.loads((tmp_path / "model.json").read_text())["quality"]) == len(model.quality)
