"""Trials of one condition with two courses: each is expected from those that share its own."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from armimpedance.hand.still import check_response
from armimpedance.hand.still.modal import SharedCourse, expected_motion, modal_equation
from armimpedance.numerics.signals import cut_windows
from manipulandum_sim.hand import Servo, simulate_condition
from manipulandum_sim.hand.robot import IDEAL
from manipulandum_sim.space import simulate_space


def mixed(shapes=("designed", "reflex_separating"), seed=3):
    """A session whose trials have one course or the other."""
    parts = [
        simulate_condition(seed=seed + n, sets=3, emg=False, servo=IDEAL, disturbance=shape)[0]
        for n, shape in enumerate(shapes)
    ]
    first, second = parts
    table = pd.concat([first.trials, second.trials], ignore_index=True)
    table["trial"] = np.arange(1, len(table) + 1)
    return replace(
        first,
        trials=table,
        offsets=np.concatenate([first.offsets, second.offsets[1:] + first.offsets[-1]]),
        time_s=np.concatenate([first.time_s, second.time_s]),
        position=np.concatenate([first.position, second.position]),
        force=np.concatenate([first.force, second.force]),
        joint_angles=np.concatenate([first.joint_angles, second.joint_angles]),
    )


@pytest.mark.first_cases(1)
@pytest.mark.parametrize(
    "shapes", [("designed", "reflex_separating"), ("minimum_jerk", "designed")]
)
def test_trials_of_two_courses_are_expected_each_from_its_own(shapes):
    recording = mixed(shapes)
    equation = modal_equation(cut_windows(recording))
    expected = expected_motion(equation).reshape(equation.motion.shape)
    apart = np.linalg.norm(expected[:, 2] - equation.motion[:, 2], axis=(1, 2))
    assert (apart < 0.05 * np.linalg.norm(equation.motion[:, 2], axis=(1, 2))).all()
    # and nothing departs from M, B and K
    for one in check_response(recording):
        if one.name in ("delay", "reflex", "amplitude", "friction", "voluntary"):
            assert one.verdict == "ok", one


@pytest.mark.first_cases(1)
@pytest.mark.parametrize("servo", [1000.0, 3000.0, 20_000.0])
def test_trials_of_one_course_behind_a_soft_servo_stay_together(servo):
    recording, _ = simulate_condition(seed=4, sets=2, emg=False, servo=Servo(servo))
    assert len(SharedCourse.of(modal_equation(cut_windows(recording))).groups) == 1


@pytest.mark.study
def test_a_hand_that_the_person_moves_is_not_split():
    recording, _ = simulate_space(seed=1, sets=4, control="force")
    shared = SharedCourse.of(modal_equation(cut_windows(recording)))
    assert shared is None or len(shared.groups) == 1
