"""What acts on the moving axis: the balance of torques, the window, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from arm_bench import REST_RAD, SEGMENTS, STIFFNESS, UPPER_ARM_M, Session, bench, repeated

from armimpedance.core.errors import InputError, RecordError
from armimpedance.joint.therapy.arm.movements import cut_movements, movement_torques
from armimpedance.joint.therapy.arm.passive_arm import Elastic, PassiveArm
from armimpedance.joint.therapy.robot.therapy_robot import load_torque


def arm(**changes) -> PassiveArm:
    elastic = tuple(
        Elastic(
            axis, k, -k * q, np.zeros((2, 2)), 4.0, np.array([0.0, 2.0]), np.zeros((2, 2)), 0.0,
            np.zeros(2), np.zeros((2, 15)),
        )
        for axis, k, q in zip(("elevation", "horizontal"), STIFFNESS, REST_RAD, strict=True)
    )  # fmt: skip
    given = {"subject": "S", "robot": "bench", "upper_arm_m": UPPER_ARM_M, "segments": SEGMENTS}
    return PassiveArm(**{**given, "elastic": elastic, **changes})


def test_nothing_is_left_for_the_user_where_the_arm_is_as_the_model_has_it():
    recording = repeated(Session(), times=1).recording()
    for torques in movement_torques(recording, bench(), arm()):
        moving = np.abs(torques.qd) > 0.05
        # the kernel rounds off the motor's torque, but not the arm's fourth-order curvature in time
        assert np.abs(torques.user[moving]).max() < 2e-3
        assert np.allclose(torques.support, torques.motor - torques.robot)
        assert np.abs(torques.motor).max() > 0.5


def test_without_stiffness_it_stays_in_the_support():
    recording = repeated(Session(), ("horizontal",), 1).recording()
    (torques,) = movement_torques(recording, bench(), arm(elastic=()))
    assert not torques.elastic.any()
    moving = np.abs(torques.qd) > 0.05
    line = STIFFNESS[1] * (torques.q - REST_RAD[1])
    assert np.abs((torques.user + line)[moving]).max() < 2e-3


def test_the_robots_torque_is_that_of_the_robot_adjusted_to_the_arm():
    recording = repeated(Session(), ("elevation",), 1).recording()
    long, short = (
        movement_torques(recording, bench(), arm(upper_arm_m=length))[0] for length in (0.4, 0.2)
    )
    # a forearm of 2 kg whose mass lies at .52 or .32 m: m g sin(q) dl + m d(l^2) qdd
    qdd = np.gradient(long.qd, long.time_s)
    more = 2 * (9.80665 * 0.2 * np.sin(long.q) + (0.52**2 - 0.32**2) * qdd)
    assert np.allclose(long.robot - short.robot, more, atol=0.01)


def test_the_gradient_predicts_another_theta():
    recording = repeated(Session(), ("horizontal",), 1).recording()
    robot = bench()
    (torques,) = movement_torques(recording, robot, arm())
    q, qd = np.zeros((2, len(torques.q), 3))
    q[:, 1], qd[:, 1] = torques.q, torques.qd
    loads = torques.robot_gradient @ robot.identified.theta
    assert np.allclose(loads, load_torque(robot, q, qd)[:, 1])


def test_the_window_is_the_tables():
    recording = Session().add("elevation", onset_s=1.0, end_s=2.0).recording()
    (movement,) = cut_movements(recording, bench())
    assert movement.motion.time_s[[0, -1]] == pytest.approx([1.0, 2.0])
    assert movement.notes == ()


@pytest.mark.parametrize("missing", [["onset_s"], ["end_s"], ["onset_s", "end_s"]])
def test_a_window_that_is_missing_is_detected_and_said(missing):
    recording = Session().add("horizontal").recording()
    table = recording.trials.drop(columns=[*missing, "axis", "movement"])
    (movement,) = cut_movements(recording.with_step("cut", trials=table), bench())
    assert movement.axis == 1
    assert movement.name == "horizontal"
    assert any("detected" in note for note in movement.notes)
    # 5 % of a minimum jerk's peak speed are reached within a tenth of its time
    assert movement.motion.time_s[[0, -1]] == pytest.approx([0.4, 4.9], abs=0.45)


def test_a_window_that_the_kernel_cuts_is_said():
    recording = Session().add("elevation", onset_s=0.0).recording()
    (movement,) = cut_movements(recording, bench())
    assert any("missing" in note for note in movement.notes)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"axis": 4}, "axis 4"),
        ({"axis": 1.5}, "axis 1.5"),
        ({"axis": "first"}, "'first'"),
        ({"onset_s": np.inf}, "inf"),
        ({"onset_s": 9.0, "end_s": 10.0}, "nothing recorded"),
        ({"onset_s": 2.0, "end_s": 1.0}, "nothing recorded"),
        ({"axis": 3, "onset_s": np.nan}, "does not move"),
    ],
)
def test_a_table_that_cannot_be_is_refused_in_one_line(columns, said):
    # What no table of trials may hold, the recording refuses itself.
    with pytest.raises((InputError, RecordError), match=said) as refused:
        movement_torques(Session().add("elevation", **columns).recording(), bench(), arm())
    assert "\n" not in str(refused.value)
    assert "expected" in str(refused.value)


def test_an_arm_of_another_robot_and_a_robot_of_other_axes_are_refused():
    recording = Session().add("elevation").recording()
    with pytest.raises(InputError, match="measured in the robot 'other'"):
        movement_torques(recording, bench(), arm(robot="other"))
    with pytest.raises(InputError, match="not known"):
        movement_torques(recording, bench(loads=None), arm())
    narrow = recording.with_step(
        "cut", position=recording.position[:, :2], force=recording.force[:, :2]
    )
    with pytest.raises(InputError, match="2 axes"):
        movement_torques(narrow, bench(), arm())
