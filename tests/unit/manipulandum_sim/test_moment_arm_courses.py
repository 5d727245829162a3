"""Arms whose stiffness changes with posture, those whose hardly does, and places of one's own."""

import json

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.core.errors import InputError
from armimpedance.recordings import open_recording
from manipulandum_sim.hand import Arm, SimulatedSubject, Truth, find_subject, find_truth, simulate
from manipulandum_sim.hand.experiments import EXPERIMENTS
from manipulandum_sim.hand.muscles import COURSES, human_paths, joint_basis


def moment_arms(muscle, joint, q1, q2):
    course = human_paths(COURSES["measured"])
    q1, q2 = np.broadcast_arrays(np.radians(q1), np.radians(q2))
    return np.abs(course.moment_arms(joint_basis(q1, q2))[joint][muscle])


@pytest.mark.parametrize(
    ("muscle", "joint", "low", "high", "ratio", "within"),
    [
        # -dL/dq of OpenSim's arm26 at both angles: (joint angles, m over m)
        (2, 1, 40, 110, 0.0239 / 0.0126, 0.12),
        (3, 1, 40, 105, 0.0198 / 0.0235, 0.05),
        (4, 1, 40, 96, 0.0494 / 0.0316, 0.05),
        (5, 0, 10, 90, 0.0214 / 0.0375, 0.15),
    ],
)
def test_courses_are_those_of_the_published_model(muscle, joint, low, high, ratio, within):
    angles = ((low, high), 90.0) if joint == 0 else (30.0, (low, high))
    first, last = moment_arms(muscle, joint, *angles)
    assert last / first == pytest.approx(ratio, rel=within)


def test_no_moment_arm_changes_its_sign_where_a_hand_can_be():
    q2 = np.linspace(2, 150, 75)
    for course in COURSES.values():
        for q1 in (-10, 40, 100):
            arms = human_paths(course).moment_arms(
                joint_basis(np.full_like(q2, np.radians(q1)), np.radians(q2))
            )
            for joint in arms:
                assert (np.sign(joint) == np.sign(joint[:, :1])).all()


def spread(subject):
    """Sum of squares of K_ss, K_se, K_ee about their means over the 20 postures."""
    person = find_subject(subject)
    places = EXPERIMENTS["postures"].conditions(person)
    K = find_truth(Arm.of(person), places, handle_mass_kg=0.0).K_j
    return ((K - K.mean(axis=0)) ** 2).sum(axis=0)[[0, 0, 1], [0, 1, 1]]


def test_the_spread_over_postures_is_of_the_source_s_size_and_the_control_s_is_not():
    # Tsuji (1997), Table 1: order 0 leaves 109, 28, 50, order 2 of it 5, 10, 2
    source = np.array([104.4, 17.9, 47.7])
    assert (np.abs(np.log(spread("A") / source)) < np.log(1.5)).all()
    assert (spread("A_alike") < 0.15 * source).all()


@pytest.mark.study
def test_both_are_the_same_arm_at_the_nominal_posture():
    level = ["cocontraction_10"]
    truths = [simulate("cocontraction", seed=1, sets=1, conditions=level, subject=s)[1]
              for s in ("A", "A_alike")]  # fmt: skip
    np.testing.assert_allclose(truths[0].G, truths[1].G, atol=1e-9)


@pytest.mark.study
def test_places_of_ones_own():
    places = {"near": (0.0, 0.3), "far": (0.05, 0.5)}
    recording, truth = simulate("postures", seed=1, sets=1, places=places)
    assert truth.conditions == ("near", "far")
    np.testing.assert_array_equal(truth.hand, [(0.0, 0.3), (0.05, 0.5)])
    assert sorted(set(recording.trials["condition"])) == ["far", "near"]
    with pytest.raises(InputError, match="reach"):
        simulate("postures", seed=1, sets=1, places=[(0.0, 2.0)])
    with pytest.raises(InputError, match="postures"):
        simulate("force", seed=1, sets=1, places=places)
    with pytest.raises(InputError, match="measured or alike"):
        SimulatedSubject("X", 70, 1.8, 0.3, 0.3, 1.0, "constant")


def test_the_command_takes_places_strength_and_a_subject_of_ones_own(tmp_path):
    me = {"mass_kg": 70, "height_m": 1.8, "upper_arm_m": 0.31, "forearm_hand_m": 0.35}
    (tmp_path / "me.json").write_text(json.dumps(me))
    out = tmp_path / "s"
    places = "--grid -0.1 0.1 3 0.3 0.4 2 --at 0 0.5"
    words = f"{places} --sets 1 --servo ideal --subject {tmp_path / 'me.json'}"
    call = ["simulate", "postures", *words.split(), "--out"]
    for strength in (1, 2):
        assert main([*call, str(out) + str(strength), "--strength", str(strength)]) == 0
    one, two = (Truth.read(f"{out}{strength}/truth.json") for strength in (1, 2))
    assert len(one.conditions) == 7
    assert open_recording(f"{out}1").subject.upper_arm_m == 0.31
    # at rest, where no muscle is needed to hold the arm
    assert two.muscle_stiffness.min() == pytest.approx(2 * one.muscle_stiffness.min())
    for wrong in ({"mass_kg": -1}, me | {"weight": 3}, me | {"height_m": "tall"}):
        (tmp_path / "me.json").write_text(json.dumps(wrong))
        assert main([*call, str(tmp_path / "no")]) == 2
    assert not (tmp_path / "no").exists()
