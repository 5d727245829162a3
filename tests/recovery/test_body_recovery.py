"""A simulated person on two force plates: what the identification gives back."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from armimpedance.core.errors import NotIdentifiableError
from armimpedance.joint.body.base_parameters import base_parameters, essential_base_parameters
from armimpedance.joint.body.equations import body_equations
from armimpedance.joint.body.identify import identify_body
from armimpedance.joint.body.methods import METHODS
from armimpedance.joint.body.regressor import pseudo_inertias
from armimpedance.joint.body.rows import RowChoice
from manipulandum_sim.body.simulate import simulate_body

pytestmark = pytest.mark.study

MOTIONS = ("walk", "bending", "head_and_arms", "leg_swings", "all_joints")
STILL = {"angle_noise_rad": 0.0, "force_noise_N": 0.0, "moment_noise_Nm": 0.0}


@pytest.fixture(scope="module")
def exact():
    recording, truth = simulate_body(MOTIONS, seed=2, **STILL)
    phi = np.ravel(truth.parameters)
    base = essential_base_parameters(recording.skeleton)
    return SimpleNamespace(recording=recording, truth=truth, phi=phi, base=base, b=base.of(phi))


@pytest.fixture(scope="module")
def noisy(exact):
    """1 mrad, 1 N, .5 N m: plain least squares is then some 60 % wrong (median)."""
    rng = np.random.default_rng(11)
    q, w = exact.recording.coordinates, exact.recording.wrenches
    sd = np.concatenate([np.full(3, 2.5e-4), np.full(q.shape[1] - 3, 1e-3)])
    recording = replace(
        exact.recording,
        coordinates=q + sd * rng.standard_normal(q.shape),
        wrenches=w + np.repeat([1.0, 0.5], 3) * rng.standard_normal(w.shape),
    )
    return {method: identify_body(recording, method=method) for method in METHODS}


def median_error(found, exact):
    return float(np.median(np.abs(found.parameters.values / exact.b - 1)))


@pytest.mark.parametrize("method", ["weighted", "consistent"])
def test_exact_data_give_the_truth(exact, method):
    found = identify_body(exact.recording, choice=RowChoice(), method=method)
    assert found.base.rank == 128
    assert np.abs(found.parameters.values / exact.b - 1).max() < 1e-9


def test_a_few_motions_excite_all(exact):
    found = identify_body(exact.recording, choice=RowChoice())
    assert found.choice.conditions[-1] <= 16
    assert found.held_out is not None
    assert found.held_out.pooled_rms() < 1e-8


def test_all_rows_give_the_same_with_the_plates_under_the_feet_found(exact):
    recording = replace(exact.recording, torque=exact.truth.joint_torques)
    found = identify_body(recording, choice=RowChoice(rows="all"), motions=("walk", "all_joints"))
    assert np.abs(found.parameters.values / exact.b - 1).max() < 1e-9


def test_the_prior_is_worth_three_times_the_error(noisy, exact):
    errors = {method: median_error(found, exact) for method, found in noisy.items()}
    assert errors["prior"] <= 0.15
    assert errors["prior"] * 3 <= errors["ls"]
    assert errors["weighted"] <= errors["ls"]


def test_physical_consistency_costs_no_prediction(noisy):
    rms = {m: f.held_out.pooled_rms(f.held_out.moments) for m, f in noisy.items()}
    assert max(rms.values()) < 1.1 * rms["ls"]


def test_every_segment_is_possible_with_consistency_only(noisy):
    for method in ("consistent", "prior"):
        assert np.linalg.eigvalsh(pseudo_inertias(noisy[method].phi)).min() > 0
    assert noisy["weighted"].phi is None


@pytest.mark.parametrize(("motion", "rank"), [("pelvis_still", 121), ("static", 42)])
def test_what_a_still_pelvis_and_still_postures_show(motion, rank):
    recording, _ = simulate_body((motion,), seed=1, **STILL)
    equations = body_equations(recording, RowChoice())
    shown = base_parameters(
        equations.stacked()[:-1, :-1], equations.columns, equations.column_units
    )
    assert shown.rank == rank


def test_rounding_is_no_excitation():
    still, _ = simulate_body(("static",), **STILL)
    with pytest.raises(
        NotIdentifiableError, match="static excite too little: 42 of 128 parameters show"
    ) as told:
        identify_body(still, choice=RowChoice(), motions=None)
    assert len(told.value.parameters) >= 128 - 42
    shown = identify_body(still, choice=RowChoice(), motions=None, data_dependent=True)
    assert shown.base.rank == 42
