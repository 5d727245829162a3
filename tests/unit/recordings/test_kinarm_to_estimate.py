"""A lab's path: an exam as Dexterit-E writes it, converted and estimated from the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armimpedance.__main__ import main
from armimpedance.hand.show import read_results

SHOULDER, LENGTHS = (-0.1, 0.05), (0.31, 0.34)
RIGHT_HAND = np.array([-0.15, 0.45])


def link_angles(hand):
    """Both links' angles from the x axis, (S, 2), for hands (S, 2); the elbow to the right."""
    x, y = (hand - SHOULDER).T
    a, b = LENGTHS
    distance = np.hypot(x, y)
    first = np.arctan2(y, x) - np.arccos((a**2 + distance**2 - b**2) / (2 * a * distance))
    second = np.arctan2(y - a * np.sin(first), x - a * np.cos(first))
    return np.column_stack([first, second])


def exam_of(recording, exams, place):
    """The recording as an exam whose sensor holds the device's force."""
    trials = []
    for row in range(recording.n_trials):
        samples = recording.samples_of(row)
        hand = recording.position[samples] - recording.position[0] + RIGHT_HAND
        trials.append(
            exams.Trial(
                name=f"01_{row % 8 + 1:02d}_{row // 8 + 1:02d}.c3d",
                samples=len(hand),
                trial_num=row + 1,
                events=(("PERT_ON", 0.25), ("PERT_OFF", 0.55)),
                tp="push",
                links=link_angles(hand),
                forces=-recording.force[samples],
            )
        )
    robot = exams.Robot("KINARM_H1.2", SHOULDER, LENGTHS)
    return exams.zip(place / "exam.zip", exams.files(trials, robot))


@pytest.fixture(scope="module")
def recording(limb):
    return limb.record(sets=2)


def test_exam_to_hand_and_joint_impedance(recording, exams, limb, tmp_path, capsys):
    """Single precision in the file: within half a percent of the limb that made the exam."""
    exam = exam_of(recording, exams, tmp_path)
    session, hand, joint = (tmp_path / name for name in ("session", "hand.csv", "joint.csv"))
    call = ["convert", str(exam), str(session), "--force-by", "device", "--handle-mass-kg", "0.1"]
    events = ["--onset-event", "PERT_ON", "--end-event", "PERT_OFF"]
    assert main([*call, *events, "--upper-arm-m", "0.31", "--forearm-hand-m", "0.34"]) == 0
    assert main(["inspect", str(session)]) == 0
    assert main(["estimate", str(session), "--out", str(hand)]) == 0
    assert (
        main(["map", str(hand), "--recording", str(session), "--to", "joint", "--out", str(joint)])
        == 0
    )
    assert "Jane" not in json.dumps(json.loads((session / "recording.json").read_text()))
    (made,) = read_results(hand)
    for found, true in (
        (made.inertia_with_handle, limb.M),
        (made.inertia, limb.M - 0.1 * np.eye(2)),
        (made.viscosity, limb.B),
        (made.stiffness, limb.K),
    ):
        assert np.linalg.norm(found - true) < 0.005 * np.linalg.norm(true)
    (mapped,) = read_results(joint)
    q = link_angles(RIGHT_HAND[None])[0]
    assert mapped.joint_angles == pytest.approx([q[0], q[1] - q[0]], abs=1e-4)


def test_the_wrong_statement_about_the_force_is_stopped(recording, exams, tmp_path, capsys):
    exam = exam_of(recording, exams, tmp_path)
    assert main(["inspect", str(exam), "--force-by", "limb"]) == 2
    assert "force_by" in capsys.readouterr().err
