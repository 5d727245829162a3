"""How many pushes reach K within 5 %: bumps, the designed push, pushes that are chosen.

    python benchmarks/adaptive_trials.py --persons 200 --workers 2
    python benchmarks/adaptive_trials.py --figure docs/evidence/adaptive.svg

Simulated persons differ in K (size, shape, orientation), M, B and in each kind of noise. For each,
the pushes after which `estimate` prints 95 % intervals of K's diagonal within 5 %, looked at after
every set of eight; a fixed design is eight directions in turn. The ratio to the bump of 0.3 s, its
mean and the worst person's; and in how many of the sessions that were stopped like this the
intervals hold the truth.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from tqdm import tqdm

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import ImpedanceEstimate, Recording
from armimpedance.hand.adaptive import (
    Aim,
    Comfort,
    PushingRobot,
    RecordedTrial,
    Setup,
    next_trials,
    recording_of,
)
from armimpedance.hand.planning import (
    SHAPES,
    Limits,
    PlannedArm,
    PlannedMotion,
    Profile,
    Setting,
    noise_named,
    precision,
)
from armimpedance.hand.still import allowing, estimate, in_order

RATE_HZ: Final = 1000.0
REST_S: Final = 0.2
AMPLITUDE_M, DURATION_S, ACCELERATION = 0.005, 0.3, 5.3
WISH: Final = 0.05
SET: Final = 8
#: A fixed design is not followed further.
MOST_SETS: Final = 1000
#: A relaxed arm of a 70 kg man with the handle, nominal posture: M, B, K.
LIMB: Final = np.array(
    [
        [[1.895, -0.655], [-0.655, 1.165]],
        [[8.63, -6.40], [-6.40, 13.86]],
        [[104.8, -74.4], [-74.4, 179.3]],
    ]
)
#: Factors of K, and of each kind of the noise of a relaxed arm, drawn evenly in their logarithm.
STIFFER: Final = (0.7, 2.0)
NOISIER: Final = (0.6, 1.6)


@dataclass(frozen=True)
class Person:
    """M, B, K and the sizes of the noise: slow force, tremor (N), drift (m/s)."""

    limb: FloatArray
    slow: float
    tremor: float
    drift: float

    @classmethod
    def of(cls, number: int) -> Person:
        """The person with this number, always the same."""
        rng = np.random.default_rng(np.random.SeedSequence(43, spawn_key=(number,)))
        stiffer, turn = np.exp(rng.uniform(*np.log(STIFFER))), rng.uniform(-0.5, 0.5)
        R = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        M = rng.uniform(0.8, 1.25) * LIMB[0]
        B, K = np.sqrt(stiffer) * R @ LIMB[1] @ R.T, stiffer * R @ LIMB[2] @ R.T
        sizes = np.exp(rng.uniform(*np.log(NOISIER), 3)) * [0.25, 0.08, 0.003]
        return cls(np.stack([M, B, K]), *map(float, sizes))


def pushed(
    person: Person, profile: Profile, units: FloatArray, rng: np.random.Generator
) -> list[RecordedTrial]:
    """Trials of pushes along unit vectors (T, 2)."""
    t = np.arange(round((2 * REST_S + profile.duration_s) * RATE_HZ) + 1) / RATE_HZ - REST_S
    moved, T, S = profile.at(t), len(units), len(t)
    u = units[:, None, :]
    force = -sum(x[None, :, None] * u @ m.T for x, m in zip(moved[::-1], person.limb, strict=True))
    force = force + rng.normal(0, 0.03, (T, S, 2)) + unsteadiness(person, t, T, rng)
    position = moved[0][None, :, None] * u + rng.uniform(0, 2e-5, (T, 1, 2))
    force = np.round(force / 0.05) * 0.05
    position = np.round(position / 2e-5) * 2e-5
    end = REST_S + profile.duration_s
    return [
        RecordedTrial("person", unit, REST_S, end, x, f)
        for unit, x, f in zip(units, position, force, strict=True)
    ]


def unsteadiness(person: Person, t: FloatArray, T: int, rng: np.random.Generator) -> FloatArray:
    """Tremor at 9 Hz, slow voluntary force, a drifting virtual position, (T, S, 2)."""
    phase = rng.uniform(0, 2 * np.pi, (T, 1, 2))
    force = person.tremor * np.sin(2 * np.pi * 9.0 * t[None, :, None] + phase)
    keep = np.exp(-1 / (RATE_HZ * 0.4))
    slow = rng.normal(0, 1, (T, 2))
    for n in range(len(t)):
        force[:, n] += person.slow * slow
        slow = keep * slow + np.sqrt(1 - keep**2) * rng.normal(0, 1, (T, 2))
    drift = rng.normal(0, person.drift, (T, 1, 2)) * t[None, :, None]
    return np.asarray(force + drift @ person.limb[2].T)


def estimated(trials: list[RecordedTrial]) -> tuple[ImpedanceEstimate, Recording]:
    """What `estimate` finds."""
    recording = recording_of(trials, Setup(RATE_HZ))
    return allowing(estimate(recording), recording, ("condition",))[0], recording


def half_widths(made: ImpedanceEstimate) -> FloatArray:
    """Of K's diagonal, parts of it, (2,)."""
    low, high = (matrices[2].diagonal() for matrices in made.interval())
    return np.asarray((high - low) / np.abs(high + low))


def holds(made: ImpedanceEstimate, person: Person) -> FloatArray:
    """Which intervals of K's elements hold the truth, (2, 2)."""
    low, high = made.interval()
    return np.asarray((low[2] <= person.limb[2]) & (person.limb[2] <= high[2]))


@dataclass(frozen=True)
class Stopped:
    """Pushes done, and which intervals of K held."""

    pushes: int
    held: FloatArray


def fixed(number: int, shape: str) -> Stopped:
    """Sets of eight directions until the wish is met, from the planned number on."""
    person, profile = Person.of(number), Profile(SHAPES.named(shape), AMPLITUDE_M, DURATION_S)
    rng = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(number, len(shape))))
    angle = np.arange(SET) * np.pi / 4
    units = np.column_stack([np.cos(angle), np.sin(angle)])
    trials: list[RecordedTrial] = []

    def met(sets: int) -> tuple[bool, ImpedanceEstimate]:
        while len(trials) < sets * SET:
            trials.extend(pushed(person, profile, units, rng))
        made = estimated(trials[: sets * SET])[0]
        return bool((half_widths(made) <= WISH).all()), made

    sets = planned_sets(person, profile)
    enough, made = met(sets)
    while True:
        step = max(1, sets // 16)
        tried = sets - step if enough else sets + step
        if tried < 2 or tried > MOST_SETS:
            break
        now, other = met(tried)
        if enough and not now:
            break
        sets, made = tried, other
        if now and not enough:
            break
    return Stopped(sets * SET, holds(made, person))


def planned_sets(person: Person, profile: Profile) -> int:
    """What a plan that knows the person would say."""
    trials = precision(planned(person, profile), conditions=1).trials_for_k(WISH)
    return min(max(2, (trials or MOST_SETS * SET) // SET), MOST_SETS)


def planned(person: Person, profile: Profile) -> PlannedMotion:
    """A course, for the planner, of a person who is known."""
    noise = replace(noise_named(), slow_sd=person.slow, tremor=person.tremor, drift_sd=person.drift)
    return PlannedMotion(Setting(PlannedArm(person.limb), noise), profile)


def adaptive(number: int) -> Stopped:
    """Half of the pushes that remain, eight at least, until `estimate` meets the wish.

    Eight where no number seems to be enough: a departure seems to be there, which they show or not.
    """
    person = Person.of(number)
    rng = np.random.default_rng(np.random.SeedSequence(2, spawn_key=(number,)))
    limits = Limits(AMPLITUDE_M, DURATION_S, ACCELERATION)
    robot = PushingRobot(limits, shapes=("designed", "reflex_separating"))
    aim, trials, recording, made, count = Aim(k_part=WISH), [], None, None, SET
    while True:
        step = next_trials(
            recording,
            aim,
            robot,
            Comfort(),
            conditions=["person"],
            count=count,
            found=None if made is None else [made],
            seed=1,
        )
        if step.met and made is not None:
            return Stopped(len(trials), holds(made, person))
        # of a first set, or of one condition: one course
        units = np.array([push.direction for push in step.pushes])
        trials += pushed(person, step.pushes[0].profile, units, rng)
        made, recording = estimated(trials)
        left = step.remaining["person"] - len(step.pushes)
        count = max(SET, left // 2) if step.enough else SET
        if step.targets:
            robot = PushingRobot(limits, course=step.pushes[0].profile)


def person_of(number: int) -> dict[str, Stopped]:
    """All designs on one person."""
    return {
        "bump": fixed(number, "minimum_jerk"),
        "designed": fixed(number, "designed"),
        "adaptive": adaptive(number),
    }


def course_of_fixed(person: Person, shape: str, most: int) -> list[tuple[int, float]]:
    """Pushes, and the larger half-width of K in per cent, after each set of eight directions."""
    profile, rng = Profile(SHAPES.named(shape), AMPLITUDE_M, DURATION_S), np.random.default_rng(1)
    angle = np.arange(SET) * np.pi / 4
    units = np.column_stack([np.cos(angle), np.sin(angle)])
    trials: list[RecordedTrial] = []
    course = []
    while len(trials) < most:
        trials += pushed(person, profile, units, rng)
        course.append((len(trials), 100 * float(half_widths(estimated(trials)[0]).max())))
    return course


def course_of_chosen(person: Person, most: int) -> list[tuple[int, float]]:
    """The same where each set is chosen."""
    robot, rng = PushingRobot(shapes=("designed", "reflex_separating")), np.random.default_rng(2)
    aim, recording = Aim(k_part=WISH / 10), None
    trials: list[RecordedTrial] = []
    course = []
    while len(trials) < most:
        step = next_trials(recording, aim, robot, Comfort(), conditions=["person"], seed=1)
        if step.targets:
            robot = PushingRobot(course=step.pushes[0].profile)
        units = np.array([push.direction for push in step.pushes])
        trials += pushed(person, step.pushes[0].profile, units, rng)
        made, recording = estimated(trials)
        course.append((len(trials), 100 * float(half_widths(made).max())))
    return course


def draw(path: str, number: int = 0, most: int = 120) -> None:
    """The half-width of K over the number of pushes, one session each, of one person."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    person, figure = Person.of(number), Figure(figsize=(6.0, 3.6), layout="constrained")
    axes = figure.subplots()
    for name, course in (
        ("bump of 0.3 s, eight directions", course_of_fixed(person, "minimum_jerk", most)),
        ("designed, eight directions", course_of_fixed(person, "designed", most)),
        ("next", course_of_chosen(person, most)),
    ):
        axes.plot(*np.transpose(course), marker="o", markersize=3, label=name)
    axes.axhline(100 * WISH, color="0.5", linewidth=1, linestyle="--")
    axes.set(xlabel="pushes", ylabel="half-width of K (% of K)", yscale="log", xlim=(0, most))
    axes.set_yticks([2, 5, 10, 20, 50, 100], ["2", "5", "10", "20", "50", "100"])
    axes.legend(frameon=False)
    with rc_context({"svg.hashsalt": "adaptive"}):  # the same numbers give the same file
        figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Print pushes and ratios, or draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--persons", type=int, default=200)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--figure", metavar="FILE", help="draw one person's sessions instead")
    asked = parser.parse_args()
    if asked.figure:
        draw(asked.figure)
        return
    pieces = [(number,) for number in range(asked.persons)]
    found = list(tqdm(in_order(person_of, pieces, asked.workers), total=len(pieces), disable=None))
    bump = np.array([one["bump"].pushes for one in found], dtype=float)
    for name in ("bump", "designed", "adaptive"):
        pushes = np.array([one[name].pushes for one in found], dtype=float)
        held = np.mean([one[name].held for one in found], axis=0)
        ratio = pushes / bump
        print(
            f"{name:9s} pushes: median {np.median(pushes):.0f}; of the bump's: mean of ratios "
            f"{ratio.mean():.3f}, all pushes {pushes.sum() / bump.sum():.3f}, worst person "
            f"{ratio.max():.3f} (number {ratio.argmax()}); intervals of K that hold: "
            f"{np.round(100 * held, 1).tolist()} %"
        )


if __name__ == "__main__":
    main()
