"""Sessions with the empty therapy robot: sweeps, holds, and movements that validate its model.

Sweeps move one axis at a constant velocity, holds keep axis 1 still after it came from below or
from above, as M. Guidali et al. (2013) did; their velocities are from .1 to 60 deg/s, the numbers
in between are ours. All other axes stand still at `NEUTRAL_DEG`.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import command_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording, Subject
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice, therapy_device
from manipulandum_sim.therapy.plant import Motion, PositionController, Progress, run
from manipulandum_sim.therapy.steps import smooth_step
from manipulandum_sim.therapy.truth import TherapyMotion, TherapyTruth, rows

Noise = Literal["nominal", "none"]

#: Speeds of the sweeps.
SPEEDS_DEG_S: Final = (0.1, 0.5, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0)
#: Where axes stand that do not move: no axis near its end, gravity on axes 1, 3 and 4.
NEUTRAL_DEG: Final = (70.0, 30.0, 0.0, 60.0, 0.0)
#: How many angles axis 1 is held at, and how far it comes from, deg.
HOLDS: Final = 12
APPROACH_DEG: Final = 6.0
#: Nearest to the end of an axis' range, deg.
MARGIN_DEG: Final = 3.0

#: s: standing at either end, gaining speed, until the speed is steady; the last is longer for
#: slow sweeps, as the bristles must bend and slip over this way, deg.
_REST_S: Final = 0.1
_RAMP_S: Final = 0.5
_SETTLE_S: Final = 0.3
_SETTLE_DEG: Final = 0.15
#: Up to which speed, deg/s, a sweep stays steady for how long at most, s.
_LONGEST: Final = ((0.2, 4.0), (1.0, 5.0), (15.0, 4.0), (30.0, 3.5), (90.0, 3.0))
#: s: coming to a hold, until it is still, held.
_COMING_S: Final = 1.0
_STILLING_S: Final = 0.3
_HELD_S: Final = 0.6

#: Validation: legs of a trial, mean speed of the axis with the longest way, shortest leg, and the
#: share of a leg during which the next one has begun: no standstill at the postures between.
LEGS: Final = 3
LEG_SPEED_DEG_S: Final = 25.0
SHORTEST_LEG_S: Final = 2.0
OVERLAP: Final = 0.2

_STREAMS: Final = ("torque", "sensor", "postures")


@dataclass(frozen=True)
class Seeds:
    """Random streams that depend on seed, session and number of the trial alone."""

    seed: int
    session: str

    def stream(self, trial: int, purpose: str) -> np.random.Generator:
        """Random stream of a trial, counted from 1."""
        key = (zlib.crc32(self.session.encode()), trial, _STREAMS.index(purpose))
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))


@dataclass(frozen=True)
class Course:
    """Commanded course of one trial.

    Attributes
    ----------
    q, qd : (S, n)
        rad, rad/s.
    row : dict
        Of the trial table, the trial's number left out.
    """

    q: FloatArray
    qd: FloatArray
    row: dict[str, Any]


def simulate_calibration(
    *,
    seed: int = 0,
    device: TherapyDevice | None = None,
    noise: Noise = "nominal",
    speeds_deg_s: Sequence[float] = SPEEDS_DEG_S,
    held_angles: int = HOLDS,
    progress: Progress | None = None,
) -> tuple[Recording, TherapyTruth]:
    """The empty robot's sweeps and holds, and their truth.

    Parameters
    ----------
    seed : int
        A trial's noise depends on seed and the trial's number alone.
    device : TherapyDevice, optional
    speeds_deg_s : sequence of float
        Of the sweeps.
    held_angles : int
        How many angles axis 1 is held at, from both sides.
    noise : {"nominal", "none"}
        ``none``: no noise of torques, no steps of encoders.
    progress : function, optional
        Called with how many samples are done, of how many.

    Returns
    -------
    (Recording, TherapyTruth)
        Conditions "sweep" and "hold".

    Raises
    ------
    InputError
        An argument that makes no recording.
    """
    own = device or therapy_device()
    _check(seed, noise)
    if not (len(speeds_deg_s) > 0 and all(0.05 <= v <= 90 for v in speeds_deg_s)):
        raise InputError(f"speeds {tuple(speeds_deg_s)}", expected="one or more, 0.05 to 90 deg/s")
    if not 0 <= held_angles <= 1000:
        raise InputError(f"{held_angles} held angles", expected="0 to 1000")
    courses = [*_sweeps(own, speeds_deg_s), *_holds(own, held_angles)]
    return _session("calibration", courses, own, seed, noise, progress)


def simulate_validation(
    *,
    seed: int = 0,
    trials: int = 8,
    legs: int = LEGS,
    device: TherapyDevice | None = None,
    noise: Noise = "nominal",
    progress: Progress | None = None,
) -> tuple[Recording, TherapyTruth]:
    """The empty robot on minimum-jerk ways between random postures, all axes at once.

    Parameters
    ----------
    seed : int
        Postures and noise of a trial depend on seed and the trial's number alone.
    trials, legs : int
        How many trials, of how many ways each.
    device, noise, progress
        As in `simulate_calibration`.

    Returns
    -------
    (Recording, TherapyTruth)
        Condition "validation".

    Raises
    ------
    InputError
        An argument that makes no recording.
    """
    own = device or therapy_device()
    _check(seed, noise)
    if not 1 <= trials <= 1000:
        raise InputError(f"{trials} trials", expected="1 to 1000")
    if not 1 <= legs <= 20:
        raise InputError(f"{legs} legs", expected="1 to 20")
    seeds = Seeds(seed, "validation")
    courses = [_wander(own, legs, seeds.stream(t + 1, "postures"), t + 1) for t in range(trials)]
    return _session("validation", courses, own, seed, noise, progress)


def _check(seed: int, noise: str) -> None:
    if noise not in get_args(Noise):
        raise InputError(f"no noise level {noise!r}", expected=", ".join(get_args(Noise)))
    if seed < 0:
        raise InputError(f"seed {seed}", expected="0 or more")


def _sweeps(device: TherapyDevice, speeds_deg_s: Sequence[float]) -> list[Course]:
    """Every axis at every speed in both directions."""
    return [
        _sweep(device, axis, sign * speed)
        for axis in range(device.n_axes)
        for speed in speeds_deg_s
        for sign in (1, -1)
    ]


def _sweep(device: TherapyDevice, axis: int, velocity_deg_s: float) -> Course:
    """At rest, faster, steady, slower, at rest; about the middle of the axis' range."""
    low, high = np.rad2deg(device.limits_rad[axis]) + (MARGIN_DEG, -MARGIN_DEG)
    speed = abs(velocity_deg_s)
    settle = _SETTLE_S + _SETTLE_DEG / speed
    longest_s = next(longest for most, longest in _LONGEST if speed <= most)
    steady = min(settle + longest_s, (high - low) / speed - _RAMP_S)
    samples = round((2 * _REST_S + 2 * _RAMP_S + steady) * RATE_HZ) + 1
    time = np.arange(samples) / RATE_HZ - _REST_S
    faster = smooth_step(time / _RAMP_S)
    slower = smooth_step((time - _RAMP_S - steady) / _RAMP_S)
    way = velocity_deg_s * (faster.integral - slower.integral) * _RAMP_S
    q = (low + high) / 2 + way - way[-1] / 2
    row = _row(device, "sweep", axis, _REST_S + _RAMP_S + settle, _REST_S + _RAMP_S + steady)
    row["velocity_deg_s"] = velocity_deg_s
    return _one_axis(axis, q, velocity_deg_s * (faster.value - slower.value), row)


def _holds(device: TherapyDevice, count: int) -> list[Course]:
    """Axis 1 still at each angle, once from below and once from above."""
    low, high = np.rad2deg(device.limits_rad[0])
    reach = MARGIN_DEG + APPROACH_DEG
    return [
        _hold(device, angle, approach)
        for angle in np.linspace(low + reach, high - reach, count)
        for approach in (1, -1)
    ]


def _hold(device: TherapyDevice, angle_deg: float, approach: int) -> Course:
    samples = round((_REST_S + _COMING_S + _STILLING_S + _HELD_S) * RATE_HZ) + 1
    time = np.arange(samples) / RATE_HZ - _REST_S
    coming = smooth_step(time / _COMING_S)
    q = angle_deg - approach * APPROACH_DEG * (1 - coming.value)
    first = _REST_S + _COMING_S + _STILLING_S
    row = _row(device, "hold", 0, first, first + _HELD_S)
    row["approach"] = approach
    return _one_axis(0, q, approach * APPROACH_DEG * coming.slope / _COMING_S, row)


def _one_axis(axis: int, q_deg: FloatArray, qd_deg: FloatArray, row: dict[str, Any]) -> Course:
    q, qd = np.tile(np.array(NEUTRAL_DEG), (len(q_deg), 1)), np.zeros((len(q_deg), 5))
    q[:, axis], qd[:, axis] = q_deg, qd_deg
    return Course(np.deg2rad(q), np.deg2rad(qd), row)


def _row(
    device: TherapyDevice, condition: str, axis: int, onset_s: float, end_s: float
) -> dict[str, Any]:
    return {
        "condition": condition,
        "movement": device.axes[axis],
        "axis": axis + 1,
        "onset_s": round(onset_s, 3),
        "end_s": round(end_s, 3),
        "repetition": 1,
    }


def _wander(
    device: TherapyDevice, legs: int, stream: np.random.Generator, repetition: int
) -> Course:
    """Minimum-jerk legs between random postures, all axes together, one leg into the next."""
    postures = _far_postures(device, legs + 1, stream)
    ways = np.diff(postures, axis=0)
    lasting = np.maximum(SHORTEST_LEG_S, np.rad2deg(np.abs(ways).max(axis=1)) / LEG_SPEED_DEG_S)
    starts = np.concatenate([[0.0], np.cumsum((1 - OVERLAP) * lasting[:-1])])
    end = round(float(starts[-1] + lasting[-1]), 3)
    time = np.arange(round((end + 2 * _REST_S) * RATE_HZ) + 1) / RATE_HZ - _REST_S
    q, qd = np.tile(postures[0], (len(time), 1)), np.zeros((len(time), device.n_axes))
    for way, start, duration in zip(ways, starts, lasting, strict=True):
        leg = smooth_step((time - start) / duration)
        q += way * leg.value[:, None]
        qd += way * leg.slope[:, None] / duration
    row = _row(device, "validation", 0, _REST_S, _REST_S + end)
    row |= {"movement": "multi-joint", "repetition": repetition}
    return Course(q, qd, row)


def _far_postures(device: TherapyDevice, count: int, stream: np.random.Generator) -> FloatArray:
    """Postures (count, n): every axis in the lower and the upper part of its range in turns.

    So all axes move far in every leg: one that hardly moves shows nothing but stiction.
    """
    low, high = device.limits_rad.T
    upper = (np.arange(count)[:, None] + stream.integers(0, 2, device.n_axes)) % 2
    share = stream.uniform(0.08, 0.32, (count, device.n_axes))
    return np.asarray(low + (high - low) * np.where(upper, 1 - share, share))


def _session(
    name: str,
    courses: list[Course],
    device: TherapyDevice,
    seed: int,
    noise: Noise,
    progress: Progress | None,
) -> tuple[Recording, TherapyTruth]:
    lengths = np.array([len(course.q) for course in courses])
    reference, rate = (
        np.stack([_held(getattr(c, part), lengths.max()) for c in courses], axis=1)
        for part in ("q", "qd")
    )
    for t, length in enumerate(lengths):
        rate[length:, t] = 0.0
    controller = PositionController(device, reference, rate)
    motion = run(
        device, None, reference[0], controller, len(reference),
        measured=noise != "none", progress=progress,
    )  # fmt: skip
    table = pd.DataFrame({"trial": np.arange(len(courses)) + 1, **_columns(courses)})
    said = f"Simulated: {name} of the empty robot {device.name}, seed {seed}, noise {noise}."
    recording = therapy_recording(
        device, motion, reference, table, lengths, Seeds(seed, name), noise, Subject("empty"), said
    )
    exact = TherapyMotion.of(motion, lengths)
    return recording, TherapyTruth.of(name, "empty", device, recording.offsets, exact)


def _held(values: FloatArray, samples: int) -> FloatArray:
    """The last row repeated up to so many samples."""
    return np.concatenate([values, values[-1:].repeat(samples - len(values), axis=0)])


def _columns(courses: list[Course]) -> dict[str, list[Any]]:
    names = list(dict.fromkeys(name for course in courses for name in course.row))
    return {name: [course.row.get(name, np.nan) for course in courses] for name in names}


def therapy_recording(
    device: TherapyDevice,
    motion: Motion,
    reference: FloatArray,
    table: pd.DataFrame,
    lengths: IntArray,
    seeds: Seeds,
    noise: Noise,
    subject: Subject,
    said: str,
) -> Recording:
    """Recording of a motion by the robot, noise added.

    Parameters
    ----------
    reference : (S, T, n)
        Angles that the robot was told, rad.
    table : DataFrame (T rows)
    lengths : (T,) int
        Samples of every trial that are kept, from its first.
    seeds : Seeds
        Whose streams go by the numbers in the table's column ``trial``.
    said : str
        Of the provenance.
    """
    motor, sensor = rows(motion.motor, lengths), rows(motion.sensor, lengths)
    q = rows(motion.q, lengths)
    offsets = np.concatenate([[0], np.cumsum(lengths)])
    if noise != "none":
        q = rows(motion.q_measured, lengths)
        for number, first, last in zip(table["trial"], offsets, offsets[1:], strict=False):
            white = seeds.stream(int(number), "torque").standard_normal((last - first, q.shape[1]))
            motor[first:last] += device.torque_noise_Nm * white
            white = seeds.stream(int(number), "sensor").standard_normal(last - first)
            sensor[first:last] += device.sensor_noise_Nm * white
    told = rows(reference, lengths)
    extra = dict(zip(command_columns("joint", device.n_axes), told.T, strict=True))
    return Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=table,
        offsets=offsets,
        time_s=np.concatenate([np.arange(length) / RATE_HZ for length in lengths]),
        position=q,
        # a recording holds torques by the limb on the device: the opposite of the motors'
        force=-motor,
        torque="commanded",
        subject=subject,
        extra=extra | {"sensor2_Nm": sensor},
        provenance=(said,),
    )
