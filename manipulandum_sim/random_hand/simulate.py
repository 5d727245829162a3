"""A session of random perturbations: (Recording, RandomTruth)."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import AXES
from armimpedance.core.records import Recording
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.hand import (
    Arm,
    Condition,
    SimulatedSubject,
    find_subject,
    find_truth,
    muscle_command,
    nominal_hand,
    quantised,
)
from manipulandum_sim.random_hand.commands import FINE, own_force, random_command
from manipulandum_sim.random_hand.drive import RandomDrive, RandomTrack
from manipulandum_sim.random_hand.limbs import Limb, PlanarLimb, SpaceLimb
from manipulandum_sim.random_hand.rig import RATE_HZ, Driver, RandomRig
from manipulandum_sim.random_hand.truth import RandomTruth
from manipulandum_sim.space import SpaceCondition, SpaceRig, find_space_truth

#: First number of the random keys of this rig.
RANDOM_KEY: Final = 400
#: Co-contraction of both arms, parts of the greatest activation.
COCONTRACTION: Final = 0.12


def simulate_random(
    *,
    seed: int,
    subject: str | SimulatedSubject = "A",
    cocontraction: float = COCONTRACTION,
    **rig: Any,
) -> tuple[Recording, RandomTruth]:
    """One person who holds a robot that moves at random.

    Parameters
    ----------
    seed : int
        Every trial draws from a generator of its own.
    subject : {"A", "B", "C", "D"} or SimulatedSubject
    cocontraction : float
    **rig
        Fields of `rig.RandomRig`.

    Returns
    -------
    Recording
        What the robot was told stands in the sample columns ``command_x``, ``command_y`` and in
        space ``command_z``: m, or N where the force is imposed.
    RandomTruth

    Raises
    ------
    InputError
        A number or a name is out of range.
    """
    person, used = find_subject(subject), RandomRig(**rig)
    limb, truth = (_space if used.axes == 3 else _planar)(person, used, cocontraction)
    place, force, command = run_session(used, limb, truth, seed, RANDOM_KEY)
    return _recording(person, used, truth, place, force, command, seed), truth


def run_session(
    rig: Driver, limb: Limb, truth: RandomTruth, seed: int, key: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Place, force and command of all trials as recorded, (S, T, d).

    Parameters
    ----------
    rig : Driver
    limb : Limb
    truth : RandomTruth
        Place and force at rest are used.
    seed, key : int
        Every trial draws from a generator of (seed, key, number).
    """
    draws = [
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(key, t)))
        for t in range(rig.trials)
    ]
    command = np.stack([random_command(rig, rng) for rng in draws], axis=2)
    own = [own_force(rig.level, rig.samples, rig.axes, rng) for rng in draws]
    drive = RandomDrive(rig, limb, truth.hand, -truth.force, command, np.stack(own, axis=1))
    place, force = _sensed(rig, drive.integrate(), draws)
    return place, force, command[0, ::FINE]


def flat(channel: FloatArray) -> FloatArray:
    """Samples (S, T, d) of all trials, one trial after the other."""
    return channel.transpose(1, 0, 2).reshape(-1, channel.shape[2])


def _planar(
    person: SimulatedSubject, rig: RandomRig, cocontraction: float
) -> tuple[Limb, RandomTruth]:
    arm = Arm.of(person)
    reflex = (rig.reflex.gain, rig.reflex.delay_s) if rig.reflex else (0.0, 0.0)
    asked = Condition("random", nominal_hand(person), cocontraction=cocontraction)
    true = find_truth(arm, [asked], handle_mass_kg=rig.handle_mass_kg, reflex=reflex)
    muscles = muscle_command(arm, true.posture, true.activation, reflex_gain=reflex[0])
    limb = PlanarLimb(arm, muscles, true.hand[0])
    return limb, _truth_of(true, true.K_e_reflex[0], reflex[1])


def _space(
    person: SimulatedSubject, rig: RandomRig, cocontraction: float
) -> tuple[Limb, RandomTruth]:
    asked = SpaceCondition(cocontraction=cocontraction)
    plant = asked.plant(person, SpaceRig(elbow=rig.elbow, wrist=rig.wrist))
    force = np.array([asked.force])
    true = find_space_truth([plant], force, ["random"], rig.handle_mass_kg, rig.elbow)
    limb = SpaceLimb(plant, rig.reflex.gain if rig.reflex else 0.0)
    R = limb.reflex_at_hand() if rig.reflex else np.zeros((3, 3))
    return limb, _truth_of(true, R, rig.reflex.delay_s if rig.reflex else 0.0)


def _truth_of(true: Any, R: FloatArray, delay_s: float) -> RandomTruth:
    names = ("hand", "force", "M_e", "B_e", "K_e", "M_e_with_handle")
    matrices = {name: getattr(true, name)[0] for name in names}
    return RandomTruth("random", **matrices, K_e_reflex=R, reflex_delay_s=delay_s)


def _sensed(
    rig: Driver, track: RandomTrack, draws: list[np.random.Generator]
) -> tuple[FloatArray, FloatArray]:
    """Place and force as recorded, (S, T, d)."""
    level, (samples, trials, d) = rig.level, track.place.shape
    white = np.stack([rng.standard_normal((samples, d)) for rng in draws], axis=1)
    grid = np.stack([rng.random(d) for rng in draws])
    late = track.sensor
    if rig.force_lag_s:
        t = np.arange(samples) / RATE_HZ
        columns = track.sensor.reshape(samples, -1).T
        late = np.stack([np.interp(t - rig.force_lag_s, t, c) for c in columns], axis=1)
    force = late.reshape(samples, trials, d) + level.force_sd * white
    return quantised(track.place, level.encoder_step, grid), quantised(force, level.force_step)


def _recording(
    person: SimulatedSubject,
    rig: RandomRig,
    truth: RandomTruth,
    place: FloatArray,
    force: FloatArray,
    command: FloatArray,
    seed: int,
) -> Recording:
    samples, trials, d = place.shape
    table = pd.DataFrame({"trial": np.arange(1, trials + 1), "condition": truth.condition})
    if d == 3:
        table["elbow"], table["wrist"] = rig.elbow, rig.wrist
    size = f"{rig.force_n:g} N" if rig.imposed == "force" else f"{1e3 * rig.amplitude_m:g} mm"
    late = f", a reflex of {rig.reflex.gain:g} of the stiffness" if rig.reflex else ""
    told = f"simulated random {rig.imposed}, {size} rms, noise {rig.noise!r}{late}"
    return Recording(
        kind="hand",
        sample_rate_hz=RATE_HZ,
        trials=table,
        offsets=np.arange(trials + 1) * samples,
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=flat(place),
        force=flat(force),
        perturbation="stochastic",
        imposed=rig.imposed,
        handle_mass_kg=rig.handle_mass_kg,
        shoulder_m=np.zeros(d),
        gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2)[-d:] if d == 3 else (0.0, 0.0),
        subject=person.record,
        extra={f"command_{axis}": c for axis, c in zip(AXES, flat(command).T, strict=False)},
        provenance=(told, f"seed {seed}"),
    )
