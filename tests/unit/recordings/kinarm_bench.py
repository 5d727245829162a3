"""A Kinarm in a lab: a limb pushed by a robot whose torques follow from d'Alembert's principle.

The robot here is a list of bodies whose centres of mass are put on the plane by their geometry;
their accelerations are differences of places. Nothing of the reader's equations is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LENGTHS = (0.30, 0.33)
SHOULDER = (-0.12, 0.04)
CRANK = 0.11

#: What the file says of the links: inertia, mass, centre of mass along and across.
INERTIAS = {
    "L1_I": 0.020, "L1_M": 2.1, "L1_C_AXIAL": 0.14, "L1_C_ANTERIOR": 0.012,
    "L2_I": 0.011, "L2_M": 0.9, "L2_C_AXIAL": 0.16, "L2_C_ANTERIOR": -0.008,
    "L3_I": 0.002, "L3_M": 0.7, "L3_C_AXIAL": 0.05, "L3_C_ANTERIOR": 0.004,
    "L4_I": 0.009, "L4_M": 0.6, "L4_C_AXIAL": 0.15, "L4_C_ANTERIOR": 0.003,
    "L3_L": CRANK, "MOTOR1_I": 0.007, "MOTOR2_I": 0.006,
}  # fmt: skip

#: The limb at the hand: kg, N s/m, N/m.
LIMB = (
    np.array([[1.7, -0.6], [-0.6, 1.0]]),
    np.array([[9.0, -6.0], [-6.0, 14.0]]),
    np.array([[110.0, -70.0], [-70.0, 180.0]]),
)

RATE = 1000.0
BEFORE_S, PUSH_S = 0.1, 0.3


def unit(angle):
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def across(angle):
    return np.stack([-np.sin(angle), np.cos(angle)], axis=-1)


def link_angles(hand, handle=(0.0, 0.0)):
    """Both links' angles from the x axis, (S, 2), that put the handle at these places."""
    first = LENGTHS[0]
    second = np.hypot(LENGTHS[1] + handle[0], handle[1])
    turn = np.arctan2(handle[1], LENGTHS[1] + handle[0])
    x, y = (hand - SHOULDER).T
    apart = np.hypot(x, y)
    inner = np.arccos((first**2 + apart**2 - second**2) / (2 * first * apart))
    a1 = np.arctan2(y, x) - inner
    a2 = np.arctan2(y - first * np.sin(a1), x - first * np.cos(a1)) - turn
    return np.column_stack([a1, a2])


def places(angles, handle=(0.0, 0.0)):
    """Where these angles put the handle, (S, 2)."""
    a1, a2 = angles.T
    beyond = (LENGTHS[1] + handle[0]) * unit(a2) + handle[1] * across(a2)
    return np.array(SHOULDER) + LENGTHS[0] * unit(a1) + beyond


def dalembert(angles, turn=1.0, crank_behind=0.0):
    """Torques on the two links' angles that the bodies' accelerations take, (S, 2).

    `turn` is -1 for a left robot, whose "anterior" is the other side; the crank is so far behind
    link 2.
    """
    c, dt = INERTIAS, 1 / RATE
    a1, a2 = angles.T

    def accelerated(values):
        return np.gradient(np.gradient(values, dt, axis=0, edge_order=2), dt, axis=0, edge_order=2)

    def place(base, link, angle):
        return (
            base
            + c[f"{link}_C_AXIAL"] * unit(angle)
            + turn * c[f"{link}_C_ANTERIOR"] * across(angle)
        )

    def places(a1, a2):
        origin = np.zeros((len(a1), 2))
        return {
            "L1": place(origin, "L1", a1),
            "L2": place(LENGTHS[0] * unit(a1), "L2", a2),
            "L3": place(origin, "L3", a2 - turn * crank_behind),
            "L4": place(CRANK * unit(a2 - turn * crank_behind), "L4", a1),
        }

    step, torque = 1e-6, np.zeros_like(angles)
    here = places(a1, a2)
    for i in (0, 1):
        moved = places(a1 + step * (i == 0), a2 + step * (i == 1))
        for link, centre in here.items():
            lever = (moved[link] - centre) / step
            torque[:, i] += c[f"{link}_M"] * (lever * accelerated(centre)).sum(axis=1)
    spin1, spin2 = accelerated(a1), accelerated(a2)
    torque[:, 0] += (c["L1_I"] + c["L4_I"] + c["MOTOR1_I"]) * spin1
    torque[:, 1] += (c["L2_I"] + c["L3_I"] + c["MOTOR2_I"]) * spin2
    return torque


@dataclass
class Push:
    """One push of the hand: angles of the links, the limb's force on the robot, the motors."""

    links: np.ndarray
    force: np.ndarray
    motors: np.ndarray


def push(direction_rad, at=(-0.05, 0.42), handle=(0.0, 0.0), amplitude=0.008, friction=0.05):
    """The hand is pushed and brought back; the motors bear limb, links and friction."""
    t = np.arange(round((2 * BEFORE_S + PUSH_S) * RATE)) / RATE
    s = np.clip((t - BEFORE_S) / PUSH_S, 0, 1)
    shape = np.polynomial.Polynomial([0, 0, 0, 64, -192, 192, -64])
    along = np.array([np.cos(direction_rad), np.sin(direction_rad)])
    moved = amplitude * np.outer(shape(s), along)
    speed = amplitude * np.outer(shape.deriv()(s) / PUSH_S, along)
    rise = amplitude * np.outer(shape.deriv(2)(s) / PUSH_S**2, along)
    inertia, viscosity, stiffness = LIMB
    force = -(rise @ inertia + speed @ viscosity + moved @ stiffness)
    links = link_angles(np.array(at) + moved, handle)
    return Push(links, force, motors(links, force, handle, friction))


def motors(links, force, handle=(0.0, 0.0), friction=0.05):
    """What the motors must do so that these links move under this force of the limb."""
    a1, a2 = links.T
    levers = (
        LENGTHS[0] * across(a1),
        (LENGTHS[1] + handle[0]) * across(a2) - handle[1] * unit(a2),
    )
    by_limb = np.column_stack([(lever * force).sum(axis=1) for lever in levers])
    turning = np.gradient(links, 1 / RATE, axis=0)
    return dalembert(links) - by_limb + friction * np.tanh(turning / 0.02)


def trial_of(exams, number, made, *, force_by="limb", noise=None, unit_n=1.0, **fields):
    """A trial file's content of one push: eight protocols, each in its direction."""
    force = made.force if noise is None else made.force + noise
    held = force if force_by == "limb" else -force
    protocol, repetition = (number - 1) % 8 + 1, (number - 1) // 8 + 1
    return exams.Trial(
        **{
            "name": f"01_{protocol:02d}_{repetition:02d}.c3d",
            "samples": len(held),
            "trial_num": number,
            "links": made.links,
            "forces": held / unit_n,
            "motors": made.motors,
            "events": (("PERT_ON", BEFORE_S), ("PERT_OFF", BEFORE_S + PUSH_S)),
        }
        | fields
    )


def robot_of(exams, handle=(0.0, 0.0), **fields):
    """The robot of the exam, with the inertias of its links."""
    known = {"version": "KINARM_EP_Rev1", "shoulder": SHOULDER, "lengths": LENGTHS}
    return exams.Robot(**(known | {"handle": handle, "inertias": INERTIAS} | fields))


def tables_of(c3d):
    """Eight protocols: pushes with the loads 1 to 8 from target 9 to the targets 1 to 8."""
    around = 2 * np.pi * np.arange(8) / 8
    filled = np.zeros(92)

    def column(values):
        return c3d.floats(*values, *filled[: 100 - len(values)], sizes=(10, 10))

    targets = np.array([[-5.0, 42.0]]) + 10 * unit(around)
    targets = np.vstack([targets, [-5.0, 42.0]])
    used = c3d.shorts(8, sizes=())
    return {
        "TP_TABLE": {
            "USED": used,
            "COLUMN_ORDER": c3d.texts("START_TARGET", "END_TARGET", "LOAD", "DELAY"),
            "START_TARGET": column([9.0] * 8),
            "END_TARGET": column(range(1, 9)),
            "LOAD": column(range(1, 9)),
            "TARGET_ON_TIME": column([2.0] * 8),
            "DELAY": column([0.665] * 8),
        },
        "TARGET_TABLE": {
            "USED": c3d.shorts(9, sizes=()),
            "X": column(targets[:, 0] - 3.0),
            "X_GLOBAL": column(targets[:, 0]),
            "Y_GLOBAL": column(targets[:, 1]),
        },
        "LOAD_TABLE": {
            "USED": used,
            "FORCE_X": column(8 * np.cos(around)),
            "FORCE_Y": column(8 * np.sin(around)),
        },
    }
