"""The planned calibration: its foretold error, its limits, and its table."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.app.cli.main import run as main
from armimpedance.core.errors import InputError
from armimpedance.core.records import Subject
from armimpedance.limb.arm import TwoLinkArm, arm_named, arm_of
from armimpedance.muscles.live import CalibrationWish, Workspace, holdable, plan_calibration
from armimpedance.muscles.live.calibration import _hand, _rows
from armimpedance.muscles.models import TypicalMuscles, matrix, typical_muscles
from armimpedance.recordings import write_recording
from manipulandum_sim.hand import IDEAL, simulate

MUSCLES = arm_named("planar6")
WHO = Subject(height_m=1.7, mass_kg=65.0)
SPACE = Workspace(np.radians([[20.0, 80.0], [60.0, 120.0]]))


def planned(**wish: float):
    return plan_calibration(MUSCLES, WHO, CalibrationWish(**wish), SPACE)


@pytest.fixture(scope="module")
def plan():
    return planned(error_percent=6.0)


@pytest.fixture(scope="module")
def typical() -> tuple[TypicalMuscles, TwoLinkArm]:
    arm = arm_of(WHO)
    offered = holdable(arm, MUSCLES, *SPACE.candidates(2))
    made = typical_muscles(MUSCLES, offered.joint_angles, offered.activation, moment_arm_order=1)
    return made, arm


def test_each_condition_lowers_the_error_down_to_what_activations_make(plan):
    assert (np.diff(plan.expected_percent) < 0).all()
    assert plan.met
    assert plan.expected_percent[-2] > 6.0 >= plan.expected_percent[-1] > plan.floor_percent


def test_the_foretold_error_is_that_of_the_inverse_of_all_information(plan, typical):
    made, arm = typical
    J, R = _rows(made, plan.conditions, plan.wish, (0, 1))
    places = SPACE.places(2, np.random.default_rng(0), 60)
    asked = holdable(arm, MUSCLES, *places)
    S, alone = _hand(made, asked, arm, plan.wish, (0, 1))
    p = J.shape[2]
    information = np.einsum("cep,cef,cfq->pq", J, np.linalg.inv(R), J)
    C = np.linalg.inv(information + np.diag(made.prior_sd[:p] ** -2.0))
    error = 100 * np.sqrt(np.trace(S @ C[: len(S), : len(S)]) + alone)
    assert error == pytest.approx(plan.expected_percent[-1], rel=1e-6)


def test_what_parameters_do_to_the_hand_is_what_the_hand_does(typical):
    made, arm = typical
    asked = holdable(arm, MUSCLES, *SPACE.places(2, np.random.default_rng(3), 10))
    S, _ = _hand(made, asked, arm, CalibrationWish(), (0, 1))
    form = made.equations.at(asked.joint_angles, asked.activation)

    def hands(x: np.ndarray) -> np.ndarray:
        found = []
        for q, F, K in zip(asked.joint_angles, asked.force, form.stiffness(x)[0], strict=True):
            inverse = np.linalg.inv(arm.jacobian(q))
            bend = np.tensordot(F, arm.jacobian_derivative(q), 1)
            found.append(inverse.T @ (matrix(K) + bend + arm.gravity_gradient(q)) @ inverse)
        return np.array(found)

    x, rng = made.values, np.random.default_rng(1)
    for _ in range(3):
        step = 1e-5 * rng.normal(size=len(S)) * made.prior_sd[: len(S)]
        moved = x.copy()
        moved[: len(S)] += step
        change = np.linalg.norm(hands(moved) - hands(x), axis=(1, 2))
        share = (change / np.linalg.norm(hands(x), axis=(1, 2))) ** 2
        assert step @ S @ step == pytest.approx(share.mean(), rel=1e-3)


@pytest.mark.study
def test_better_measurements_and_activations_need_less(plan):
    assert len(planned(error_percent=6.0, condition_percent=3.0).conditions) < len(plan.conditions)
    exact = planned(error_percent=6.0, activation_percent=1e-3)
    assert len(exact.conditions) < len(plan.conditions)
    assert exact.floor_percent < 1e-3


def test_time_is_kept_and_what_it_does_not_reach_is_said():
    plan = planned(error_percent=1.0, minutes=1.0, condition_s=15.0)
    assert len(plan.conditions) == 4
    assert plan.minutes == 1.0
    assert not plan.met


def test_conditions_bear_their_force(plan):
    arm, at = arm_of(WHO), plan.conditions
    for q, F, alpha in zip(at.joint_angles, at.force, at.activation, strict=True):
        torque = -MUSCLES.paths.moment_arms(q).T @ (alpha * MUSCLES.max_tension)
        assert torque == pytest.approx(arm.posture(q).torque_under(F), abs=1e-6)


@pytest.mark.parametrize(
    "wrong", [{"error_percent": 0.0}, {"minutes": np.nan}, {"condition_s": 400}]
)
def test_a_wish_that_nobody_can_have_is_refused(wrong):
    with pytest.raises(InputError):
        CalibrationWish(**wrong)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan") / "session"
    recording, _ = simulate(
        "cocontraction", seed=1, sets=1, conditions=["cocontraction_10"], servo=IDEAL
    )
    write_recording(recording, folder)
    return folder


def test_the_command_writes_conditions(session, tmp_path, capsys):
    box = ["--box-deg", "20", "80", "60", "120"]
    call = ["plan", "--live", "planar6", "--recording", str(session), *box]
    assert main([*call, "--out-calibration", str(tmp_path / "cal.csv")]) == 0
    table = pd.read_csv(tmp_path / "cal.csv")
    assert table["expected_percent"].is_monotonic_decreasing
    assert np.degrees(table["q_elbow_rad"]).between(60 - 1e-6, 120 + 1e-6).all()
    assert "foretold" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("extra", "told"),
    [
        (["--error-percent", "2"], "cannot be met"),
        (["--box-deg", "20", "80"], "--box-deg"),
        (["--box-deg", "20", "80", "60", "170"], "within the moment arms'"),
        (["--levels", "0"], "--levels"),
        (["--k-percent", "5"], "--k-percent"),
        (["--elbow", "held"], "elbow"),
    ],
)
def test_what_cannot_be_planned_is_told_in_one_line(session, capsys, extra, told):
    call = ["plan", "--live", "planar6", "--recording", str(session), *extra]
    assert main(call) == 2
    error = capsys.readouterr().err.strip()
    assert told in error
    assert "\n" not in error


def test_options_of_a_calibration_belong_to_it(capsys):
    assert main(["plan", "--minutes", "3"]) == 2
    assert "--live" in capsys.readouterr().err
