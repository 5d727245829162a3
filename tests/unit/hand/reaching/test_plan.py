"""A plan of pushes: against what an experiment then finds, and against its own laws."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from reaching_sessions import one_phase

import armimpedance as ai
from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.reaching import identify_movement
from armimpedance.hand.reaching.push_plan import SHAPES, respond_to
from armimpedance.recordings import write_recording
from manipulandum_sim.movement import simulate_movement


@cache
def pilot() -> Recording:
    """Two pushes of each direction, and twenty reaches without any."""
    recording, _ = one_phase()
    pushed = recording.trials.groupby("push_deg").head(2).index
    free = recording.trials.index[recording.trials["phase"] == ""][:20]
    return recording.select(np.sort([*pushed, *free]))


@pytest.mark.study
def test_an_experiment_finds_what_was_planned():
    made = ai.plan_movement(pilot(), max_force_n=10.0)
    planned = next(p for p in made.pushes if p.shape.name == "doublet of 2 x 60 ms")
    recording, _ = simulate_movement(seed=22, repeats=5, unperturbed=40, phases=(0.5,))
    (found,) = identify_movement(recording)
    # 95 % of a sum of four squares lies below some 1.6 to 2 of its root mean
    own = 100 * 1.8 * np.linalg.norm(found.sd[2]) / np.linalg.norm(found.stiffness)
    # sixteen trials tell the arm to a fifth, and scatter of trials to a quarter
    assert 0.5 * own < planned.k_percent < 2 * own


@pytest.mark.study
def test_a_larger_push_needs_fewer_trials_and_a_smaller_error_more():
    few = ai.plan_movement(pilot(), max_force_n=12.0, max_displacement_m=0.012)
    many = ai.plan_movement(pilot(), max_force_n=6.0, max_displacement_m=0.006)
    for shape in SHAPES:
        by_plan = [
            next(p for p in plan.pushes if p.shape == shape).k_percent for plan in (few, many)
        ]
        assert by_plan[0] < by_plan[1]
    finer = ai.plan_movement(pilot(), k_percent=5.0)
    assert finer.pushes[0].trials > ai.plan_movement(pilot()).pushes[0].trials
    assert [p.k_percent for p in finer.pushes] == sorted(p.k_percent for p in finer.pushes)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_an_answer_obeys_its_equation(shape):
    M, B = np.array([[1.5, -0.7], [-0.7, 1.1]]), np.array([[13.0, -7.0], [-3.0, 25.0]])
    K = np.array([[231.0, -85.0], [-73.0, 361.0]])
    lag = np.arange(0.0, 0.3, 0.001)
    made = respond_to(shape, np.stack([M, B, K]), 1.2, (10.0, 0.01), lag)
    # velocities are the slopes of places: steps of 1 ms, changes over some 20 ms
    slope = np.gradient(made.displacement, 0.001, axis=1)[:, 2:-2]
    assert np.abs(slope - made.velocity[:, 2:-2]).max() < 0.02 * np.abs(slope).max()
    assert made.displacement_m < 0.01 * (1 + 1e-9)
    if shape.kind == "force":
        x, v, a = made.displacement, made.velocity, made.acceleration
        push = a @ (M + 1.2 * np.eye(2)).T + v @ B.T + x @ K.T
        size = np.hypot(push[..., 0], push[..., 1])
        assert size.max() < 10.0 * (1 + 1e-9)
        assert np.allclose(size.max(axis=1), size.max(), rtol=1e-6)


@pytest.mark.parametrize(
    "asked",
    [{"k_percent": 0.0}, {"phase": "30%"}, {"robot_kg": -1.0}, {"max_force_n": float("nan")}],
)
def test_what_cannot_be_planned_is_told(asked):
    with pytest.raises(InputError):
        ai.plan_movement(pilot(), **asked)


def test_the_commands_plan_estimate_and_refuse(tmp_path, capsys):
    write_recording(pilot(), tmp_path / "pilot")
    assert main(["plan", "--movement", str(tmp_path / "pilot")]) == 0
    out = str(tmp_path / "moving.csv")
    assert main(["movement", str(tmp_path / "pilot"), "--out", out]) == 0
    assert len(ai.read_results(out)) == 1
    assert main(["plan", "--movement", str(tmp_path / "pilot"), "--servo", "2000"]) == 2
    assert main(["movement", str(tmp_path / "pilot"), "--method", "predicted_path"]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 2
