"""A robot, an arm and movements in closed form, with errors drawn as the analysis believes them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from armimpedance.core.records import Recording, Subject
from armimpedance.core.skeleton import Hinge, Segment, Skeleton
from armimpedance.joint.therapy.arm.movements import MovementTorques
from armimpedance.joint.therapy.arm.passive_arm import (
    ArmSegment,
    Elastic,
    PassiveArm,
    Reference,
    arm_bodies,
)
from armimpedance.joint.therapy.robot.therapy_robot import (
    Loads,
    TherapyRobot,
    load_gradient,
    load_torque,
    parameter_count,
    robot_bodies,
)

AXES = ("elevation", "horizontal", "rotation", "elbow", "pronation")
P = parameter_count(5)
RATE = 1000.0
#: Axis, from, to (rad), seconds.
MOVEMENTS = {
    "elevation": (0, np.deg2rad(45), np.deg2rad(110), 3.25),
    "horizontal": (1, 0.0, np.deg2rad(90), 4.5),
    "lowering": (0, np.deg2rad(110), np.deg2rad(45), 3.25),
}


def bench_robot(**changes) -> TherapyRobot:
    up, across = np.array([0.0, 0.0, 1.0]), np.array([0.0, -1.0, 0.0])
    chain = (
        ("column", "horizontal", up, 6.0, 0.0),
        ("shoulder", "elevation", across, 4.0, 0.0),
        ("upper_arm", "rotation", up, 3.0, 0.0),
        ("forearm", "elbow", across, 2.0, -0.30),
        ("wrist", "pronation", up, 1.0, -0.2),
    )
    parts, parent = [Segment("base", None, np.zeros(3))], "base"
    for name, hinge, axis, mass, drop in chain:
        place, com = np.array([0.0, 0.0, drop]), np.array([0.0, 0.02, -0.1])
        inertia = 0.01 * np.eye(3)
        parts.append(Segment(name, parent, place, (Hinge(hinge, axis),), mass, com, inertia))
        parent = name
    rng = np.random.default_rng(5)
    covariance = np.zeros((P, P))
    root = 0.02 * rng.normal(size=(P, P)) / np.sqrt(P)
    covariance += root @ root.T
    given = {
        "name": "bench",
        "axes": AXES,
        "skeleton": Skeleton(tuple(parts), floating=False),
        "limits_rad": np.tile([-2.0, 2.5], (5, 1)),
        "torque_limit_Nm": np.full(5, 59.5),
        "motor_inertia_kgm2": np.full(5, 0.05),
        "loads": Loads(rng.normal(0, 1, P), covariance, np.full(5, 0.02), dof=14.0),
    }
    return TherapyRobot(**{**given, **changes})


def bench_elastic(axis: str = "horizontal", **changes) -> Elastic:
    k, q_0 = {"elevation": (2.0, 0.3), "horizontal": (1.2, np.pi / 4)}[axis]
    rng = np.random.default_rng(len(axis))
    given = {
        "axis": axis,
        "stiffness": k,
        "offset": -k * q_0,
        "covariance": np.array([[4e-4, -2e-4], [-2e-4, 3e-4]]),
        "dof": 6.0,
        "range_rad": np.array([0.0, 2.0]),
        "between": np.array([[9e-4, -6e-4], [-6e-4, 9e-4]]),
        "noise_density": 2e-4,
        "mass_gradient": np.array([-0.8, 0.3]),
        "robot_gradient": 0.2 * rng.normal(size=(2, P)),
    }
    return Elastic(**{**given, **changes})


def bench_arm(**changes) -> PassiveArm:
    given = {
        "subject": "S",
        "robot": "bench",
        "upper_arm_m": 0.3,
        "segments": (
            ArmSegment("upper_arm", "upper_arm", 2.0, 0.13, 0.02),
            ArmSegment("forearm", "forearm", 1.4, 0.15, 0.02),
        ),
        "elastic": (bench_elastic("elevation"), bench_elastic("horizontal")),
    }
    return PassiveArm(**{**given, **changes})


def known_exactly(arm: PassiveArm, **changes) -> PassiveArm:
    """The same arm without any error."""
    zero = {"covariance": np.zeros((2, 2)), "between": np.zeros((2, 2)), "noise_density": 0.0}
    zero |= {"mass_gradient": np.zeros(2), "robot_gradient": np.zeros((2, P))}
    elastic = tuple(
        bench_elastic(e.axis, stiffness=e.stiffness, offset=e.offset, **zero) for e in arm.elastic
    )
    return bench_arm(**{"elastic": elastic, "mass_sd": 0.0, **changes})


def exact_robot() -> TherapyRobot:
    loads = bench_robot().identified
    return bench_robot(loads=Loads(loads.theta, np.zeros((P, P)), loads.rise_rad_s))


@dataclass(frozen=True)
class Errors:
    """What the stated parameters are off by: stated less true."""

    theta: np.ndarray
    mass: float
    line: np.ndarray
    noise: np.ndarray


def no_errors(samples: int) -> Errors:
    return Errors(np.zeros(P), 0.0, np.zeros(2), np.zeros(samples))


def drawn_errors(robot, arm, axis_name: str, samples: int, rng) -> Errors:
    """As the robot's and the arm's covariances say."""
    e = arm.elastic_of(axis_name)
    theta = rng.multivariate_normal(np.zeros(P), robot.identified.covariance, method="eigh")
    mass = arm.mass_sd * rng.normal()
    line = e.mass_gradient * mass + e.robot_gradient @ theta
    for C in (e.covariance, e.between):
        line = line + rng.multivariate_normal(np.zeros(2), C, method="eigh")
    noise = rng.normal(0, np.sqrt(e.noise_density * RATE), samples)
    return Errors(theta, mass, line, noise)


@dataclass(frozen=True)
class Motion:
    """Kinematics and stated torques of a movement, all axes."""

    axis: int
    q: np.ndarray
    qd: np.ndarray
    rigid: np.ndarray
    robot: np.ndarray
    inertia: np.ndarray
    gradient: np.ndarray


def motion(name: str, robot=None, arm=None, every: int = 1) -> Motion:
    """Minimum jerk about one axis; the arm at 60 degrees of elevation in the others."""
    robot, arm = robot or bench_robot(), arm or bench_arm()
    axis, start, end, seconds = MOVEMENTS[name]
    x = (np.arange(int(seconds * RATE) + 1) / (seconds * RATE))[::every]
    q, qd, qdd = np.zeros((3, len(x), 5))
    q[:, 0] = np.pi / 3
    q[:, axis] = start + (end - start) * (10 * x**3 - 15 * x**4 + 6 * x**5)
    qd[:, axis] = (end - start) * (30 * x**2 - 60 * x**3 + 30 * x**4) / seconds
    qdd[:, axis] = (end - start) * (60 * x - 180 * x**2 + 120 * x**3) / seconds**2
    needs = robot_bodies(robot).torque(q, qd, qdd) + load_torque(robot, q, qd)
    rigid = arm_bodies(robot, arm).torque(q, qd, qdd)
    gradient = load_gradient(robot, axis, q, qd)
    inertia = robot_bodies(robot).inertia_torque(q, qdd)[:, axis]
    return Motion(axis, q[:, axis], qd[:, axis], rigid[:, axis], needs[:, axis], inertia, gradient)


def true_arm(m: Motion, arm, errors: Errors) -> np.ndarray:
    e = arm.elastic_of(AXES[m.axis])
    k, offset = np.array([e.stiffness, e.offset]) - errors.line
    return (1 - errors.mass) * m.rigid + k * m.q + offset


def torques(m: Motion, arm, user, errors: Errors | None = None, **changes) -> MovementTorques:
    """What the analysis sees of a person with this true torque (S,)."""
    errors = errors or no_errors(len(m.q))
    e = arm.elastic_of(AXES[m.axis])
    robot = m.robot - m.gradient @ errors.theta
    motor = robot + true_arm(m, arm, errors) - user + errors.noise
    given = {
        "trial": "1",
        "condition": "half_active",
        "movement": AXES[m.axis],
        "axis": m.axis,
        "axis_name": AXES[m.axis],
        "sample_rate_hz": RATE,
        "time_s": np.arange(len(m.q)) / RATE,
        "q": m.q,
        "qd": m.qd,
        "motor": motor,
        "robot": m.robot,
        "rigid_arm": m.rigid,
        "elastic": e.stiffness * m.q + e.offset,
        "robot_inertia": m.inertia,
        "robot_gradient": m.gradient,
    }
    return MovementTorques(**{**given, **changes})


def helping(m: Motion, arm, share: float) -> MovementTorques:
    """A person who gives this share of what the arm needs, and no errors."""
    return torques(m, arm, share * true_arm(m, arm, no_errors(len(m.q))))


def samples(seen: MovementTorques, rows) -> MovementTorques:
    """Some samples of a movement."""
    names = (
        "time_s",
        "q",
        "qd",
        "motor",
        "robot",
        "rigid_arm",
        "elastic",
        "robot_inertia",
        "robot_gradient",
    )
    return replace(seen, **{name: getattr(seen, name)[rows] for name in names})


def counted(seen: MovementTorques) -> MovementTorques:
    """The samples in which the bench's axis moves."""
    return samples(seen, np.flatnonzero(np.abs(seen.qd) >= 0.05))


def reference(name: str, support, arm=None) -> Reference:
    axis, start, end, _ = MOVEMENTS[name]
    return Reference(name, AXES[axis], np.array(support), start, end)


def recording(robot, arm, shares, names=tuple(MOVEMENTS), seed=0, rest_s=0.2) -> Recording:
    """Trials in which a person gives these shares, with noise of torque and angle."""
    rng, position, force, rows = np.random.default_rng(seed), [], [], []
    own, carried = robot_bodies(robot), arm_bodies(robot, arm)
    for number, (name, share) in enumerate(zip(names, shares, strict=True), 1):
        axis, start, end, seconds = MOVEMENTS[name]
        x = np.clip((np.arange(int((seconds + 2 * rest_s) * RATE)) / RATE - rest_s) / seconds, 0, 1)
        q = np.zeros((len(x), 5))
        q[:, 0] = np.pi / 3
        q[:, axis] = start + (end - start) * (10 * x**3 - 15 * x**4 + 6 * x**5)
        qd = np.gradient(q, 1 / RATE, axis=0)
        state = q, qd, np.gradient(qd, 1 / RATE, axis=0)
        needs = carried.torque(*state)
        for e in arm.elastic:
            column = AXES.index(e.axis)
            needs[:, column] += e.stiffness * q[:, column] + e.offset
        motor = own.torque(*state) + load_torque(robot, q, qd) + (1 - share) * needs
        position.append(q + 2e-6 * rng.normal(size=q.shape))
        force.append(-motor - 0.05 * rng.normal(size=q.shape))
        rows.append(
            {"trial": number, "condition": "half_active", "movement": name, "axis": axis + 1}
            | {"onset_s": rest_s, "end_s": rest_s + seconds}
        )
    lengths = [len(q) for q in position]
    return Recording(
        "joint",
        RATE,
        pd.DataFrame(rows),
        np.concatenate([[0], np.cumsum(lengths)]),
        np.concatenate([np.arange(n) / RATE for n in lengths]),
        np.concatenate(position),
        np.concatenate(force),
        torque="commanded",
        subject=Subject("S", upper_arm_m=0.3),
    )
