"""Sound files of a therapy robot and of a session in it, made without any simulation of control."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from armimpedance.__main__ import main
from armimpedance.core.records import Recording, Subject
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm, arm_bodies, segments_of
from armimpedance.joint.therapy.robot.therapy_robot import (
    Loads,
    load_torque,
    parameter_count,
    robot_bodies,
)
from armimpedance.joint.therapy.show.models_json import write_robot
from armimpedance.lab.simulated.therapy import drawings_of
from armimpedance.recordings.tables.folder import write_folder
from manipulandum_sim.therapy.device import therapy_device

RATE = 1000.0
DRAWINGS = drawings_of(therapy_device())
#: Coulomb and viscous friction, cables' stiffness and offset, of all five axes.
LOADS = ((8.0, 7.0, 0.0, 0.0), (1.2, 1.5, 0.9, -0.6), *3 * ((1.0, 0.7, 0.8, -0.1),))
SPRING = (-3.0, -12.0, 4.0)
#: Of the moving axis of a person's arm.
STIFFNESS, REST_RAD = 5.0, 1.0
PERSON = Subject("S", mass_kg=70.0, upper_arm_m=0.3, forearm_hand_m=0.35)
PIPE = ("--pipe", "1.8,0.32,0.10")
MIDDLE_RAD = np.array([1.2, 0.5, 0.0, 1.0, 0.0])


def truth():
    theta = np.zeros(parameter_count(5))
    theta[:-3], theta[-3:] = np.ravel(LOADS), SPRING
    zero = np.zeros((len(theta), len(theta)))
    return replace(DRAWINGS, loads=Loads(theta, zero, np.full(5, 0.005)))


def recorded(trials, subject, arm=None, elastic=True):
    """A recording of trials (t, q, qd, qdd, row): what the motors give without any control."""
    robot, rng, motor = truth(), np.random.default_rng(0), []
    if arm is not None:
        robot = robot.adjusted_to(arm.upper_arm_m)
    own, carried = robot_bodies(robot), None if arm is None else arm_bodies(robot, arm)
    for _, q, qd, qdd, row in trials:
        torque = own.torque(q, qd, qdd) + load_torque(robot, q, qd)
        if carried is not None:
            needs, axis = carried.torque(q, qd, qdd), row["axis"] - 1
            needs[:, axis] += elastic * STIFFNESS * (q[:, axis] - REST_RAD)
            torque += needs * (0.5 if row["condition"] == "half_active" else 1.0)
        motor.append(torque + 0.02 * rng.standard_normal(torque.shape))
    table = pd.DataFrame([row for *_, row in trials])
    table.insert(0, "trial", np.arange(1, len(table) + 1))
    return Recording(
        kind="joint",
        sample_rate_hz=RATE,
        trials=table,
        offsets=np.cumsum([0, *(len(t) for t, *_ in trials)]),
        time_s=np.concatenate([t for t, *_ in trials]),
        position=np.concatenate([q for _, q, *_ in trials]),
        force=-np.concatenate(motor),
        torque="commanded",
        subject=subject,
    )


def steady(axis, start_rad, speed_rad_s, **row):
    t = np.arange(401) / RATE
    q, qd = np.tile(MIDDLE_RAD, (len(t), 1)), np.zeros((len(t), 5))
    q[:, axis], qd[:, axis] = start_rad + speed_rad_s * (t - 0.2), speed_rad_s
    return t, q, qd, np.zeros_like(q), {**row, "axis": axis + 1, "onset_s": 0.0, "end_s": 0.4}


def calibration():
    """Sweeps at four speeds, both ways; holds at five angles, from both sides."""
    sweeps = [
        steady(axis, MIDDLE_RAD[axis] + place, sign * speed, condition="sweep")
        for axis in range(5)
        for speed, place in ((0.2, -0.2), (0.4, 0.1), (0.7, 0.2), (1.0, -0.1))
        for sign in (1, -1)
    ]
    holds = [
        steady(0, angle, 0.0, condition="hold", approach=approach)
        for angle in (0.9, 1.1, 1.3, 1.5, 1.7)
        for approach in (1, -1)
    ]
    return recorded([*sweeps, *holds], Subject("empty"))


def lifted(condition, axis=0, seconds=1.5):
    """Minimum jerk over a radian, at rest before and after it."""
    t = np.arange(round(1000 * (seconds + 0.4)) + 1) / RATE
    s = np.clip((t - 0.2) / seconds, 0, 1)
    q, qd, qdd = np.tile(MIDDLE_RAD, (len(t), 1)), np.zeros((len(t), 5)), np.zeros((len(t), 5))
    q[:, axis] = 0.8 + 10 * s**3 - 15 * s**4 + 6 * s**5
    qd[:, axis] = (30 * s**2 - 60 * s**3 + 30 * s**4) / seconds
    qdd[:, axis] = (60 * s - 180 * s**2 + 120 * s**3) / seconds**2
    row = {"condition": condition, "movement": DRAWINGS.axes[axis], "axis": axis + 1}
    return t, q, qd, qdd, row | {"onset_s": 0.2, "end_s": 0.2 + seconds}


def session():
    """Three passive repetitions of a person, and one who carries half."""
    arm = PassiveArm("S", DRAWINGS.name, 0.3, segments_of(PERSON))
    trials = [lifted(c) for c in ("passive", "passive", "passive", "half_active")]
    return recorded(trials, PERSON, arm)


@dataclass(frozen=True)
class Bench:
    """Sound files, and the recordings that they hold."""

    folder: Path
    calibration: Recording
    session: Recording

    def call(self, command, *options, **given):
        """Arguments of a command on the sound files, some of them replaced."""
        files = {name: given.get(name, self.folder / f"{name}.json") for name in ("robot", "arm")}
        ending = "csv" if command == "contribution" else "json"
        out = ("--out", given.get("out", f"out.{ending}"))
        if command == "robot":
            drawings = given.get("drawings", self.folder / "drawings.json")
            recording = given.get("recording", self.folder / "calibration")
            return ("therapy", "robot", recording, "--drawings", drawings, *out, *options)
        recording = given.get("recording", self.folder / "session")
        known = ("--robot", files["robot"], *(("--arm", files["arm"]) * (command != "arm")))
        return ("therapy", command, recording, *known, *out, *options)


def bench_in(folder: Path) -> Bench:
    """Write the files, and have the commands make the others of them."""
    made = Bench(folder, calibration(), session())
    write_folder(made.calibration, folder / "calibration")
    write_folder(made.session, folder / "session")
    write_robot(DRAWINGS, folder / "drawings.json")
    for command in ("robot", "arm", "contribution"):
        out = folder / f"{command}.{'csv' if command == 'contribution' else 'json'}"
        assert main([str(a) for a in made.call(command, out=out)]) == 0
    return made
