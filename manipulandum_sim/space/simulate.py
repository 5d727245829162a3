"""Simulated sessions in space: (Recording, SpaceTruth)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.conventions import command_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.core.skeleton import GRAVITY_M_S2
from manipulandum_sim.hand import (
    LED_EVERY,
    RATE_HZ,
    REST_V,
    Draws,
    Run,
    Schedule,
    SimulatedSubject,
    find_subject,
    make_schedule,
    quantised,
    raw_emg,
    voluntary_force,
)
from manipulandum_sim.space.conditions import SpaceCondition
from manipulandum_sim.space.directions import angles_deg, sphere_directions
from manipulandum_sim.space.drive import Drive, SpaceTrack, integrate_space
from manipulandum_sim.space.plant import Plant
from manipulandum_sim.space.rig import AFTER_S, SpaceRig
from manipulandum_sim.space.truth import SpaceTruth, find_space_truth

#: Trials that are simulated at once.
BLOCK: Final = 512
#: First number of the random keys of these rigs, and of repeats of one condition.
SPACE_KEY: Final = 300
REPEAT_KEY: Final = 301

Progress = Callable[[int, int], None]


def simulate_space(
    conditions: Sequence[SpaceCondition] = (SpaceCondition(),),
    *,
    seed: int,
    subject: str | SimulatedSubject = "A",
    sets: int = 2,
    repeats: int = 1,
    progress: Progress | None = None,
    **rig: Any,
) -> tuple[Recording, SpaceTruth]:
    """A session in space: returning disturbances along directions on a sphere.

    Parameters
    ----------
    conditions : sequence of SpaceCondition
    seed : int
        Every trial draws from a generator of its own: more sets, conditions or repeats leave it.
    subject : {"A", "B", "C", "D"} or SimulatedSubject
    sets : int
        Times that each direction is taken in each condition.
    repeats : int
        More than one: a single condition many times over, as ``repeat_000`` and so on; the truth
        has it once under its own name.
    progress : callable, optional
        Told ``(trials done, trials in all)``.
    **rig
        Fields of `SpaceRig`.

    Returns
    -------
    Recording
        Force by the limb on the handle.
    SpaceTruth

    Raises
    ------
    InputError
        If a name is unknown or a value out of range.
    """
    if sets < 1 or repeats < 1 or not conditions:
        raise InputError(f"{sets} sets, {repeats} repeats", expected="1 or more")
    if repeats > 1 and len(conditions) > 1:
        raise InputError("repeats of several conditions", expected="one condition")
    person, used = find_subject(subject), SpaceRig(**rig)
    plants = [c.plant(person, used) for c in conditions]
    names = [c.name for c in conditions]
    if len(set(names)) < len(names):
        raise InputError("a condition stands twice", expected="each once")
    forces = np.array([c.force for c in conditions], dtype=float)
    truth = find_space_truth(plants, forces, names, used.handle_mass_kg, used.elbow)
    runs = [Run(row, name, (SPACE_KEY, row)) for row, name in enumerate(names)]
    if repeats > 1:
        runs = [Run(0, f"repeat_{i:03d}", (REPEAT_KEY, i)) for i in range(repeats)]
    schedule = make_schedule(seed, runs, sets, sphere_directions(used.directions))
    session = _Session(used, plants, truth, schedule, seed)
    return session.recording(conditions, person, progress), truth


@dataclass(frozen=True)
class _Session:
    rig: SpaceRig
    plants: Sequence[Plant]
    truth: SpaceTruth
    schedule: Schedule
    seed: int

    def recording(
        self,
        conditions: Sequence[SpaceCondition],
        person: SimulatedSubject,
        progress: Progress | None,
    ) -> Recording:
        schedule, rig = self.schedule, self.rig
        lengths = schedule.onset + round((rig.duration_s + AFTER_S) * RATE_HZ) + 1
        parts = []
        for rows in self._blocks():
            parts.append(self._sensed(rows, lengths[rows]))
            if progress:
                progress(int(rows[-1]) + 1, len(lengths))
        place, force, angles, told, emg = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        names = command_columns("hand", 3)
        commanded = rig.command and rig.control == "position"
        return Recording(
            kind="hand",
            sample_rate_hz=RATE_HZ,
            trials=self._table(conditions),
            offsets=np.concatenate([[0], np.cumsum(lengths)]),
            time_s=np.concatenate([np.arange(n) / RATE_HZ for n in lengths]),
            position=place,
            force=force,
            joint_angles=angles,
            emg=emg if rig.emg else None,
            muscles=self._muscles if rig.emg else (),
            extra=dict(zip(names, told.T, strict=True)) if commanded else {},
            handle_mass_kg=rig.handle_mass_kg,
            shoulder_m=np.zeros(3),
            gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2),
            subject=person.record,
            provenance=(*rig.sentences, f"seed {self.seed}"),
        )

    @property
    def _muscles(self) -> tuple[str, ...]:
        return self.plants[0].muscles.names

    def _blocks(self) -> list[IntArray]:
        """Rows of the schedule, some of one condition at a time."""
        blocks = []
        for condition in range(len(self.plants)):
            rows = np.flatnonzero(self.schedule.condition == condition)
            blocks += np.array_split(rows, max(1, -(-len(rows) // BLOCK)))
        return blocks

    def _sensed(self, rows: IntArray, lengths: IntArray) -> tuple[FloatArray, ...]:
        """Place, force, angles, command and EMG of some trials, one after another."""
        rig, schedule = self.rig, self.schedule
        row = int(schedule.condition[rows[0]])
        hand, hold = self.truth.hand[row], -self.truth.force[row]
        drive = Drive(self.plants[row], rig, hand, hold, schedule.unit[rows], schedule.onset[rows])
        keys = [schedule.keys[int(r)] for r in rows]
        draws = _draw(self.seed, keys, rig.samples, len(self.plants[row].posture))
        track = integrate_space(drive, voluntary_force(rig.level, draws.hand, RATE_HZ))
        lag = (np.arange(rig.samples) - drive.onset[:, None]) / RATE_HZ
        told = hand + drive.unit[:, None] * drive.profile(lag)[0][..., None]
        keep = np.arange(rig.samples) < lengths[:, None]
        parts = (*self._sensors(track, draws), told, self._emg(keys, self.plants[row]))
        return tuple(part[keep] for part in parts)

    def _emg(self, keys: list[tuple[int, ...]], plant: Plant) -> FloatArray:
        """EMG of some trials with one plant, (T, S, m); without EMG m is 0."""
        if not self.rig.emg:
            return np.zeros((len(keys), self.rig.samples, 0))
        activation = np.tile(plant.tension / plant.muscles.greatest, (len(keys), 1))
        return raw_emg(self.seed, keys, activation, self.rig.samples, RATE_HZ, self._mvc_V)

    @property
    def _mvc_V(self) -> FloatArray:  # noqa: N802
        """Rectified mean of each muscle's EMG in its maximum voluntary contraction, V."""
        return np.linspace(0.7e-3, 0.3e-3, len(self._muscles))

    def _sensors(self, track: SpaceTrack, draws: _SpaceDraws) -> tuple[FloatArray, ...]:
        level = self.rig.level
        force = quantised(track.sensor + level.force_sd * draws.hand.white, level.force_step)
        place = quantised(track.place, level.encoder_step, draws.hand.grid[:, None])
        angles = track.angles[:, ::LED_EVERY] + level.led_sd * draws.angles
        return place, force, np.repeat(angles, LED_EVERY, axis=1)[:, : place.shape[1]]

    def _table(self, conditions: Sequence[SpaceCondition]) -> pd.DataFrame:
        schedule = self.schedule
        onset = schedule.onset / RATE_HZ
        azimuth, elevation = angles_deg(schedule.unit)
        force = np.array([c.force for c in conditions])[schedule.condition]
        activation = np.array([c.cocontraction for c in conditions])
        columns: dict[str, Any] = {
            "trial": np.arange(1, len(onset) + 1),
            "condition": list(schedule.labels),
            "experiment": "space",
            "set": schedule.set_number,
            "direction_deg": azimuth,
            "elevation_deg": elevation,
            "onset_s": onset,
            "end_s": onset + self.rig.duration_s,
            "elbow": self.rig.elbow,
            "wrist": self.rig.wrist,
            "target_activation": activation[schedule.condition],
        }
        columns |= {f"target_force_{axis}_N": force[:, i] for i, axis in enumerate("xyz")}
        if self.rig.emg:
            known = zip(self._muscles, self._mvc_V, strict=True)
            columns |= {f"mvc_{muscle}_V": volt for muscle, volt in known}
            columns |= {f"rest_{muscle}_V": REST_V for muscle in self._muscles}
        return pd.DataFrame(columns)


@dataclass(frozen=True)
class _SpaceDraws:
    """Standard random numbers of T trials: those of the hand's axes, and of the angles."""

    hand: Draws
    angles: FloatArray


def _draw(seed: int, keys: Sequence[tuple[int, ...]], samples: int, joints: int) -> _SpaceDraws:
    """Random numbers of each trial from a generator of its own, as in the planar rig."""
    leds, trials = -(-samples // LED_EVERY), len(keys)
    phase, grid = np.empty((2, trials, 3))
    white, slow = np.empty((2, trials, samples, 3))
    angles = np.empty((trials, leds, joints))
    for t, key in enumerate(keys):
        rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
        phase[t], grid[t] = rng.random((2, 3))
        for store in (white, slow, angles):
            rng.standard_normal(out=store[t])
    none = np.zeros((trials, 0, 3))
    return _SpaceDraws(Draws(np.zeros((trials, 3)), phase, grid, white, slow, none), angles)
