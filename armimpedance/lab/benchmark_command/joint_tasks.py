"""Tasks of joints: under a random torque or angle, relaxed, of a whole body, in a robot."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from armimpedance.lab.benchmark import AskedGroup
from armimpedance.lab.benchmark_command.task import COLUMNS, UNITS, DrawnJoint, Made, Task, scalar
from armimpedance.lab.parts.simulation import DRAWINGS_FILE

# One joint under a random torque.


def _draw_joint_torque(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_bench

        made, _ = simulate_bench(joint.I, joint.B, joint.K, snr_db=20.0, seed=seed)
        return {"recording": made}

    return Made(joint.groups, recordings)


# One joint in a stiff position servo, whose owner pushes against it.


def _draw_joint_position(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_servo

        made, _ = simulate_servo(joint.I, joint.B, joint.K, duration_s=20.0, seed=seed)
        return {"recording": made}

    return Made(joint.groups, recordings)


# One joint under a random torque, with a reflex.


def _draw_joint_reflex(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    share, delay_s = rng.uniform(0.1, 0.35), rng.uniform(0.04, 0.07)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import Departures, simulate_bench

        late = Departures(answer=share * joint.K, delay_s=delay_s)
        made, _ = simulate_bench(joint.I, joint.B, joint.K, snr_db=20.0, seed=seed, departures=late)
        return {"recording": made}

    return Made(joint.groups, recordings)


# One joint whose stiffness and viscosity go up and down under a random torque.

_SMOOTH_S: Final = 20.0


_SMOOTH_TIMES_S: Final = np.arange(1.0, 19.5, 1.0)


def _draw_joint_smooth(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    hz, phase, depth = rng.uniform(0.1, 0.6), rng.uniform(0, 2 * np.pi), rng.uniform(0.2, 0.5)

    def swing(time_s: np.ndarray, share: float) -> np.ndarray:
        return np.asarray(1 + share * np.sin(2 * np.pi * hz * time_s + phase))

    def stiffness(time_s: np.ndarray) -> np.ndarray:
        return joint.K * swing(time_s, depth)

    def viscosity(time_s: np.ndarray) -> np.ndarray:
        return joint.B * swing(time_s, depth / 2)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import simulate_bench

        made, _ = simulate_bench(
            joint.I,
            viscosity,
            stiffness,
            snr_db=25.0,
            duration_s=_SMOOTH_S,
            seed=seed,
        )
        return {"recording": made}

    B = AskedGroup.course("B", UNITS["B"], _SMOOTH_TIMES_S, viscosity(_SMOOTH_TIMES_S))
    K = AskedGroup.course("K", UNITS["K"], _SMOOTH_TIMES_S, stiffness(_SMOOTH_TIMES_S))
    return Made((scalar("I", joint.I), B, K), recordings)


# One joint whose stiffness switches, moved by a stiff servo, with a reflex.

_SQUARE_S: Final = 30.0


_SQUARE_TIMES_S: Final = np.arange(1.5, 29.0, 1.5)


def _draw_joint_square(seed: int) -> Made:
    rng = np.random.default_rng(seed)
    joint = DrawnJoint.of(rng)
    period_s, phase, ratio = rng.uniform(4, 8), rng.uniform(0, 1), rng.uniform(1.5, 3)
    gain, delay_s = joint.B * rng.uniform(0.3, 1.0), rng.uniform(0.035, 0.05)

    def stiffness(time_s: np.ndarray) -> np.ndarray:
        up = (time_s / period_s + phase) % 1 < 0.5
        return np.where(up, ratio * joint.K, joint.K)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.elbow import Reflex, simulate_cascade

        made, _ = simulate_cascade(
            joint.I,
            joint.B,
            stiffness,
            Reflex(gain, delay_s),
            own_Nm=0.2,
            duration_s=_SQUARE_S,
            seed=seed,
        )
        return {"recording": made}

    K = AskedGroup.course("K", UNITS["K"], _SQUARE_TIMES_S, stiffness(_SQUARE_TIMES_S))
    return Made((scalar("I", joint.I), scalar("B", joint.B), K), recordings)


# A relaxed elbow that is filmed while it swings.

_PASSIVE_UNITS: Final = {"k": "N m/rad", "h": "N m s/rad", "f": "N m"}


def _draw_relaxed_joint(seed: int) -> Made:
    from manipulandum_sim.passive import ELBOW, PASSIVE_SUBJECTS, passive_subject

    rng = np.random.default_rng(seed)
    low, high = np.array([[1.5, 0.015, 0.0, 1.3], [4.5, 0.06, 0.03, 1.6]])
    k, h, f, rest = (float(v) for v in rng.uniform(low, high))
    elbow = replace(PASSIVE_SUBJECTS["1"].joints[ELBOW], k=k, h=h, f=f, q_r=rest)
    person = passive_subject("person", rng.uniform(50, 95), rng.uniform(1.55, 1.95), elbow)

    def recordings() -> dict[str, Any]:
        from manipulandum_sim.passive import simulate_passive

        made, _ = simulate_passive("p5", subject=person, seed=seed, duration_s=15.0)
        return {"recording": made}

    def tell(folder: Path) -> None:
        (folder / "told.json").write_text(json.dumps({"rest_angle_rad": round(rest, 6)}) + "\n")

    values = {"k": k, "h": h, "f": f}
    groups = tuple(AskedGroup(n, _PASSIVE_UNITS[n], {n: v}) for n, v in values.items())
    return Made(groups, recordings, tell, body_told=True)


# Masses and inertias of a moving body, as far as motion and contact forces show them.

_GROUPS: Final = {"kg": "mass", "kg m": "first moment", "kg m^2": "inertia"}


_HEIGHT_M: Final = 1.741


#: As `BodyTruth.parameters` has them.
_OF_A_SEGMENT: Final = (
    "m",
    "mx",
    "my",
    "mz",
    "Ixx",
    "Ixy",
    "Iyy",
    "Ixz",
    "Iyz",
    "Izz",
)


@cache
def _base() -> Any:
    """`BaseParameters` of the root's wrench; the same bones for all, so the same for all."""
    from armimpedance.joint.body import essential_base_parameters
    from manipulandum_sim.body import body_subject

    return essential_base_parameters(body_subject("person", 70.0, _HEIGHT_M).table_skeleton)


def _draw_base_parameters(seed: int) -> Made:
    from manipulandum_sim.body import body_subject, simulate_body

    rng = np.random.default_rng(seed)
    mass, own = rng.uniform(50, 95), int(rng.integers(2**31))
    person = body_subject("person", mass, _HEIGHT_M, seed=own)
    motions = ("all_joints", "walk", "all_joints")
    recording, truth = simulate_body(motions, subject=person, seed=seed)
    base = _base()
    values = base.of(truth.parameters.ravel())

    def group(unit: str) -> AskedGroup:
        named = zip(base.names, base.units, values, strict=True)
        return AskedGroup(_GROUPS[unit], unit, {n: float(v) for n, u, v in named if u == unit})

    def recordings() -> dict[str, Any]:
        return {"recording": recording}

    groups = tuple(group(unit) for unit in _GROUPS if unit in base.units)
    return Made(groups, recordings, body_told=True)


def _share_base_parameters(folder: Path) -> None:
    """Which combinations are asked, as coefficients of the segments' own parameters."""
    from manipulandum_sim.body import body_subject

    base = _base()
    segments = [s.name for s in body_subject("person", 70.0, _HEIGHT_M).skeleton.segments]
    columns = [(segment, name) for segment in segments for name in _OF_A_SEGMENT]
    with (folder / "combinations.csv").open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(["quantity", "segment", "parameter", "coefficient"])
        for name, row in zip(base.names, base.mapping, strict=True):
            for column in np.flatnonzero(np.abs(row) > 1e-9):
                rows.writerow([name, *columns[column], f"{row[column]:.12g}"])


# A person in a therapy robot: how much of each movement is the person's own.

#: One seed for the one robot that all persons sit in.
_ROBOT_SEED: Final = 1


_SPEEDS_DEG_S: Final = (0.5, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0)


def _draw_contribution(seed: int) -> Made:
    from manipulandum_sim.therapy import THERAPY_SUBJECTS, simulate_therapy

    rng = np.random.default_rng(seed)
    person = replace(
        THERAPY_SUBJECTS["P3"],
        id="person",
        mass_kg=rng.uniform(50, 95),
        height_m=rng.uniform(1.55, 1.95),
        stiffness=rng.uniform([4.0, 1.0], [12.0, 6.0]),
        rest_rad=rng.uniform([0.6, -0.8], [1.4, 0.4]),
        active_share=rng.uniform(-0.3, 1.0),
    )
    recording, truth = simulate_therapy(
        subject=person, seed=seed, repetitions=3, conditions=("passive", "active"), exact=False
    )
    active = recording.trials["condition"] == "active"
    trials = recording.trials["trial"]
    shares = np.asarray(truth.contribution)
    values = {f"trial_{trials[t]}": float(shares[t]) for t in np.flatnonzero(active)}

    def recordings() -> dict[str, Any]:
        return {"recording": recording}

    return Made((AskedGroup("share", "%", values, 100.0),), recordings, body_told=True)


def _share_contribution(folder: Path) -> None:
    """The empty robot, which is the same for all."""
    from armimpedance.joint.therapy.show import write_robot
    from armimpedance.lab.benchmark_command.task import nameless
    from armimpedance.lab.simulated.therapy import drawings_of
    from armimpedance.recordings import write_recording
    from manipulandum_sim.therapy import simulate_calibration, therapy_device

    recording, _ = simulate_calibration(seed=_ROBOT_SEED, speeds_deg_s=_SPEEDS_DEG_S)
    write_recording(nameless(recording, body_told=False), folder / "calibration")
    write_robot(drawings_of(therapy_device()), folder / DRAWINGS_FILE)


JOINT_TASKS: Final = {
    "joint_torque": Task(
        line="One joint under a random torque below 10 Hz.",
        asks="""
In a record lies `recording`: 10 s at 1 kHz of a random torque on a joint, `I theta'' + B theta' +
K theta = tau`; white noise of 20 dB on torque and angle. Asked: I, B, K.
"""
        + COLUMNS,
        draw=_draw_joint_torque,
    ),
    "joint_position": Task(
        line="One joint that a stiff servo moves at random while its owner pushes slowly.",
        asks="""
In a record lies `recording`: 20 s at 1 kHz of random angles that a servo imposes on a joint,
`I theta'' + B theta' + K theta = tau + v`; v, the person's own slow torque, is not known. White
noise of 40 dB on torque and angle. The commanded angle is recorded too. Asked: I, B, K.
"""
        + COLUMNS,
        draw=_draw_joint_position,
    ),
    "joint_reflex": Task(
        line="One joint under a random torque, with a late answer to its deflection.",
        asks="""
As `joint_torque`, but the joint answers its deflection some 50 ms late with a further torque of a
tenth to a third of K. Asked: I, B and K without that answer.
"""
        + COLUMNS,
        draw=_draw_joint_reflex,
    ),
    "joint_smooth": Task(
        line="One joint under a random torque whose stiffness and viscosity go up and down.",
        asks="""
In a record lies `recording`: 20 s at 1 kHz of a random torque below 10 Hz on a joint; K and B go up
and down at .1 to .6 Hz, I is constant; white noise of 25 dB. Asked: I, and B and K at times of the
trial's own clock (`K@2.00` at 2 s).
"""
        + COLUMNS,
        draw=_draw_joint_smooth,
    ),
    "joint_square": Task(
        line="One joint whose stiffness switches between two levels while a servo moves it.",
        asks="""
In a record lies `recording`: 30 s at 1 kHz of random angles that a stiff servo imposes. I and B are
constant; K switches every 2 to 4 s between two levels; a reflex answers the velocity of 35 to 50 ms
ago, in one direction only, behind a low-pass; the person pushes slowly. White noise of 30 dB.
Asked: I, B, and K at times of the trial's own clock (`K@1.50` at 1.5 s), without the reflex.
"""
        + COLUMNS,
        draw=_draw_joint_square,
    ),
    "relaxed_joint": Task(
        line="The elbow of a relaxed arm that is filmed while the shoulder is pushed about.",
        asks="""
In a record lies `recording`: markers on trunk and right arm at 30 Hz, 15 s, noise of .5 mm, with
the skeleton that they sit on (masses, centres, inertias after the person's mass and height), and
`told.json` with the rest angle q_r. Asked of `right_elbow_flexion`: stiffness k, viscosity h and
dry friction f of the relaxed joint, `tau = -(k (q - q_r) + h q' + f sign(q'))`.
""",
        draw=_draw_relaxed_joint,
    ),
    "base_parameters": Task(
        line="A body moves on two force plates: the combinations of masses and inertias that show.",
        asks="""
In a record lies `recording`: three motions of a person at 100 Hz, coordinates of a skeleton and the
wrenches of two force plates; the skeleton has the person's bones and the masses of a table, which
are not the person's. `combinations.csv` says what is asked, as sums of coefficients times the
segments' own parameters (m in kg; mx, my, mz: mass times centre, kg m; Ixx ... Izz about the
segment's origin, kg m^2): the base parameters of the root's wrench. Any set of parameters that
predicts the wrench gives the same sums.
""",
        draw=_draw_base_parameters,
        share=_share_base_parameters,
    ),
    "contribution": Task(
        line="A patient in a robot for arm therapy: how much of each movement is the patient's "
        "own.",
        asks="""
`calibration` holds sweeps and holds of the empty robot, `drawings.json` its links and motors; they
are the same for all records. In a record lies `recording`: movements of a person in it, angles and
motors' torques; first the passive ones, then the active ones. Asked of each active trial:
`100 sum tau_user / sum tau_h` over its samples from onset to end about the moving axis, where
tau_user is the person's torque beyond the passive arm, tau_h what the passive arm needs.
""",
        draw=_draw_contribution,
        share=_share_contribution,
    ),
}
