"""The equations of `coupled`, one trial after another, as Numba compiles them: the fast path.

This module imports Numba and is imported only when a compiled run is asked for. All that is
compiled stands in this one file: what Numba keeps on disk is renewed when this file changes, and
not when a file does whose functions it calls. There is no `fastmath`: every sum keeps its order,
and a trial's bits depend on the trial alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from armimpedance.arrays import FloatArray, IntArray

#: `TwoLink` in numbers: half, product, square, ratio, inertia1, inertia2, base_x, base_y, elbow.
Chain = tuple[float, float, float, float, float, float, float, float, float]
#: One chain's place and dynamics: ex, ey, ux, uy, det, dot, w1, w2, Lxx, Lxy, Lyy, bx, by.
Moving = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
Four = tuple[float, float, float, float]
Six = tuple[float, float, float, float, float, float]
#: Arm, robot, lengths of the arm's links, passive joints (stiffness, viscosity, rest, each two),
#: and mass of cast and handle.
Plant = tuple[Chain, Chain, tuple[float, float], Six, tuple[float, float]]
#: Plant, muscles' paths (6, 6), one row a muscle: slope, sine, cosine over each joint; a trial's
#: muscles (6, 6), one row a muscle, the entries of `MuscleCommand`; its entries of `ServoGains`.
Trial = tuple[Plant, FloatArray, FloatArray, FloatArray]


@njit(error_model="numpy")
def end_motion(chain: Chain, x: float, y: float, vx: float, vy: float) -> Moving:
    """What `TwoLink.end_motion` says, of one chain."""
    half, product, square, ratio, inertia1, inertia2, base_x, base_y, elbow = chain
    rx, ry = x - base_x, y - base_y
    rr = rx * rx + ry * ry
    dot = rr * 0.5 - half
    det = math.sqrt(product - dot * dot) * elbow
    inverse = 1 / rr
    along, across = (square + dot) * inverse, det * inverse
    ex, ey = along * rx + across * ry, along * ry - across * rx
    ux, uy = rx - ex, ry - ey
    scale = 1 / det
    Ux, Uy, Ex, Ey = ux * scale, uy * scale, ex * scale, ey * scale
    w1, w12 = Ux * vx + Uy * vy, -(Ex * vx + Ey * vy)
    cosine, sine = ratio * dot, ratio * det
    ax, ay = inertia1 * Ux - cosine * Ex, inertia1 * Uy - cosine * Ey
    bx, by = inertia2 * Ex - cosine * Ux, inertia2 * Ey - cosine * Uy
    Lxx, Lxy, Lyy = ax * Ux + bx * Ex, ax * Uy + bx * Ey, ay * Uy + by * Ey
    square1, square12 = w1 * w1, w12 * w12
    cx, cy = square1 * ex + square12 * ux, square1 * ey + square12 * uy
    b_U = ax * cx + ay * cy - sine * square12
    b_E = bx * cx + by * cy - sine * square1
    force_x, force_y = Ux * b_U + Ex * b_E, Uy * b_U + Ey * b_E
    return ex, ey, ux, uy, det, dot, w1, w12 - w1, Lxx, Lxy, Lyy, force_x, force_y


@njit(error_model="numpy")
def pull_at_hand(
    plant: Plant,
    paths: FloatArray,
    muscles: FloatArray,
    arm: Moving,
    time: float,
    delayed: FloatArray,
    stretch: FloatArray,
) -> tuple[float, float]:
    """Force at the hand of muscles and passive joints; their stretch goes into `stretch` (2, 6)."""
    ex, ey, ux, uy, det, dot, w1, w2 = arm[:8]
    l1, l2 = plant[2]
    stiff1, stiff2, viscous1, viscous2, rest1, rest2 = plant[3]
    inverse = 1 / (l1 * l2)
    s1, c1, s2, c2 = ey / l1, ex / l1, det * inverse, dot * inverse
    q1, q2 = math.atan2(s1, c1), math.atan2(s2, c2)
    tau1 = -stiff1 * (q1 - rest1) - viscous1 * w1
    tau2 = -stiff2 * (q2 - rest2) - viscous2 * w2
    for m in range(6):
        slope1, sine1, cosine1, slope2, sine2, cosine2 = paths[m]
        tension, stiffness, viscosity, virtual, moving, reflex = muscles[m]
        G1 = slope1 + sine1 * c1 - cosine1 * s1
        G2 = slope2 + sine2 * c2 - cosine2 * s2
        rate = G1 * w1 + G2 * w2
        length = slope1 * q1 + sine1 * s1 + cosine1 * c1 + slope2 * q2 + sine2 * s2 + cosine2 * c2
        length -= virtual + moving * time
        f = stiffness * length + tension + viscosity * rate + reflex * delayed[m]
        # not max(): what is no number stays none
        if f < 0.0:
            f = 0.0
        tau1 -= G1 * f
        tau2 -= G2 * f
        stretch[0, m], stretch[1, m] = length, rate - moving
    return (ux * tau1 - (ex + ux) * tau2) / det, (uy * tau1 - (ey + uy) * tau2) / det


@njit(error_model="numpy")
def outcome(
    trial: Trial,
    state: Four,
    command: Six,
    time: float,
    voluntary: tuple[float, float],
    delayed: FloatArray,
    stretch: FloatArray,
) -> Four:
    """Acceleration of the hand and force at the sensor, as `CoupledPlant.outcome` says them."""
    plant, paths, muscles, gains = trial
    x, y, vx, vy = state
    at_x, at_y, going_x, going_y, ax, ay = command
    stiffness, damping, Fxx, Fxy, Fyy, hold_x, hold_y = gains
    cast, handle = plant[4]
    arm, robot = end_motion(plant[0], x, y, vx, vy), end_motion(plant[1], x, y, vx, vy)
    Lxx, Lxy, Lyy, bx, by = arm[8:]
    pull_x, pull_y = pull_at_hand(plant, paths, muscles, arm, time, delayed, stretch)
    force_x, force_y = pull_x - bx + voluntary[0], pull_y - by + voluntary[1]
    servo_x = stiffness * (at_x - x) + damping * (going_x - vx) + Fxx * ax + Fxy * ay + hold_x
    servo_y = stiffness * (at_y - y) + damping * (going_y - vy) + Fxy * ax + Fyy * ay + hold_y
    push_x, push_y = servo_x + force_x - robot[11], servo_y + force_y - robot[12]
    Axx = Lxx + robot[8] + (cast + handle)
    Ayy = Lyy + robot[10] + (cast + handle)
    Axy = Lxy + robot[9]
    determinant = Axx * Ayy - Axy * Axy
    px, py = push_x / determinant, push_y / determinant
    acc_x, acc_y = Ayy * px - Axy * py, Axx * py - Axy * px
    force_x -= (Lxx + cast) * acc_x + Lxy * acc_y
    force_y -= Lxy * acc_x + (Lyy + cast) * acc_y
    return acc_x, acc_y, force_x, force_y


@njit(error_model="numpy")
def command_at(course: Four, table: FloatArray, row: int, column: int) -> Six:
    """Commanded position, velocity and acceleration: place and direction times the table's."""
    x, y, along_x, along_y = course
    p, v, a = table[row, column], table[row + 1, column], table[row + 2, column]
    return x + along_x * p, y + along_y * p, along_x * v, along_y * v, along_x * a, along_y * a


@njit(error_model="numpy")
def voluntary_at(voluntary: FloatArray, at: int, share: float) -> tuple[float, float]:
    """The force between sample `at` and the next, linear; no samples are no force."""
    if len(voluntary) == 0:
        return 0.0, 0.0
    then = min(at + 1, len(voluntary) - 1)
    x, y = voluntary[at]
    return x + share * (voluntary[then, 0] - x), y + share * (voluntary[then, 1] - y)


@njit(error_model="numpy")
def hear(
    past: FloatArray, n: int, delay: int, step_s: float, begin: FloatArray, end: FloatArray
) -> None:
    """Delayed stretch in the middle and at the end of substep `n`, as `coupled` hears it."""
    first = past[max(n - delay, 0) % len(past)]
    then = past[max(n - delay + 1, 0) % len(past)]
    for m in range(6):
        begin[m] = (first[0, m] + then[0, m]) / 2 + step_s / 8 * (first[1, m] - then[1, m])
        end[m] = then[0, m]


@njit(error_model="numpy")
def moved(state: Four, step_s: float, u: float, v: float, ax: float, ay: float) -> Four:
    """The state after a step at the rate (u, v, ax, ay)."""
    x, y, vx, vy = state
    return x + step_s * u, y + step_s * v, vx + step_s * ax, vy + step_s * ay


@njit(error_model="numpy")
def stepped(
    trial: Trial,
    state: Four,
    first: tuple[float, float],
    commands: tuple[Six, Six],
    time: float,
    step_s: float,
    pushes: tuple[tuple[float, float], tuple[float, float]],
    heard: tuple[FloatArray, FloatArray],
    scratch: FloatArray,
) -> Four:
    """The state after a step of the fourth-order Runge-Kutta rule.

    `first` is the acceleration at the start; commands, forces and stretches are those in the
    middle and at the end.
    """
    h, half = step_s, step_s / 2
    x, y, vx, vy = state
    a1x, a1y = first
    one = moved(state, half, vx, vy, a1x, a1y)
    found = outcome(trial, one, commands[0], time + half, pushes[0], heard[0], scratch)
    a2x, a2y = found[0], found[1]
    two = moved(state, half, one[2], one[3], a2x, a2y)
    found = outcome(trial, two, commands[0], time + half, pushes[0], heard[0], scratch)
    a3x, a3y = found[0], found[1]
    three = moved(state, h, two[2], two[3], a3x, a3y)
    found = outcome(trial, three, commands[1], time + h, pushes[1], heard[1], scratch)
    a4x, a4y = found[0], found[1]
    mean_vx = vx + 2 * (one[2] + two[2]) + three[2]
    mean_vy = vy + 2 * (one[3] + two[3]) + three[3]
    mean_ax, mean_ay = a1x + 2 * (a2x + a3x) + a4x, a1y + 2 * (a2y + a3y) + a4y
    return moved(state, h / 6, mean_vx, mean_vy, mean_ax, mean_ay)


@njit(error_model="numpy")
def run_trial(
    trial: Trial,
    course: Four,
    table: FloatArray,
    onset: int,
    step_s: float,
    substeps: int,
    delay: int,
    voluntary: FloatArray,
    out: FloatArray,
) -> None:
    """One trial into `out` (S, 6): position, velocity, force. A `delay` of 0 is no reflex."""
    last, past, scratch = table.shape[1] - 1, np.zeros((delay + 2, 2, 6)), np.zeros((2, 6))
    middle, late = np.zeros(6), np.zeros(6)
    state = (course[0], course[1], 0.0, 0.0)
    for n in range((len(out) - 1) * substeps + 1):
        at, part = n // substeps, n % substeps
        column, time = min(max(n - onset + 1, 0), last), (n - onset) * step_s
        push = voluntary_at(voluntary, at, part / substeps)
        told = command_at(course, table, 0, column)
        # what is heard at the end of a step is heard at the start of the next
        found = outcome(trial, state, told, time, push, late, past[n % len(past)])
        if part == 0:
            out[at, 0], out[at, 1], out[at, 2], out[at, 3] = state
            out[at, 4], out[at, 5] = found[2], found[3]
        if delay:
            hear(past, n, delay, step_s, middle, late)
        commands = command_at(course, table, 3, column), command_at(course, table, 6, column)
        pushes = (
            voluntary_at(voluntary, at, (part + 0.5) / substeps),
            voluntary_at(voluntary, at, (part + 1.0) / substeps),
        )
        first, heard = (found[0], found[1]), (middle, late)
        state = stepped(trial, state, first, commands, time, step_s, pushes, heard, scratch)


def run_trials(
    plant: Plant,
    paths: FloatArray,
    muscles: FloatArray,
    gains: FloatArray,
    courses: FloatArray,
    table: FloatArray,
    onset: IntArray,
    step_s: float,
    substeps: int,
    delay: int,
    voluntary: FloatArray,
    out: FloatArray,
) -> None:
    """All trials of a batch, T of them, one after another.

    Parameters
    ----------
    plant, paths
        Of all trials.
    muscles : (T, 6, 6)
    gains : (T, 7)
    courses : (T, 4)
        Place and direction.
    table : (9, P)
        Of `Course`.
    onset : (T,)
    step_s : float
    substeps, delay : int
        The delay in substeps; 0 is no reflex.
    voluntary : (T, S, 2) or (T, 0, 2)
    out : (T, S, 6)
        Position, velocity and force are written here.
    """
    for t in range(len(onset)):
        course = (courses[t, 0], courses[t, 1], courses[t, 2], courses[t, 3])
        trial = (plant, paths, muscles[t], gains[t])
        run_trial(trial, course, table, onset[t], step_s, substeps, delay, voluntary[t], out[t])
