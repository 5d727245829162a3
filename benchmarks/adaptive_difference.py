"""Two conditions whose K differs in size by 20 %: pushes to detect it with a power of 90 %.

    python benchmarks/adaptive_difference.py --persons 200
    python benchmarks/adaptive_difference.py --persons 200 --bound

For each simulated person of adaptive_trials.py a second condition, whose ellipse of K is 20 %
larger, and whose noise is another one's. A fixed design spreads the designed push evenly over all
directions and both conditions and looks once, at the end; `next` chooses, and looks after each
group. Printed: the ratio of the pushes, how often the difference is detected at the level of 5 %,
and the same where there is none.

--bound prints what an experimenter would need who knows the limb and its noise from the beginning:
the best shares of all lines, of both courses and of both conditions, and as few looks' costs as the
limit of `next`, or any test, allows.
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
from scipy.special import ndtri, stdtrit
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
from armimpedance.hand.planning import INEFFICIENCY, SHAPES, Profile, precision
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
        variance += variance_of_size(person.limb[2], k_covariance(person))
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


#: Standard errors of a difference that one look detects at the level of 5 % with a power of 90 %.
ONE_LOOK: Final = 1.9600 + 1.2816
#: Pushes that a test with this power needs on average where the difference is as foreseen, over
#: those of one look: the least of all tests (Wald 1945).
LEAST: Final = 2 * (0.9 * np.log(0.9 / 0.025) + 0.1 * np.log(0.1 / 0.975)) / ONE_LOOK**2


def looked_at(looks: int = 12, draws: int = 100_000) -> float:
    """The same of the limit of `next`, of simulated sessions with so many looks."""
    rng, t = np.random.default_rng(7), np.arange(1, looks + 1) / looks
    # a Brownian motion leaves +- this before time 1 with 5 %: four times the tail of its end
    limit = float(ndtri(1 - 0.05 / 4))
    # B(t) (draws, looks) without a difference, of one B(t) + drift t
    without = np.cumsum(rng.normal(0, looks**-0.5, (draws, looks)), axis=1)
    for drift in np.arange(ONE_LOOK, 2 * ONE_LOOK, 0.01):
        detected = np.abs(without + drift * t) >= limit
        if detected.any(axis=1).mean() >= 0.9:
            break
    ended = np.where(detected.any(axis=1), detected.argmax(axis=1), looks - 1)
    return float(t[ended].mean() * (drift / ONE_LOOK) ** 2)


def bound(people: tuple[Person, Person], looked: float) -> FloatArray:
    """Variance of the best design over that of the fixed one; then the least part of its pushes.

    By the limit of `next`, by any test, each with and without a first set in both conditions.
    """
    fixed = [variance_of_size(one.limb[2], k_covariance(one)) for one in people]
    best = [least_variance(one) for one in people]
    # a part w of the pushes in one condition: v1 / w + v2 / (1 - w) is least for w ~ sqrt(v1)
    part = (np.sqrt(best[0]) + np.sqrt(best[1])) ** 2 / (2 * sum(fixed))
    begun = 2 * len(lines()) / fixed_pushes(people)
    needs = np.array([looked * part, LEAST * part])
    # a push of the first sets is worth `part` of a chosen one
    return np.concatenate([[part], needs, np.maximum(begun, needs + (1 - part) * begun)])


def k_covariance(person: Person) -> FloatArray:
    """Covariance of K (4, 4) by one push of the fixed design."""
    return precision(planned(person, DESIGNED)).covariance[8:, 8:]


def lines(count: int = 8) -> FloatArray:
    """Unit vectors of lines that are equally apart, (count, 2)."""
    angle = np.arange(count) * np.pi / count
    return np.column_stack([np.cos(angle), np.sin(angle)])


def least_variance(person: Person) -> float:
    """Variance of the logarithm of K's size by one push, of the best shares of lines and courses.

    Shares grow with what their pushes tell, until all that are used tell the same (Fedorov).
    """
    told = []
    for name in ("designed", "reflex_separating"):
        motion = planned(person, Profile(SHAPES.named(name), AMPLITUDE_M, DURATION_S))
        G = np.einsum("la,anp->lnp", lines(24), motion.rows())
        told.append(G.transpose(0, 2, 1) @ motion.weight @ G)
    information = np.concatenate(told)
    slope = np.zeros(12)
    xx, xy, yy = ellipse(person.limb[2]).gradient[0] / ellipse(person.limb[2]).size
    slope[8:] = INEFFICIENCY[2] * np.array([xx, xy / 2, xy / 2, yy])
    share = np.full(len(information), 1 / len(information))
    for _ in range(600):
        weighed = np.linalg.solve(np.tensordot(share, information, axes=1), slope)
        gain = np.sqrt(np.einsum("p,kpq,q->k", weighed, information, weighed))
        share = share * gain / (share @ gain)
    return float(slope @ weighed)


def of_person(number: int, part: float) -> tuple[int, int, bool, float]:
    """Pushes of the fixed design and of the chosen one, whether it detects, what holds."""
    people = two_conditions(number, part)
    return fixed_pushes(people), *chosen(people, number)


def main() -> None:
    """Print ratio and power, and false alarms where there is no difference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--persons", type=int, default=200)
    parser.add_argument("--bound", action="store_true", help="what who knows all would need")
    asked = parser.parse_args()
    if asked.bound:
        looked = looked_at()
        found = np.array([bound(two_conditions(n, PART), looked) for n in range(asked.persons)])
        print(f"pushes over those of one look: looked at {looked:.3f}, any test {LEAST:.3f}")
        names = ("variance", "looked at", "any test", "looked at, begun", "any test, begun")
        for name, mean, low, high in zip(
            names, found.mean(axis=0), found.min(axis=0), found.max(axis=0), strict=True
        ):
            print(f"{name:18s} mean {mean:.2f}, {low:.2f} to {high:.2f}")
        return
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
