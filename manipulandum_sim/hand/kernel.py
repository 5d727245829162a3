"""The equations of `coupled` for eight trials side by side, as Numba compiles them: the fast path.

This module imports Numba and is imported only when a compiled run is asked for. All that is
compiled stands in this one file: what Numba keeps on disk is renewed when this file changes, and
not when a file does whose functions it calls. The loops over `LANES` are what the compiler makes
vector instructions of. For that their bodies have no calls and no branches: the arctangent is
written out and the six muscles stand in a row. There is no `fastmath` and no fused product: every
sum keeps its order, and a trial's bits depend on the trial alone.

Numbers of trials stand in flat arrays, `LANES` of them a row: entry ``row * LANES + lane``.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from llvmlite import ir
from numba import float64, njit
from numba.extending import intrinsic

from armimpedance.core.arrays import FloatArray, IntArray

#: Trials that are integrated side by side: the doubles of the widest vector registers.
LANES: Final = 8
#: Rows of what an outcome is made of: state (4), place and direction (4), commanded displacement,
#: velocity, acceleration (3), time, voluntary force (2), servo gains (7), muscles (6 each), delayed
#: stretch (6).
PLACE: Final = 4
TOLD: Final = 8
TIME: Final = 11
PUSH: Final = 12
GAINS: Final = 14
MUSCLES: Final = 21
HEARD: Final = 57
#: Rows of an outcome: acceleration (2), force at the sensor (2), stretch (6), its rate (6). They
#: stand in the same array: of two, the compiler would have to see that they do not overlap.
RATE: Final = 63
FORCE: Final = 65
STRETCH: Final = 67
ROWS: Final = 79
#: tan(pi / 8), and the coefficients of the arctangent up to there: S. L. Moshier's Cephes library.
_TAN_22_5: Final = 0.41421356237309503

#: `TwoLink` in numbers: half, product, square, ratio, inertia1, inertia2, base_x, base_y, elbow.
Chain = tuple[float, float, float, float, float, float, float, float, float]
#: One chain's place and dynamics: ex, ey, ux, uy, det, dot, w1, w2, Lxx, Lxy, Lyy, bx, by.
Moving = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float
]
Six = tuple[float, float, float, float, float, float]
#: Arm, robot, lengths of the arm's links, passive joints (stiffness, viscosity, rest, each two),
#: and mass of cast and handle.
Plant = tuple[Chain, Chain, tuple[float, float], Six, tuple[float, float]]
#: Slope, sine and cosine of a muscle's path over the shoulder, then over the elbow.
Path = Six
Paths = tuple[Path, Path, Path, Path, Path, Path]


def _root(_context: Any, _number: Any) -> Any:
    """The square root as an instruction: Numba's own is a call, which no vector takes."""

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        square_root = builder.module.declare_intrinsic("llvm.sqrt", [ir.DoubleType()])
        return builder.call(square_root, arguments)

    return float64(float64), generate


root: Final[Any] = intrinsic(_root)


@njit(error_model="numpy", forceinline=True)
def end_motion(chain: Chain, x: float, y: float, vx: float, vy: float) -> Moving:
    """The same as `TwoLink.end_motion`, for one chain."""
    half, product, square, ratio, inertia1, inertia2, base_x, base_y, elbow = chain
    rx, ry = x - base_x, y - base_y
    rr = rx * rx + ry * ry
    dot = rr * 0.5 - half
    det = root(product - dot * dot) * elbow
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


@njit(error_model="numpy", forceinline=True)
def angle(sine: float, cosine: float) -> float:
    """The angle, -pi to pi, to the last bits; no branches that vectors could not take."""
    up, along = abs(sine), abs(cosine)
    low, high = min(up, along), max(up, along)
    far = low > _TAN_22_5 * high
    x = (low - high if far else low) / (low + high if far else high)
    z = x * x
    over = -8.750608600031904122785e-1 * z - 1.615753718733365076637e1
    over = (over * z - 7.500855792314704667340e1) * z - 1.228866684490136173410e2
    over = over * z - 6.485021904942025371773e1
    under = (z + 2.485846490142306297962e1) * z + 1.650270098316988542046e2
    under = (under * z + 4.328810604912902668951e2) * z + 4.853903996359136964868e2
    under = under * z + 1.945506571482613964425e2
    turned = x + x * (z * over / under) + (math.pi / 4 if far else 0.0)
    turned = math.pi / 2 - turned if up > along else turned
    turned = math.pi - turned if cosine < 0.0 else turned
    return -turned if sine < 0.0 else turned


@njit(error_model="numpy", forceinline=True)
def muscle(
    path: Path,
    given: FloatArray,
    number: int,
    lane: int,
    angles: Six,
    rates: tuple[float, float],
) -> tuple[float, float]:
    """Torques of a muscle at shoulder and elbow; its stretch and the rate go into `given`."""
    slope1, sine1, cosine1, slope2, sine2, cosine2 = path
    q1, s1, c1, q2, s2, c2 = angles
    at = (MUSCLES + 6 * number) * LANES + lane
    moving, time = given[at + 4 * LANES], given[TIME * LANES + lane]
    G1 = slope1 + sine1 * c1 - cosine1 * s1
    G2 = slope2 + sine2 * c2 - cosine2 * s2
    rate = G1 * rates[0] + G2 * rates[1]
    length = slope1 * q1 + sine1 * s1 + cosine1 * c1 + slope2 * q2 + sine2 * s2 + cosine2 * c2
    length = length - given[at + 3 * LANES] - moving * time
    f = given[at + LANES] * length + given[at] + given[at + 2 * LANES] * rate
    f += given[at + 5 * LANES] * given[(HEARD + number) * LANES + lane]
    # not max(): what is no number stays none
    f = 0.0 if f < 0.0 else f
    given[(STRETCH + number) * LANES + lane] = length
    given[(STRETCH + 6 + number) * LANES + lane] = rate - moving
    return G1 * f, G2 * f


@njit(error_model="numpy", forceinline=True)
def pull_at_hand(
    plant: Plant, paths: Paths, given: FloatArray, arm: Moving, lane: int
) -> tuple[float, float]:
    """Force at the hand of muscles and passive joints; the stretch goes into `given`."""
    ex, ey, ux, uy, det, dot, w1, w2 = arm[:8]
    l1, l2 = plant[2]
    stiff1, stiff2, viscous1, viscous2, rest1, rest2 = plant[3]
    inverse = 1 / (l1 * l2)
    s1, c1, s2, c2 = ey / l1, ex / l1, det * inverse, dot * inverse
    q1, q2 = angle(s1, c1), angle(s2, c2)
    angles, rates = (q1, s1, c1, q2, s2, c2), (w1, w2)
    a1, a2 = muscle(paths[0], given, 0, lane, angles, rates)
    b1, b2 = muscle(paths[1], given, 1, lane, angles, rates)
    c1, c2 = muscle(paths[2], given, 2, lane, angles, rates)
    d1, d2 = muscle(paths[3], given, 3, lane, angles, rates)
    e1, e2 = muscle(paths[4], given, 4, lane, angles, rates)
    f1, f2 = muscle(paths[5], given, 5, lane, angles, rates)
    tau1 = -stiff1 * (q1 - rest1) - viscous1 * w1 - (a1 + b1 + c1 + d1 + e1 + f1)
    tau2 = -stiff2 * (q2 - rest2) - viscous2 * w2 - (a2 + b2 + c2 + d2 + e2 + f2)
    return (ux * tau1 - (ex + ux) * tau2) / det, (uy * tau1 - (ey + uy) * tau2) / det


@njit(error_model="numpy", forceinline=True)
def servo_force(given: FloatArray, lane: int) -> tuple[float, float]:
    """Force of the robot's motors at the hand, as `CoupledPlant.servo_force` says it."""
    x, y = given[lane], given[LANES + lane]
    vx, vy = given[2 * LANES + lane], given[3 * LANES + lane]
    at, told, g = PLACE * LANES + lane, TOLD * LANES + lane, GAINS * LANES + lane
    along_x, along_y = given[at + 2 * LANES], given[at + 3 * LANES]
    p, v, a = given[told], given[told + LANES], given[told + 2 * LANES]
    stiffness, damping = given[g], given[g + LANES]
    ax, ay = along_x * a, along_y * a
    force_x = stiffness * (given[at] + along_x * p - x) + damping * (along_x * v - vx)
    force_y = stiffness * (given[at + LANES] + along_y * p - y) + damping * (along_y * v - vy)
    Fxx, Fxy, Fyy = given[g + 2 * LANES], given[g + 3 * LANES], given[g + 4 * LANES]
    force_x += Fxx * ax + Fxy * ay + given[g + 5 * LANES]
    force_y += Fxy * ax + Fyy * ay + given[g + 6 * LANES]
    return force_x, force_y


@njit(error_model="numpy")
def outcomes(plant: Plant, paths: Paths, given: FloatArray) -> None:
    """Acceleration and force at the sensor, as `CoupledPlant.outcome` says them."""
    cast, handle = plant[4]
    for lane in range(LANES):
        x, y = given[lane], given[LANES + lane]
        vx, vy = given[2 * LANES + lane], given[3 * LANES + lane]
        arm, robot = end_motion(plant[0], x, y, vx, vy), end_motion(plant[1], x, y, vx, vy)
        Lxx, Lxy, Lyy, bx, by = arm[8:]
        force_x, force_y = pull_at_hand(plant, paths, given, arm, lane)
        force_x += given[PUSH * LANES + lane] - bx
        force_y += given[(PUSH + 1) * LANES + lane] - by
        servo_x, servo_y = servo_force(given, lane)
        push_x, push_y = servo_x + force_x - robot[11], servo_y + force_y - robot[12]
        Axx = Lxx + robot[8] + (cast + handle)
        Ayy = Lyy + robot[10] + (cast + handle)
        Axy = Lxy + robot[9]
        inverse = 1 / (Axx * Ayy - Axy * Axy)
        ax = (Ayy * push_x - Axy * push_y) * inverse
        ay = (Axx * push_y - Axy * push_x) * inverse
        given[RATE * LANES + lane], given[(RATE + 1) * LANES + lane] = ax, ay
        given[FORCE * LANES + lane] = force_x - ((Lxx + cast) * ax + Lxy * ay)
        given[(FORCE + 1) * LANES + lane] = force_y - (Lxy * ax + (Lyy + cast) * ay)


@njit(error_model="numpy")
def tell(
    given: FloatArray, table: FloatArray, row: int, columns: IntArray, times: FloatArray
) -> None:
    """Set the command and the time of all lanes."""
    for lane in range(LANES):
        given[TOLD * LANES + lane] = table[columns[lane], row]
        given[(TOLD + 1) * LANES + lane] = table[columns[lane], row + 1]
        given[(TOLD + 2) * LANES + lane] = table[columns[lane], row + 2]
        given[TIME * LANES + lane] = times[lane]


@njit(error_model="numpy")
def push_on(given: FloatArray, voluntary: FloatArray, at: int, share: float) -> None:
    """Set the voluntary force between sample `at` and the next, linear; no samples are no force."""
    if len(voluntary) == 0:
        return
    then = min(at + 1, len(voluntary) - 1)
    for i in range(2 * LANES):
        given[PUSH * LANES + i] = voluntary[at, i] + share * (voluntary[then, i] - voluntary[at, i])


@njit(error_model="numpy")
def hear(
    past: FloatArray, n: int, delay: int, step_s: float, middle: FloatArray, late: FloatArray
) -> None:
    """Delayed stretch in the middle and at the end of substep `n`, as `coupled` hears it."""
    first = past[max(n - delay, 0) % len(past)]
    then = past[max(n - delay + 1, 0) % len(past)]
    for i in range(6 * LANES):
        bend = first[6 * LANES + i] - then[6 * LANES + i]
        middle[i] = (first[i] + then[i]) / 2 + step_s / 8 * bend
        late[i] = then[i]


@njit(error_model="numpy")
def move_on(
    given: FloatArray, start: FloatArray, mean: FloatArray, h: float, weight: float
) -> None:
    """Add a rate to the mean of a step, and set the state to the start and `h` at that rate."""
    half = 2 * LANES
    for i in range(half):
        u, a = given[half + i], given[RATE * LANES + i]
        mean[i] += weight * u
        mean[half + i] += weight * a
        given[i] = start[i] + h * u
        given[half + i] = start[half + i] + h * a


@njit(error_model="numpy")
def finish(given: FloatArray, start: FloatArray, mean: FloatArray, h: float) -> None:
    """Add the last rate, and set the state to the end of the step."""
    half = 2 * LANES
    for i in range(half):
        mean[i] += given[half + i]
        mean[half + i] += given[RATE * LANES + i]
    for i in range(4 * LANES):
        start[i] += h / 6 * mean[i]
        given[i] = start[i]
        mean[i] = 0.0


@njit(error_model="numpy")
def note(out: FloatArray, given: FloatArray, at: int) -> None:
    """Keep state and force of a sample."""
    for lane in range(len(out)):
        for i in range(4):
            out[lane, at, i] = given[i * LANES + lane]
        for i in range(2):
            out[lane, at, 4 + i] = given[(FORCE + i) * LANES + lane]


@njit(error_model="numpy")
def run_lanes(
    plant: Plant,
    paths: Paths,
    given: FloatArray,
    table: FloatArray,
    onset: IntArray,
    step_s: float,
    substeps: int,
    delay: int,
    voluntary: FloatArray,
    out: FloatArray,
) -> None:
    """Up to `LANES` trials into `out` (n, S, 6). A `delay` of 0 is no reflex."""
    h, past = step_s, np.zeros((delay + 2, 12 * LANES))
    start, mean = given[: 4 * LANES].copy(), np.zeros(4 * LANES)
    middle, late = np.zeros(6 * LANES), np.zeros(6 * LANES)
    heard = given[HEARD * LANES : RATE * LANES]
    columns, times = np.zeros(LANES, np.int64), np.zeros(LANES)
    for n in range((out.shape[1] - 1) * substeps + 1):
        at, part = n // substeps, n % substeps
        for lane in range(LANES):
            columns[lane] = min(max(n - onset[lane] + 1, 0), len(table) - 1)
            times[lane] = (n - onset[lane]) * h
        tell(given, table, 0, columns, times)
        push_on(given, voluntary, at, part / substeps)
        # what was heard at the end of a step is heard at the start of the next
        heard[:] = late
        outcomes(plant, paths, given)
        if part == 0:
            note(out, given, at)
        if delay:
            past[n % len(past)] = given[STRETCH * LANES :]
            hear(past, n, delay, h, middle, late)
        move_on(given, start, mean, h / 2, 1.0)
        tell(given, table, 3, columns, times + h / 2)
        push_on(given, voluntary, at, (part + 0.5) / substeps)
        heard[:] = middle
        outcomes(plant, paths, given)
        move_on(given, start, mean, h / 2, 2.0)
        outcomes(plant, paths, given)
        move_on(given, start, mean, h, 2.0)
        tell(given, table, 6, columns, times + h)
        push_on(given, voluntary, at, (part + 1.0) / substeps)
        heard[:] = late
        outcomes(plant, paths, given)
        finish(given, start, mean, h)


def run_trials(
    plant: Plant,
    paths: Paths,
    given: FloatArray,
    table: FloatArray,
    onset: IntArray,
    step_s: float,
    substeps: int,
    delay: int,
    voluntary: FloatArray,
    out: FloatArray,
) -> None:
    """All trials of a batch, T of them in C groups of `LANES`.

    Parameters
    ----------
    plant, paths
        Of all trials.
    given : (C, ROWS * LANES)
        Rows of each group as they are at its start; written over.
    table : (P, 9)
        Of `Course`, transposed.
    onset : (C, LANES)
    step_s : float
    substeps, delay : int
        The delay in substeps; 0 is no reflex.
    voluntary : (C, S, 2 * LANES) or (C, 0, 2 * LANES)
    out : (T, S, 6)
        Position, velocity and force are written here.
    """
    for c in range(len(given)):
        part = out[c * LANES : (c + 1) * LANES]
        run_lanes(
            plant, paths, given[c], table, onset[c], step_s, substeps, delay, voluntary[c], part
        )
