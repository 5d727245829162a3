"""`therapy robot`, `therapy arm`, `therapy contribution`: a robot of five axes and who is in it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from broken import damage
from broken.cell import Answer, Cell, Made, Rig, damaged, on_record, said, seeds_of

from armimpedance.joint.therapy import RobotCalibration, TherapyRobot
from armimpedance.joint.therapy.show import calibrate_arm, calibrate_robot, contribution
from manipulandum_sim.therapy import (
    THERAPY_SUBJECTS,
    TherapyOptions,
    simulate_calibration,
    simulate_therapy_many,
    therapy_device,
)

#: Sessions that are simulated; records repeat their motion with sensor noise of their own.
SIMULATED = 3
SPEED_DEG_S = 60.0
PEOPLE = ("S1", "S2", "S7", "S11", "P4")
#: White noise of the torque added to each record, N m.
NOISE_Nm = 0.05


def drawings() -> TherapyRobot:
    """What is known of the robot before it was identified."""
    device = therapy_device()
    return TherapyRobot(
        name=device.name,
        axes=device.axes,
        skeleton=device.skeleton,
        limits_rad=device.limits_rad,
        torque_limit_Nm=device.torque_limit_Nm,
        motor_inertia_kgm2=device.motor_inertia_kgm2,
    )


def noisier(made: Made, index: int) -> Made:
    """The same motion with more noise of the torque: a record of its own."""
    rng = seeds_of("therapy", index)
    force = np.asarray(made.record.force)
    force = force + NOISE_Nm * rng.standard_normal(force.shape)
    return Made(replace(made.record, force=force), made.truth, made.beside)


def numbers(summary: Any) -> dict[str, tuple[float, float, float]]:
    """Value and limits by name and joint."""
    return {f"{p.name} of joint {p.joint}": (p.value, *p.ci95) for p in summary.parameters}


@lru_cache(maxsize=1)
def _calibrations() -> list[Made]:
    device, made = therapy_device(), []
    for seed in range(SIMULATED):
        record, _ = simulate_calibration(
            seed=seed, speeds_deg_s=(0.1, 0.5, 5.0, 20.0, 40.0), held_angles=6
        )
        truth = {}
        for j in range(len(device.axes)):
            values = {
                "tau_c": device.friction.coulomb[j],
                "k_v": device.friction.viscous[j],
                "k_c": device.cable_stiffness[j],
                "q_c": device.cable_rest_rad[j],
            }
            truth |= {f"{name} of joint {j + 1}": float(v) for name, v in values.items()}
        made.append(Made(record, truth, drawings()))
    return made


def empty(indices: Sequence[int]) -> list[Made]:
    """Sweeps and holds of the empty robot."""
    sessions = _calibrations()
    return [noisier(sessions[i % len(sessions)], i) for i in indices]


def ask_robot(made: Made) -> Answer:
    """Friction and cables of every axis."""
    found = calibrate_robot(made.record, made.beside)
    summary = found.summary
    return Answer(numbers(summary), **said(summary.checks, (*summary.warnings,)))


@lru_cache(maxsize=1)
def robot() -> RobotCalibration:
    """The robot as it was identified from the first clean session."""
    return calibrate_robot(_calibrations()[0].record, drawings())


@lru_cache(maxsize=4)
def _sessions(damping: float, lowering: bool, conditions: tuple[str, ...]) -> list[Made]:
    """Passive and half-active movements of a few people, side by side."""
    moved = ("elevation", "horizontal", *(["lowering"] if lowering else []))
    options = TherapyOptions(
        conditions=conditions, movements=moved, repetitions=3, speed_deg_s=SPEED_DEG_S
    )
    slow = np.array([damping, damping, 0.0, 0.0, 0.0])
    people = [replace(_subject(name), damping=slow) if damping else name for name in PEOPLE]
    return [_of_session(*one) for one in simulate_therapy_many(people, 3, options=options)]


def _subject(name: str) -> Any:
    return THERAPY_SUBJECTS[name]


def _of_session(record: Any, truth: Any) -> Made:
    passive_rows = record.trials["condition"].to_numpy() == "passive"
    values = {}
    for axis in range(2):
        of_axis = passive_rows & (record.trials["axis"].to_numpy() == axis + 1)
        values[f"k_s of joint {axis + 1}"] = float(truth.stiffness[of_axis, axis].mean())
        values[f"q_0 of joint {axis + 1}"] = float(truth.rest_rad[of_axis, axis].mean())
    shares = dict(zip(record.trials["trial"], truth.projection, strict=True))
    return Made(record, values, {"shares": shares})


def sessions(
    damping: float = 0.0,
    lowering: bool = True,
    conditions: tuple[str, ...] = ("passive", "half_active"),
) -> Callable[[Sequence[int]], list[Made]]:
    """Records of the people in turns."""

    def make(indices: Sequence[int]) -> list[Made]:
        people = _sessions(damping, lowering, conditions)
        return [noisier(people[i % len(people)], i) for i in indices]

    return make


def ask_arm(made: Made) -> Answer:
    """k_s and q_0 of the two axes that move; what is called not identified is no number."""
    told = calibrate_arm(made.record, made.beside.get("robot") or robot(), **_options(made))
    found = numbers(told.summary)
    for axis in told.axes:
        if not axis.elastic.rest_identified:
            found.pop(f"q_0 of joint {axis.axis + 1}", None)
        if not axis.elastic.stiffness_identified:
            found.pop(f"k_s of joint {axis.axis + 1}", None)
    checks = (*told.summary.checks, *getattr(told, "checks", ()))
    return Answer(found, **said(checks, told.warnings))


def _options(made: Made) -> dict[str, Any]:
    return {k: v for k, v in made.beside.items() if k in ("mass_kg", "condition")}


def ask_share(made: Made) -> Answer:
    """The projection of every movement that is not passive."""
    arm = made.beside.get("arm") or calibrate_arm(made.record, robot(), **_options(made))
    found = contribution(made.record, robot=made.beside.get("robot") or robot(), arm=arm)
    numbers = {}
    for one in found:
        if one.condition != "passive" and one.projection.valid:
            low, high = one.projection.ci95
            numbers[f"trial {one.trial}"] = (one.projection.percent, float(low), float(high))
    # the movements' notes say how to read a number, they are no warnings; the arm's were read
    # when it was calibrated
    checks = (*getattr(found, "checks", ()), *arm.summary.checks)
    return Answer(numbers, **said(checks, (*found.notes, *arm.warnings)))


def shares(make: Any) -> Any:
    """The truth of the movements' shares."""
    return lambda indices: [
        Made(m.record, {f"trial {t}": float(v) for t, v in m.beside["shares"].items()}, m.beside)
        for m in make(indices)
    ]


EMPTY = Rig("therapy robot", "empty robot", empty, ask_robot)
ARM = Rig("therapy arm", "relaxed arm", sessions(), ask_arm)
SHARE = Rig("therapy contribution", "half active", shares(sessions()), ask_share)


def beside(**more: Any) -> Callable[[Made, np.random.Generator], Made]:
    """Something else is told beside the record; functions are of the record made."""
    return lambda made, _rng: Made(
        made.record,
        made.truth,
        {**made.beside, **{k: v(made) if callable(v) else v for k, v in more.items()}},
    )


def heavier_links(factor: float) -> Callable[[Made, np.random.Generator], Made]:
    """The drawings' masses are off."""

    def change(made: Made, _rng: np.random.Generator) -> Made:
        skeleton = made.beside.skeleton
        segments = tuple(replace(s, mass_kg=factor * s.mass_kg) for s in skeleton.segments)
        wrong = replace(made.beside, skeleton=replace(skeleton, segments=segments))
        return Made(made.record, made.truth, wrong)

    return change


def half_active_as_passive(record: Any, _rng: np.random.Generator) -> Any:
    """Somebody helps in the trials that are called passive."""
    condition = record.trials["condition"].to_numpy()
    helped = condition == "half_active"
    # a patient's session has passive trials alone, and stays as it is: nobody helped in it
    kept = record.select(helped if helped.any() else condition == "passive")
    return replace(kept, trials=kept.trials.assign(condition="passive"))


def shifted(axis: int, rad: float) -> Callable[[Any, Any], Any]:
    """An encoder's zero is off."""
    return damage.channel("position", lambda q, _r, _rec: q + rad * np.eye(q.shape[1])[axis])


def weighted_hand(torque_Nm: float) -> Callable[[Any, Any], Any]:
    """Something heavy lies in the hand: a torque on axis 1 that goes with the arm's angle."""

    def change(record: Any, _rng: np.random.Generator) -> Any:
        force = np.array(record.force)
        force[:, 0] -= torque_Nm * np.sin(record.position[:, 0])
        return replace(record, force=force)

    return change


def cells() -> list[Cell]:
    """All of these commands'."""
    units = ("units", "plausible")
    relaxed = ("muscles silent", "relaxed", "voluntary", "the person may not have been passive")
    robots: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("drawings' masses", "20 % more", ("drawings or gain", "masses"),
         damaged(EMPTY, heavier_links(1.2))),
        ("motor torque's gain", "30 % more", ("drawings or gain", "gain"),
         damaged(EMPTY, on_record(damage.gain("force", 1.3)))),
        ("motor torque's sign", "turned", ("sign",),
         damaged(EMPTY, on_record(damage.gain("force", -1.0)))),
        ("motor torque in mNm", "x 1000", units,
         damaged(EMPTY, on_record(damage.gain("force", 1000.0)))),
        ("angles in degrees", "x 57", units,
         damaged(EMPTY, on_record(damage.gain("position", 180 / np.pi)))),
        ("motor torque late", "50 ms", ("skew", "delay"),
         damaged(EMPTY, on_record(damage.late("force", 0.05)))),
    ]  # fmt: skip
    arms: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("arm resists motion", "viscosity .3 N m s/rad, no lowering", ("viscosity",),
         sessions(0.3, lowering=False)),
        ("arm resists motion", "viscosity .3 N m s/rad, lowering recorded", ("viscosity",),
         sessions(0.3)),
        ("muscles are not silent", "half of the weight carried", relaxed,
         damaged(ARM, on_record(half_active_as_passive))),
        ("body mass told", "20 % more", ("mass", "table"),
         damaged(ARM, beside(mass_kg=lambda m: 1.2 * m.record.subject.mass_kg))),
        ("encoder's zero", "10 degrees off, axis 1", ("encoder zero",),
         damaged(ARM, on_record(shifted(0, np.radians(10))))),
    ]  # fmt: skip
    given: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("arm of another body", "mass told 20 % more", ("mass", "table", "arm"),
         damaged(SHARE, beside(
             arm=lambda m: calibrate_arm(
                 m.record, robot(), mass_kg=1.2 * m.record.subject.mass_kg
             )))),
        ("something heavy in the hand", "5 N m, not when calibrated", ("mass", "load", "passive"),
         damaged(SHARE, lambda made, rng: Made(
             weighted_hand(5.0)(made.record, rng), made.truth,
             {**made.beside, "arm": calibrate_arm(made.record, robot())}))),
        ("motor torque's sign", "turned", ("sign",),
         damaged(SHARE, lambda made, rng: Made(
             damage.gain("force", -1.0)(made.record, rng), made.truth,
             {**made.beside, "arm": calibrate_arm(made.record, robot())}))),
        ("muscles were not silent", "half of the weight carried when calibrated", relaxed,
         damaged(SHARE, beside(
             arm=lambda m: calibrate_arm(
                 half_active_as_passive(m.record, np.random.default_rng(0)), robot()
             )))),
    ]  # fmt: skip
    # what lies in the hand is a patient who resists, to all that the robot measures
    blind = ("something heavy in the hand",)
    return [
        *(Cell(EMPTY, *one) for one in robots),
        *(Cell(ARM, *one) for one in arms),
        *(Cell(SHARE, *one, seen=one[0] not in blind) for one in given),
    ]


CLEAN = (EMPTY, ARM, SHARE)
