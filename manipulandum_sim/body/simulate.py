"""A person moving on two force plates under motion capture: (recording, truth)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal, overload

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from manipulandum_sim.body.motions import MOTIONS, ON_A_STAND
from manipulandum_sim.body.performance import body_motion, still_postures
from manipulandum_sim.body.plan import BodyMotion
from manipulandum_sim.body.segments import inertial_parameters
from manipulandum_sim.body.subject import BodySubject, find_body_subject
from manipulandum_sim.body.truth import BodyTruth
from manipulandum_sim.force_plates import PLATE_ORIGINS_M, about, foot_wrenches, support_torques
from manipulandum_sim.studio import Studio, film
from manipulandum_sim.tree_dynamics import contact_wrench, inverse_dynamics, move

#: The twelve motions on the plates.
ALL: Final = tuple(MOTIONS)
#: Still postures of the condition "static", each a trial of so many samples.
STATIC: Final = "static"
POSTURES: Final = 60
POSTURE_SAMPLES: Final = 20
#: Slower cameras miss what a step is made of.
LOWEST_RATE_HZ: Final = 20.0
#: A marker's distance from the joints: what makes of an error in place one in angle (m).
LEVER_M: Final = 0.25


@overload
def simulate_body(
    motions: Sequence[str] = ...,
    *,
    subject: str | BodySubject = ...,
    seed: int = ...,
    sample_rate_hz: float = ...,
    angle_noise_rad: float = ...,
    force_noise_N: float = ...,
    moment_noise_Nm: float = ...,
    place_noise_m: float | None = ...,
    markers: Literal[False] = ...,
) -> tuple[MotionRecording, BodyTruth]: ...


@overload
def simulate_body(
    motions: Sequence[str] = ...,
    *,
    subject: str | BodySubject = ...,
    seed: int = ...,
    sample_rate_hz: float = ...,
    angle_noise_rad: float = ...,
    force_noise_N: float = ...,
    moment_noise_Nm: float = ...,
    place_noise_m: float | None = ...,
    markers: Literal[True] | Studio,
) -> tuple[MarkerRecording, BodyTruth]: ...


def simulate_body(
    motions: Sequence[str] = ALL,
    *,
    subject: str | BodySubject = "A",
    seed: int = 0,
    sample_rate_hz: float = 100.0,
    angle_noise_rad: float = 0.002,
    force_noise_N: float = 1.0,  # noqa: N803
    moment_noise_Nm: float = 0.5,  # noqa: N803
    place_noise_m: float | None = None,
    markers: bool | Studio = False,
) -> tuple[MotionRecording | MarkerRecording, BodyTruth]:
    """Record a person's motions, one trial each.

    The recording's skeleton has the subject's bones and the *table's* masses and inertias, which is
    what a laboratory knows; the subject's own are in the truth. Coordinates are quintic splines
    with knots at the samples: without noise, such a spline through the recorded coordinates gives
    the exact derivatives back. Plates: the right foot's, then the left foot's.

    Parameters
    ----------
    motions : sequence of str
        Names of motions: some of `ALL`, ``"pelvis_still"`` or ``"static"`` (one trial per
        posture); one may come twice.
        The last two are held by the pelvis on a stand, and both plates carry half of it.
    subject : {"A", "B", "table"} or BodySubject
    seed : int
        A trial depends on the seed, its motion and how often that came before, on nothing else
        (its film also on its number).
    sample_rate_hz : float
    angle_noise_rad, force_noise_N, moment_noise_Nm : float
        Sd of white noise on all angles, and on each plate's forces and moments.
    place_noise_m : float, optional
        Noise of the pelvis' place; by default a quarter of a metre times the angles' noise.
    markers : bool or Studio
        Film the markers instead of recording coordinates; the noise on angles and place has then
        no meaning, the studio's counts.

    Returns
    -------
    recording : MotionRecording, or MarkerRecording with `markers`
    truth : BodyTruth

    Raises
    ------
    InputError
        An unknown motion or subject, none at all, a rate or noise that is no such number.
    """
    who = find_body_subject(subject)
    place_noise = LEVER_M * angle_noise_rad if place_noise_m is None else place_noise_m
    noise = _Noise(place_noise, angle_noise_rad, force_noise_N, moment_noise_Nm)
    _check(motions, sample_rate_hz)
    trials = _trials(motions, who, seed, sample_rate_hz)
    parts = [_Exact.of(who, trial.name, trial.motion) for trial in trials]
    sensed = [noise.on(part, trial.rng) for part, trial in zip(parts, trials, strict=True)]
    names = [trial.name for trial in trials]
    recording = MotionRecording(
        sample_rate_hz=sample_rate_hz,
        trials=pd.DataFrame({"trial": np.arange(1, len(trials) + 1), "condition": names}),
        offsets=np.cumsum([0, *(len(part.q) for part in parts)]),
        time_s=np.concatenate([trial.motion.time_s for trial in trials]),
        coordinates=np.concatenate([q for q, _ in sensed]),
        skeleton=who.table_skeleton,
        wrenches=np.concatenate([w for _, w in sensed]),
        plate_origins_m=PLATE_ORIGINS_M,
        subject=who.record,
        provenance=(f"simulated body {who.id}, seed {seed}",),
    )
    truth = _truth(who, parts)
    if markers is False:
        return recording, truth
    exact = replace(recording, coordinates=np.concatenate([part.q for part in parts]))
    return film(exact, None if markers is True else markers, seed=seed), truth


def _check(motions: Sequence[str], rate_hz: float) -> None:
    """Raise for arguments that make no recording."""
    if len(motions) == 0:
        raise InputError("no motions to simulate", expected=f"some of {', '.join(ALL)}")
    if not (np.isfinite(rate_hz) and rate_hz >= LOWEST_RATE_HZ):
        problem = f"a body is sampled at {rate_hz} Hz"
        raise InputError(problem, expected=f"{LOWEST_RATE_HZ:g} Hz or more")


@dataclass(frozen=True)
class _Trial:
    name: str
    motion: BodyMotion
    rng: np.random.Generator


def _trials(motions: Sequence[str], who: BodySubject, seed: int, rate_hz: float) -> list[_Trial]:
    """One per motion, many of "static"; each has a generator of its own."""
    known = (*ALL, *ON_A_STAND, STATIC)
    times: Counter[str] = Counter()
    trials = []
    for name in motions:
        if name not in known:
            raise InputError(f"no motion {name!r}", expected=f"one of {', '.join(known)}")
        key = (known.index(name), times[name])
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
        times[name] += 1
        if name == STATIC:
            postures = still_postures(who, rng, rate_hz, POSTURES, POSTURE_SAMPLES)
            trials += [_Trial(name, posture, rng) for posture in postures]
        else:
            trials.append(_Trial(name, body_motion(name, who, rng, rate_hz), rng))
    return trials


@dataclass(frozen=True)
class _Exact:
    """One trial without noise; the plates' wrenches are about their own origins."""

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    generalised_forces: FloatArray
    joint_torques: FloatArray
    foot_wrenches: FloatArray
    plates: FloatArray

    @classmethod
    def of(cls, who: BodySubject, name: str, motion: BodyMotion) -> _Exact:
        """Forces of a motion."""
        states = motion.q, motion.qd, motion.qdd
        whole = contact_wrench(who.skeleton, *states)
        tau = inverse_dynamics(who.skeleton, *states)
        if name in MOTIONS:
            feet, _ = foot_wrenches(whole, motion.left_share, motion.supports)
            joints = tau - support_torques(who.skeleton, move(who.skeleton, *states), feet)
            joints[:, :6] = 0.0
            plates = feet
        else:
            feet = np.zeros((len(whole), 2, 6))
            joints = tau.copy()
            joints[:, :6] = 0.0
            plates = np.stack([0.5 * whole, 0.5 * whole], axis=1)
        return cls(*states, tau, joints, feet, about(plates, PLATE_ORIGINS_M))


@dataclass(frozen=True)
class _Noise:
    place_m: float
    angle_rad: float
    force: float
    moment: float

    def __post_init__(self) -> None:
        for sd in (self.place_m, self.angle_rad, self.force, self.moment):
            if not (np.isfinite(sd) and sd >= 0):
                raise InputError(f"noise of {sd}", expected="0 or more")

    def on(self, exact: _Exact, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Coordinates and the plates' wrenches as sensed."""
        sd = np.full(exact.q.shape[1], self.angle_rad)
        sd[:3] = self.place_m
        coordinates = exact.q + sd * rng.standard_normal(exact.q.shape)
        levels = np.repeat([self.force, self.moment], 3)
        return coordinates, exact.plates + levels * rng.standard_normal(exact.plates.shape)


def _truth(who: BodySubject, parts: list[_Exact]) -> BodyTruth:
    samples = ("q", "qd", "qdd", "generalised_forces", "joint_torques", "foot_wrenches")
    return BodyTruth(
        segments=tuple(s.name for s in who.skeleton.segments),
        coordinates=who.skeleton.coordinates,
        parameters=inertial_parameters(who.skeleton),
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in samples},
    )
