"""Simulated experiments: (Recording, Truth)."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import frozen
from armimpedance.core.conventions import MUSCLES, command_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from manipulandum_sim.hand.arm_plant import Arm
from manipulandum_sim.hand.emg import MVC_V, REST_V
from manipulandum_sim.hand.experiments import DIRECTIONS, Condition, find_experiment, nominal_hand
from manipulandum_sim.hand.rig import AFTER_S, RATE_HZ, Rig
from manipulandum_sim.hand.schedule import Run, Schedule, make_schedule
from manipulandum_sim.hand.subjects import SimulatedSubject, find_subject
from manipulandum_sim.hand.trials import Batch, Sensed, run_batch
from manipulandum_sim.hand.truth import Truth, find_truth

#: Trials that are simulated at once, up to half as many more.
BLOCK: Final = 1024
#: First number of the random keys of single conditions; the experiments have theirs.
SINGLE_KEY: Final = 100

Progress = Callable[[int, int], None]


def simulate(
    experiment: str,
    *,
    seed: int,
    subject: str | SimulatedSubject = "A",
    sets: int = 5,
    conditions: Collection[str] | None = None,
    places: Mapping[str, tuple[float, float]] | Sequence[tuple[float, float]] | None = None,
    progress: Progress | None = None,
    **rig: Any,
) -> tuple[Recording, Truth]:
    """One of the source's experiments.

    Parameters
    ----------
    experiment : {"postures", "cocontraction", "force"}
    seed : int
        Every trial draws from a generator of its own: a subset of conditions, fewer sets or
        another batch size leave its samples as they are, to the bit.
    subject : {"A", "B", "C", "D"} or SimulatedSubject
    sets : int
        Sets of eight disturbances per condition.
    conditions : collection of str, optional
        Only these.
    places : mapping or sequence of pairs, optional
        Hand locations of your own from the shoulder (m), for "postures": their names with x and
        y, or x and y alone, which are named ``place_01`` and so on.
    progress : callable, optional
        Told ``(trials done, trials in all)``.
    **rig
        Fields of `rig.Rig`: disturbance, amplitude_m, duration_s, residual_m, servo, noise, reflex,
        emg, command, handle_mass_kg, robot, substeps, compiled.

    Returns
    -------
    Recording
        Force by the limb on the handle; EMG in V, and each muscle's envelope in a maximum
        voluntary contraction and when silent in the trial table's columns ``mvc_<muscle>_V``
        and ``rest_<muscle>_V``.
    Truth

    Raises
    ------
    InputError
        If a name is unknown or a value out of range.
    """
    person, plan = find_subject(subject), find_experiment(experiment)
    known = plan.conditions(person) if places is None else _at(places, experiment)
    wanted = [c.name for c in known] if conditions is None else list(conditions)
    unknown = sorted(set(wanted) - {c.name for c in known})
    if unknown or not wanted:
        raise InputError(
            f"no condition {', '.join(unknown) or 'asked for'} in experiment {experiment!r}",
            expected=f"such as {known[0].name}",
        )
    numbered = [(n, c) for n, c in enumerate(known) if c.name in wanted]
    runs = [Run(row, c.name, (plan.key, n)) for row, (n, c) in enumerate(numbered)]
    chosen = [c for _, c in numbered]
    return _session(person, Rig(**rig), chosen, runs, sets, seed, experiment, progress)


def _at(
    places: Mapping[str, tuple[float, float]] | Sequence[tuple[float, float]], experiment: str
) -> tuple[Condition, ...]:
    """A relaxed arm at places of one's own."""
    if experiment != "postures":
        raise InputError(f"places in experiment {experiment!r}", expected="experiment 'postures'")
    named = (
        places
        if isinstance(places, Mapping)
        else {f"place_{number:02d}": place for number, place in enumerate(places, start=1)}
    )
    if not named:
        raise InputError("no place", expected="x and y of at least one, m")
    return tuple(Condition(name, (float(x), float(y))) for name, (x, y) in named.items())


def simulate_condition(
    condition: Condition | None = None,
    *,
    seed: int,
    subject: str | SimulatedSubject = "A",
    repeats: int = 1,
    sets: int = 5,
    progress: Progress | None = None,
    **rig: Any,
) -> tuple[Recording, Truth]:
    """One condition many times over, for Monte Carlo studies.

    Parameters
    ----------
    condition : Condition, optional
        Default: relaxed in the nominal posture.
    seed, subject
        As for `simulate`.
    repeats : int
        Repeat r is the condition ``repeat_00r`` of the recording; more repeats leave the first
        ones as they are.
    sets, progress, **rig
        As for `simulate`.

    Returns
    -------
    Recording
    Truth
        Truth of the one condition, under its own name.

    Raises
    ------
    InputError
        If a name is unknown or a value out of range.
    """
    person = find_subject(subject)
    condition = condition or Condition("nominal", nominal_hand(person))
    runs = [Run(0, f"repeat_{r:03d}", (SINGLE_KEY, r)) for r in range(repeats)]
    return _session(person, Rig(**rig), [condition], runs, sets, seed, condition.name, progress)


def _session(
    person: SimulatedSubject,
    rig: Rig,
    conditions: Sequence[Condition],
    runs: Sequence[Run],
    sets: int,
    seed: int,
    experiment: str,
    progress: Progress | None,
) -> tuple[Recording, Truth]:
    if sets < 1 or not runs:
        raise InputError(f"{sets} sets, {len(runs)} runs", expected="1 or more")
    rig.shape.warn()
    arm = Arm.of(person)
    truth = find_truth(
        arm, conditions, handle_mass_kg=rig.handle_mass_kg, reflex=rig.reflex_numbers
    )
    schedule = make_schedule(seed, runs, sets)
    lengths = schedule.onset + round((rig.duration_s + AFTER_S) * RATE_HZ) + 1
    parts, angles = [], []
    # of one length: a short rest would take nearly as long as a whole block
    for rows in np.array_split(np.arange(len(lengths)), max(1, round(len(lengths) / BLOCK))):
        sensed = run_batch(Batch(arm, rig, truth, schedule, rows), seed)
        angles.append(_angles_at_rest(sensed, schedule.onset[rows]))
        parts.append(_cut(sensed, lengths[rows]))
        if progress:
            progress(int(rows[-1]) + 1, len(lengths))
    return Recording(
        kind="hand",
        sample_rate_hz=RATE_HZ,
        trials=_trial_table(schedule, conditions, rig, experiment, np.concatenate(angles)),
        offsets=np.concatenate([[0], np.cumsum(lengths)]),
        time_s=np.concatenate([np.arange(n) / RATE_HZ for n in lengths]),
        muscles=MUSCLES if rig.emg else (),
        handle_mass_kg=rig.handle_mass_kg,
        shoulder_m=np.zeros(2),
        subject=person.record,
        provenance=(*rig.sentences, f"seed {seed}"),
        **_joined(parts),
    ), truth


def _joined(parts: list[Sensed]) -> dict[str, Any]:
    """The channels of all trials, one after another."""
    told = [p.commanded for p in parts if p.commanded is not None]
    emg = [p.emg for p in parts if p.emg is not None]
    names = command_columns("hand", 2)
    return {
        "position": frozen(np.concatenate([p.position for p in parts])),
        "force": frozen(np.concatenate([p.force for p in parts])),
        "joint_angles": frozen(np.concatenate([p.joint_angles for p in parts])),
        "emg": frozen(np.concatenate(emg)) if emg else None,
        "extra": dict(zip(names, np.concatenate(told).T, strict=True)) if told else {},
    }


def _angles_at_rest(sensed: Sensed, onset: np.ndarray) -> np.ndarray:
    """Mean joint angles (B, 2) before each onset."""
    return np.stack(
        [angles[:n].mean(axis=0) for angles, n in zip(sensed.joint_angles, onset, strict=True)]
    )


def _cut(sensed: Sensed, lengths: np.ndarray) -> Sensed:
    """Trials one after another, each as long as it was recorded."""
    keep = np.arange(sensed.position.shape[1]) < lengths[:, None]
    return Sensed(
        sensed.position[keep],
        sensed.force[keep],
        sensed.joint_angles[keep],
        None if sensed.emg is None else sensed.emg[keep],
        None if sensed.commanded is None else sensed.commanded[keep],
    )


def _trial_table(
    schedule: Schedule,
    conditions: Sequence[Condition],
    rig: Rig,
    experiment: str,
    angles: np.ndarray,
) -> pd.DataFrame:
    """One row per trial, the columns of the recordings on disk."""
    asked = [conditions[c] for c in schedule.condition]
    force = np.array([c.force for c in asked])
    onset = schedule.onset / RATE_HZ
    columns: dict[str, Any] = {
        "trial": np.arange(1, len(asked) + 1),
        "condition": list(schedule.labels),
        "experiment": experiment,
        "day": schedule.day,
        "set": schedule.set_number,
        "direction_deg": 360.0 / DIRECTIONS * schedule.direction,
        "onset_s": onset,
        "end_s": (schedule.onset + round(rig.duration_s * RATE_HZ)) / RATE_HZ,
        "target_force_x_N": force[:, 0],
        "target_force_y_N": force[:, 1],
        "q_shoulder_rad": angles[:, 0],
        "q_elbow_rad": angles[:, 1],
    }
    if all(c.cocontraction is not None for c in asked):
        columns["target_activation"] = [c.cocontraction for c in asked]
    if rig.emg:
        columns |= {f"mvc_{m}_V": v for m, v in zip(MUSCLES, MVC_V, strict=True)}
        columns |= {f"rest_{m}_V": REST_V for m in MUSCLES}
    return pd.DataFrame(columns)
