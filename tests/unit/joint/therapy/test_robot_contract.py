"""The therapy robot, the arm that it carries and the kernel: laws of the contract types."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from armimpedance.core.errors import ArmImpedanceError, InputError, RecordError
from armimpedance.core.records import Recording
from armimpedance.core.skeleton import GRAVITY_M_S2, Hinge, Segment, Skeleton
from armimpedance.joint.therapy.arm.passive_arm import (
    ArmSegment,
    Elastic,
    PassiveArm,
    Reference,
    arm_bodies,
    arm_skeleton,
    winter_segments,
)
from armimpedance.joint.therapy.robot.steady import WIDTH_S, kernels_for, smooth_trials
from armimpedance.joint.therapy.robot.therapy_robot import (
    Loads,
    TherapyRobot,
    friction_sign,
    load_gradient,
    load_torque,
    parameter_count,
    parameter_names,
    parameter_units,
    robot_bodies,
)
from armimpedance.joint.therapy.show.models_json import read_arm, read_robot, write_arm, write_robot

AXES = ("elevation", "horizontal", "rotation", "elbow", "pronation")
FLEXION, UP = (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)
#: Two pipes: mass, length, diameter, as in Guidali (2013), Fig. 4.
PIPES = ((1.8, 0.32, 0.10), (1.7, 0.30, 0.09))


def skeleton(upper_arm_m: float = 0.30, masses=(0.0, 6.0, 4.0, 3.0, 2.0, 1.0)) -> Skeleton:
    """A chain base, column, shoulder, upper arm, forearm, wrist."""
    ball = 0.01 * np.eye(3)
    down = np.array([0.0, 0.0, -0.1])
    names = ("base", "column", "shoulder", "upper_arm", "forearm", "wrist")
    hinges = (None, UP, FLEXION, UP, FLEXION, UP)
    axes = (None, "horizontal", "elevation", "rotation", "elbow", "pronation")
    origins = (0.0, 0.0, 0.0, 0.0, -upper_arm_m, -0.2)
    parts = []
    for i, name in enumerate(names):
        own = () if i == 0 else (Hinge(axes[i], np.array(hinges[i])),)
        place = np.array([0.0, 0.0, origins[i]])
        parent = None if i == 0 else names[i - 1]
        inertia = np.zeros((3, 3)) if i == 0 else ball
        parts.append(Segment(name, parent, place, own, masses[i], down, inertia))
    return Skeleton(tuple(parts), floating=False)


def robot(**changes) -> TherapyRobot:
    n, rng = 5, np.random.default_rng(3)
    theta = rng.normal(0, 1, parameter_count(n))
    loads = Loads(theta, 1e-4 * np.eye(len(theta)), np.full(n, 0.02))
    given = {
        "name": "bench",
        "axes": AXES,
        "skeleton": skeleton(),
        "limits_rad": np.tile([-2.0, 2.0], (n, 1)),
        "torque_limit_Nm": np.full(n, 59.5),
        "motor_inertia_kgm2": np.full(n, 0.05),
        "loads": loads,
    }
    return TherapyRobot(**{**given, **changes})


def pipes() -> tuple[ArmSegment, ...]:
    found = []
    for (mass, length, diameter), link in zip(PIPES, ("upper_arm", "forearm"), strict=True):
        across = mass * (length**2 / 12 + (diameter / 2) ** 2 / 2)
        found.append(ArmSegment(link, link, mass, length / 2, across, mass * (diameter / 2) ** 2))
    return tuple(found)


def elastic(axis: str = "elevation", p: int = 23) -> Elastic:
    return Elastic(
        axis,
        4.0,
        -4.8,
        0.01 * np.eye(2),
        2.0,
        np.array([0.8, 1.9]),
        0.01 * np.eye(2),
        0.1,
        np.array([1.0, 2.0]),
        np.ones((2, p)),
    )


def test_the_mock_up_weighs_what_the_source_measured():
    """10.66 N m at 90 degrees of elevation, .450 kg m^2 about the vertical (Guidali, Fig. 4)."""
    machine = robot().adjusted_to(0.32)
    bodies = arm_bodies(machine, PassiveArm("pipes", "bench", 0.32, pipes()))
    q, still = np.array([np.pi / 2, 0.3, 0.0, 0.0, 0.0]), np.zeros(5)
    assert bodies.torque(q, still, still)[0] == pytest.approx(10.66, rel=2e-3)
    unit = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    assert bodies.torque(q, still, unit)[1] == pytest.approx(0.450, rel=0.01)


def test_weight_is_the_slope_of_potential_energy():
    machine, rng = robot(), np.random.default_rng(0)
    bodies = robot_bodies(machine)
    place = [machine.axes.index(name) for name in machine.skeleton.coordinates]

    def height_energy(q):
        from manipulandum_sim.tree_dynamics import move

        motion = move(machine.skeleton, q[place][None])
        energy = 0.0
        for i, segment in enumerate(machine.skeleton.segments):
            centre = motion.origin[i, 0] + motion.rotation[i, 0] @ segment.com_m
            energy += segment.mass_kg * GRAVITY_M_S2 * centre[2]
        return energy

    q, still, step = rng.uniform(-1, 1, 5), np.zeros(5), 1e-6
    slopes = [
        (height_energy(q + step * e) - height_energy(q - step * e)) / (2 * step) for e in np.eye(5)
    ]
    assert bodies.torque(q, still, still) == pytest.approx(slopes, abs=1e-6)


def test_rotors_add_to_their_own_axis_alone():
    with_rotors, without = robot(), robot(motor_inertia_kgm2=np.zeros(5))
    q, still = np.linspace(0.1, 0.5, 5), np.zeros(5)
    for axis in range(5):
        qdd = np.eye(5)[axis]
        added = robot_bodies(with_rotors).torque(q, still, qdd)
        added -= robot_bodies(without).torque(q, still, qdd)
        assert added == pytest.approx(0.05 * qdd, abs=1e-12)


def test_one_sample_and_many_agree():
    machine, rng = robot(), np.random.default_rng(1)
    bodies, motion = robot_bodies(machine), rng.normal(0, 1, (3, 4, 5))
    many = bodies.torque(*motion)
    for i in range(4):
        assert (many[i] == bodies.torque(*motion[:, i])).all()


def test_segments_on_one_link_become_one_body():
    """Forearm and hand apart, as two links of a chain that is straight, weigh the same."""
    machine = robot()
    person = winter_segments(70.0, 0.30, 0.26, 0.18)
    together = arm_skeleton(machine.skeleton, person)
    forearm = together.segments[together.index("forearm")]
    own = [s for s in person if s.link == "forearm"]
    assert forearm.mass_kg == pytest.approx(sum(s.mass_kg for s in own))
    about_elbow = sum(s.inertia_kgm2 + s.mass_kg * s.com_m**2 for s in own)
    shifted = forearm.inertia_kgm2[0, 0] + forearm.mass_kg * forearm.com_m[2] ** 2
    assert shifted == pytest.approx(about_elbow)


def test_point_masses_weigh_the_same_and_turn_lighter():
    full = winter_segments(70.0, 0.30, 0.26, 0.18)
    points = winter_segments(70.0, 0.30, 0.26, 0.18, point_masses=True)
    assert [s.mass_kg for s in full] == [s.mass_kg for s in points]
    assert [s.com_m for s in full] == [s.com_m for s in points]
    assert all(s.inertia_kgm2 == 0 for s in points)
    assert all(s.inertia_kgm2 > 0 for s in full)
    # .028, .016, .006 of body mass
    assert sum(s.mass_kg for s in full) == pytest.approx(0.05 * 70.0)


def test_friction_is_odd_and_bounded_unlike_the_print():
    v = np.linspace(-3, 3, 601)
    law = friction_sign(v, 0.02)
    assert (law == -friction_sign(-v, 0.02)).all()
    assert np.abs(law).max() <= 1.0
    assert law[v > 0.2] == pytest.approx(1.0, abs=1e-4)
    printed = 1 - np.exp(-v / 0.02)
    assert printed.min() < -1e60


def test_loads_are_linear_in_theta():
    machine, rng = robot(), np.random.default_rng(2)
    q, qd = rng.normal(0, 1, (2, 6, 5))
    torque = load_torque(machine, q, qd)
    for axis in range(5):
        gradient = load_gradient(machine, axis, q, qd)
        assert gradient @ machine.identified.theta == pytest.approx(torque[:, axis], abs=1e-12)
    assert len(parameter_names(5)) == len(parameter_units(5)) == parameter_count(5)


def test_a_cable_pulls_to_no_side_at_its_rest():
    loads = robot().identified
    rest = loads.cable_rest_rad
    k, b = loads.term("cable_stiffness"), loads.term("cable_offset")
    assert k * rest + b == pytest.approx(np.zeros(5), abs=1e-12)


def test_adjusting_moves_all_beyond_the_elbow():
    longer = robot().adjusted_to(0.36)
    assert longer.upper_arm_m == 0.36
    q, still = np.array([np.pi / 2, 0, 0, 0, 0]), np.zeros(5)
    more = robot_bodies(longer).torque(q, still, still) - robot_bodies(robot()).torque(
        q, still, still
    )
    assert more[0] == pytest.approx(3.0 * 0.06 * GRAVITY_M_S2)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axes": ("elevation", "horizontal")}, "hinges"),
        ({"limits_rad": np.zeros((5, 2))}, "limits_rad"),
        ({"torque_limit_Nm": -np.ones(5)}, "torque limit"),
        ({"spring_axis": 7}, "spring_axis"),
    ],
)
def test_robots_that_cannot_be(changes, words):
    if "axes" in changes:
        changes |= {k: np.ones(2) for k in ("torque_limit_Nm", "motor_inertia_kgm2")}
        changes |= {"limits_rad": np.tile([-1.0, 1.0], (2, 1))}
    with pytest.raises(ArmImpedanceError, match=words):
        robot(**changes)


def test_loads_are_asked_for_in_words():
    with pytest.raises(InputError, match="armimpedance therapy robot"):
        load_torque(robot(loads=None), np.zeros((2, 5)), np.zeros((2, 5)))
    with pytest.raises(InputError, match=r"0\.15 to 0\.5 m"):
        robot().adjusted_to(300.0)


def test_robot_and_arm_come_back_from_disk_bit_by_bit(tmp_path):
    machine = robot()
    write_robot(machine, tmp_path / "robot.json")
    back = read_robot(tmp_path / "robot.json")
    assert back.axes == machine.axes
    assert (back.identified.theta == machine.identified.theta).all()
    assert back.identified.dof == float("inf")
    q = np.linspace(0.1, 0.5, 5)
    here, there = (robot_bodies(r).torque(q, q, q) for r in (machine, back))
    assert (here == there).all()
    write_robot(robot(loads=None), tmp_path / "drawings.json")
    assert read_robot(tmp_path / "drawings.json").loads is None
    reference = Reference("elevation", "elevation", np.array([9.0, 9.1, 9.2]), 0.8, 1.9)
    arm = PassiveArm("S1", "bench", 0.3, pipes(), (elastic(),), (reference,))
    write_arm(arm, tmp_path / "arm.json")
    again = read_arm(tmp_path / "arm.json")
    assert again.segments == arm.segments
    assert again.subject == "S1"
    assert (again.elastic[0].covariance == arm.elastic[0].covariance).all()
    assert again.elastic[0].rest_rad == pytest.approx(1.2)
    assert (again.references[0].support_Nm == reference.support_Nm).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{}", "format"),
        ('{"format": "armimpedance-arm", "version": 1, "arm": {}}', "format"),
        ('{"format": "armimpedance-robot", "version": 2}', "version"),
        ('{"format": "armimpedance-robot", "version": 1}', "robot"),
        ('{"format": "armimpedance-robot", "version": 1, "robot": {"name": 3}}', "robot"),
        ("not json", "JSON"),
    ],
)
def test_files_that_hold_no_robot(tmp_path, text, words):
    file = tmp_path / "robot.json"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as caught:
        read_robot(file)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def recording(q: np.ndarray, torque: np.ndarray, rate: float = 1000.0) -> Recording:
    table = pd.DataFrame({"trial": [1], "condition": ["passive"]})
    time = np.arange(len(q)) / rate
    return Recording("joint", rate, table, [0, len(q)], time, q, torque, torque="commanded")


def test_the_kernel_differentiates_cubic_motion_and_turns_the_torque_once():
    t = np.arange(400) / 1000
    weights = kernels_for(1000.0).smooth
    q = np.stack([0.3 + 0.5 * t - t**2 + 2 * t**3, np.sin(t)], axis=1)
    trial = smooth_trials(recording(q, -np.ones_like(q)))[0]
    # what is differentiated is the smoothed motion: phi * q' and phi * q''
    rate = np.convolve(0.5 - 2 * t + 6 * t**2, weights, "valid")
    assert trial.qd[:, 0] == pytest.approx(rate, abs=1e-9)
    assert trial.qdd[:, 0] == pytest.approx(-2 + 12 * trial.time_s, abs=1e-8)
    assert trial.motor == pytest.approx(np.ones_like(trial.motor))
    half = kernels_for(1000.0).half
    assert len(trial.time_s) == 400 - 2 * half
    assert half == pytest.approx(500 * WIDTH_S, abs=2)


def test_a_sample_depends_on_half_a_kernel_to_either_side_and_no_more():
    rng = np.random.default_rng(5)
    q, torque = rng.normal(0, 1, (2, 500, 2))
    whole = smooth_trials(recording(q, torque))[0]
    half = kernels_for(1000.0).half
    part = smooth_trials(recording(q[100 : 101 + 2 * half + 1], torque[100 : 101 + 2 * half + 1]))[
        0
    ]
    assert part.qdd[0] == pytest.approx(whole.qdd[100], rel=1e-12)
    assert part.motor[0] == pytest.approx(whole.motor[100], rel=1e-12)


def test_too_short_or_too_coarse_for_the_kernel():
    q = np.zeros((50, 2))
    with pytest.raises(InputError, match="trial 1 has 50 samples"):
        smooth_trials(recording(q, q))
    with pytest.raises(InputError, match="Hz or more"):
        smooth_trials(recording(q, q, rate=50.0))


def test_a_reference_without_a_repetition_is_refused():
    with pytest.raises(RecordError, match="repetition"):
        Reference("elevation", "elevation", np.array([]), 0.8, 1.9)
