"""Two conditions whose K differs in size by 20 %: pushes to detect it with a power of 90 %.

    python benchmarks/adaptive_difference.py --persons 200

For each simulated person of adaptive_trials.py a second condition, whose ellipse of K is 20 %
larger, and whose noise is another one's. A fixed design spreads the designed push evenly over all
directions and both conditions and looks once, at the end; `next` chooses, and looks after each
group. Printed: the ratio of the pushes, how often the difference is detected at the level of 5 %,
and the same where there is none.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from adaptive_trials import AMPLITUDE_M, DURATION_S, RATE_HZ, Person, holds, planned, pushed
from scipy.special import stdtrit
from tqdm import tqdm

from armimpedance.core.arrays import FloatArray
from armimpedance.hand.adaptive import (
    Aim,
    Comfort,
    PushingRobot,
    RecordedTrial,
    Setup,
    next_trials,
    recording_of,
)
from armimpedance.hand.ellipses import ellipse
from armimpedance.hand.planning import SHAPES, Profile, precision
from armimpedance.hand.still import allowing, estimate
from armimpedance.numerics.regression import t_factor

PART: Final = 0.2
NAMES: Final = ("first", "second")
AIM: Final = Aim(difference_part=PART, between=NAMES)
#: A session ends here in any case.
MOST: Final = 4000
DESIGNED: Final = Profile(SHAPES.named("designed"), AMPLITUDE_M, DURATION_S)


def two_conditions(number: int, part: float) -> tuple[Person, Person]:
    """A person's conditions: the second has an ellipse of K that is larger by this part."""
    first, other = Person.of(number), Person.of(number + 1000)
    limb = first.limb * np.array([1.0, 1.0, np.sqrt(1 + part)])[:, None, None]
    return first, replace(other, limb=limb)


def trials_of(
    people: tuple[Person, Person],
    units: Sequence[FloatArray],
    course: Profile,
    rng: np.random.Generator,
) -> list[RecordedTrial]:
    """Pushes of both conditions."""
    made = []
    for name, person, own in zip(NAMES, people, units, strict=True):
        if len(own):
            made += [replace(one, condition=name) for one in pushed(person, course, own, rng)]
    return made


def fixed_pushes(people: tuple[Person, Person]) -> int:
    """Of the designed push, evenly over directions, as many of each condition, one look."""
    variance = 0.0
    for person in people:
        covariance = precision(planned(person, DESIGNED)).covariance
        variance += variance_of_size(person.limb[2], covariance[8:, 8:])
    each = 8
    while True:
        limit = t_factor(each - 1) + float(stdtrit(each - 1, 0.9))
        if limit * np.sqrt(variance / each) <= np.log1p(PART):
            return 2 * each
        each += 1


def variance_of_size(K: FloatArray, covariance: FloatArray) -> float:
    """Variance of the logarithm of the size of K's ellipse."""
    xx, xy, yy = ellipse(K).gradient[0] / ellipse(K).size
    slope = np.array([xx, xy / 2, xy / 2, yy])
    return float(slope @ covariance @ slope)


def chosen(people: tuple[Person, Person], number: int) -> tuple[int, bool, FloatArray]:
    """Groups of pushes until the difference is detected or excluded: pushes, detected, coverage."""
    angle = np.arange(8) * np.pi / 4
    first = np.column_stack([np.cos(angle), np.sin(angle)])
    rng = np.random.default_rng(np.random.SeedSequence(6, spawn_key=(number,)))
    trials = trials_of(people, (first, first), DESIGNED, rng)
    robot, count = PushingRobot(shapes=("designed", "reflex_separating")), 8
    while True:
        recording = recording_of(trials, Setup(RATE_HZ))
        made = allowing(estimate(recording), recording, ("condition",))
        step = next_trials(
            recording, AIM, robot, Comfort(), conditions=NAMES, count=count, found=made, seed=1
        )
        if step.met or len(trials) > MOST:
            held = np.mean([holds(e, p) for e, p in zip(made, people, strict=True)])
            return len(trials), step.detected, held
        robot = PushingRobot(course=step.pushes[0].profile)
        units = [
            np.array([p.direction for p in step.pushes if p.condition == name]).reshape(-1, 2)
            for name in NAMES
        ]
        trials = trials + trials_of(people, units, robot.course or DESIGNED, rng)
        count = max(8, sum(step.remaining.values()) // 4)


def of_person(number: int, part: float) -> tuple[int, int, bool, float]:
    """Pushes of the fixed design and of the chosen one, whether it detects, what holds."""
    people = two_conditions(number, part)
    return fixed_pushes(people), *chosen(people, number)


def main() -> None:
    """Print ratio and power, and false alarms where there is no difference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--persons", type=int, default=200)
    asked = parser.parse_args()
    for part in (PART, 0.0):
        numbers = tqdm(range(asked.persons), disable=None)
        found = np.array([of_person(n, part) for n in numbers], dtype=float)
        ratio = found[:, 1] / found[:, 0]
        print(
            f"difference {100 * part:.0f} %: pushes (median) fixed {np.median(found[:, 0]):.0f}, "
            f"chosen {np.median(found[:, 1]):.0f}; ratio: mean {ratio.mean():.2f}, largest "
            f"{ratio.max():.2f}; all {found[:, 1].sum() / found[:, 0].sum():.2f}; detected in "
            f"{100 * found[:, 2].mean():.0f} %; intervals of K that hold: "
            f"{100 * found[:, 3].mean():.1f} %",
            flush=True,
        )


if __name__ == "__main__":
    main()
