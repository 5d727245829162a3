"""A session of reaches, some of them pushed: (Recording, MovementTruth)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from manipulandum_sim.hand import (
    RATE_HZ,
    Arm,
    NoiseLevel,
    SimulatedSubject,
    find_noise,
    find_subject,
    quantised,
)
from manipulandum_sim.movement.commands import N_PHASES, Commands
from manipulandum_sim.movement.path import N_DRAWS, Courses
from manipulandum_sim.movement.rig import MovementRig
from manipulandum_sim.movement.run import Ran, Reaches, run
from manipulandum_sim.movement.truth import MovementTruth, find_truth

#: First number of the random keys of reaches; the hand's other experiments have theirs.
MOVEMENT_KEY: Final = 200
#: Trials that are integrated at once.
BLOCK: Final = 128


class _Block(NamedTuple):
    """Position and force as measured (T, S, 2), push onsets (T,), robot's commands (T, S, 2)."""

    position: FloatArray
    force: FloatArray
    onset_s: FloatArray
    command: FloatArray


def simulate_movement(
    *,
    seed: int,
    subject: str | SimulatedSubject = "A",
    repeats: int = 5,
    unperturbed: int = 40,
    progress: Callable[[int, int], None] | None = None,
    **rig: Any,
) -> tuple[Recording, MovementTruth]:
    """Reaches of one person: some free, some pushed at each phase in every direction.

    Parameters
    ----------
    seed : int
        Every trial draws from a generator of its own.
    subject : {"A", "B", "C", "D"} or SimulatedSubject
    repeats : int
        Pushes of each phase and direction.
    unperturbed : int
        Reaches that nobody pushes, spread among the others.
    progress : callable, optional
        Told ``(trials done, trials in all)``.
    **rig
        Fields of `rig.MovementRig`.

    Returns
    -------
    Recording
        ``perturbation`` is "moving"; the trial table holds ``phase``, ``push_deg``,
        ``push_onset_s`` and ``push_end_s``, empty where nobody pushed.
    MovementTruth

    Raises
    ------
    InputError
        A number or a name is out of range.
    """
    if repeats < 1 or unperturbed < 0:
        raise InputError(f"{repeats} repeats, {unperturbed} unperturbed", expected="1, 0 or more")
    person, made = find_subject(subject), MovementRig(**rig)
    phase, direction = _order(made, repeats, unperturbed, seed)
    parts = []
    for rows in np.array_split(np.arange(len(phase)), -(-len(phase) // BLOCK)):
        parts.append(_block(person, made, seed, rows, phase, direction))
        if progress is not None:
            progress(int(rows[-1]) + 1, len(phase))
    recording = _recording(person, made, phase, direction, parts, seed)
    return recording, find_truth(made, person)


def _order(
    rig: MovementRig, repeats: int, unperturbed: int, seed: int
) -> tuple[IntArray, FloatArray]:
    """Phase (-1: none) and direction (rad) of each trial, in random order."""
    phase, direction = np.meshgrid(np.arange(len(rig.phases)), np.arange(rig.directions))
    pushed = np.repeat(np.stack([phase.ravel(), direction.ravel()]), repeats, axis=1)
    free = np.stack([np.full(unperturbed, -1), np.zeros(unperturbed, int)])
    every = np.concatenate([pushed, free], axis=1)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(MOVEMENT_KEY,)))
    every = every[:, rng.permutation(every.shape[1])]
    return every[0], 2 * np.pi / rig.directions * every[1]


def _block(
    person: SimulatedSubject,
    rig: MovementRig,
    seed: int,
    rows: IntArray,
    phase: IntArray,
    direction: FloatArray,
) -> _Block:
    """A block of trials."""
    samples = round(rig.duration_s * RATE_HZ) + 1
    level = find_noise("none" if rig.noise == "none" else "sensor")
    draws = [
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(MOVEMENT_KEY, 1, int(r))))
        for r in rows
    ]
    courses = np.stack([g.standard_normal(N_DRAWS) for g in draws], axis=1)
    own = np.stack([g.standard_normal((samples, 2)) for g in draws], axis=-1)
    white = np.stack([g.standard_normal((samples, 2)) for g in draws])
    grid = np.stack([g.random(2) for g in draws])[:, None]
    angle = direction[rows]
    commands = None
    if rig.shape.throughout:
        commands = Commands.drawn(rig.shape, np.stack([g.random(N_PHASES) for g in draws], axis=1))
    reaches = Reaches(
        Arm.of(person),
        rig,
        Courses.drawn(rig.line, rig.go_s, rig.variability, courses),
        phase[rows],
        np.stack([np.cos(angle), np.sin(angle)]),
        commands,
    )
    ran = run(reaches, _slow(own, rig))
    return _Block(*_sensed(ran, level, white, grid), _commanded(ran, commands))


def _commanded(ran: Ran, commands: Commands | None) -> FloatArray:
    """Commands of the robot (T, S, 2), 0 without a push."""
    samples, _, trials = ran.position.shape
    if commands is None:
        return np.zeros((trials, samples, 2))
    time = np.arange(samples) / RATE_HZ
    force = [commands.value(t - ran.push_onset_s) for t in time]
    return np.nan_to_num(np.stack(force)).transpose(2, 0, 1)


def _slow(white: FloatArray, rig: MovementRig) -> FloatArray:
    """The hand's own slow force (S, 2, T), an Ornstein-Uhlenbeck process."""
    v = rig.variability
    keep = np.exp(-1 / (v.force_time_s * RATE_HZ))
    force = np.empty_like(white)
    force[0] = white[0]
    for s in range(1, len(white)):
        force[s] = keep * force[s - 1] + np.sqrt(1 - keep**2) * white[s]
    return np.asarray(v.force_n * force)


def _sensed(
    ran: Ran, level: NoiseLevel, white: FloatArray, grid: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    position = quantised(ran.position.transpose(2, 0, 1), level.encoder_step, grid)
    force = ran.force.transpose(2, 0, 1) + level.force_sd * white
    return position, quantised(force, level.force_step), ran.push_onset_s


def _recording(
    person: SimulatedSubject,
    rig: MovementRig,
    phase: IntArray,
    direction: FloatArray,
    parts: list[_Block],
    seed: int,
) -> Recording:
    position, force, onset, command = map(np.concatenate, zip(*parts, strict=True))
    trials, samples, _ = position.shape
    random = rig.shape.throughout
    names = np.array([f"{100 * share:g}%" for share in rig.phases] + [""], dtype=object)
    told_robot = {f"command_{axis}": command[..., k].ravel() for k, axis in enumerate("xy")}
    # a reach that ends before the place of its push is not pushed
    phase = np.where(np.isfinite(onset), phase, -1)
    table = pd.DataFrame(
        {
            "trial": np.arange(1, trials + 1),
            "condition": rig.device,
            "phase": names[phase],
            "push_deg": np.where((phase >= 0) & ~random, np.degrees(direction), np.nan),
            "push_onset_s": onset,
            "push_end_s": onset + rig.shape.duration_s,
        }
    )
    push = rig.shape
    told = f"reaches of {rig.line.length_m:g} m, device {rig.device}, pushes: {push.kind}"
    return Recording(
        kind="hand",
        sample_rate_hz=RATE_HZ,
        trials=table,
        offsets=np.arange(trials + 1) * samples,
        time_s=np.tile(np.arange(samples) / RATE_HZ, trials),
        position=position.reshape(-1, 2),
        force=force.reshape(-1, 2),
        perturbation="moving",
        handle_mass_kg=rig.handle_mass_kg,
        shoulder_m=np.zeros(2),
        subject=person.record,
        extra=told_robot if random else {},
        provenance=(told, f"seed {seed}"),
    )
