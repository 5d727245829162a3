"""A recording prepared for both estimates: courses, pushes, inertia prior, and checked windows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.errors import InputError
from armimpedance.core.estimates import ImpedanceEstimate
from armimpedance.core.progress import Progress
from armimpedance.core.records import Recording
from armimpedance.hand.reaching.course import (
    Courses,
    Pushes,
    courses_of,
    geometry_of,
    inertia_rows,
    pushes_of,
)
from armimpedance.hand.reaching.solve import InertiaPrior
from armimpedance.hand.reaching.windows import PhaseWindows, windows_of
from armimpedance.limb.arm import TwoLinkArm

# Check of the labels: did the hand go where the trial table says that it was pushed?

#: Smallest response of a pushed trial. The response is 1 if it is pushed as all others are, 0 if it
#: is free.
LEAST_ANSWER: Final = 0.4
#: A free reach with a larger response was pushed.
MOST_FREE: Final = 0.7
#: Labels are judged if a push accelerates the hand this many times as much as trials differ.
CLEAR: Final = 3.0
#: Significance level at which commands are accepted as the cause of the motion.
SELDOM: Final = 1e-3


def check_labels(every: Sequence[PhaseWindows], phase: str) -> None:
    """Refuse trials whose hand did not go where their label says.

    The acceleration that is linear in the push's direction is common to all trials of a phase. Its
    share in a trial is 1 apart from noise, 0 for a free reach, and less than 1 for a trial pushed
    in another direction. Pushes throughout are judged over all windows together.

    Raises InputError: trials with wrong labels, by their numbers; commands that the hand does not
    follow.
    """
    if not any(windows.direction.any() for windows in every):
        _check_commands(every, phase)
        return
    (windows,) = every
    a, hit = windows.part("acceleration"), windows.pushed
    D = windows.direction[hit]
    centred = (a[hit] - np.median(a[hit], axis=0)).reshape(len(D), -1)
    # response (2, S d): D (n, 2) response = a (n, S d)
    response = np.linalg.lstsq(D, centred, rcond=None)[0]
    own = np.einsum("nr,nr->n", centred, D @ response) / _energy(D @ response)
    free = (a[~hit] - np.median(a[~hit], axis=0)).reshape(int((~hit).sum()), -1)
    # the push (2,) that explains a free reach best
    seen = np.hypot(*np.linalg.lstsq(response.T, free.T, rcond=None)[0])
    if np.median(_energy(D @ response)) < CLEAR**2 * np.median(_energy(free)):
        return
    wrong = windows.trial[hit][own < LEAST_ANSWER]
    if len(wrong):
        raise InputError(
            f"phase {phase}: the hand did not go where {_trials(wrong)} was pushed to",
            column="push_deg",
            expected="the direction of the robot's push on the hand, in degrees from x towards y",
        )
    pushed = windows.trial[~hit][seen > MOST_FREE]
    if len(pushed):
        raise InputError(
            f"{_trials(pushed)}: no push is stated, and the hand moved as if there was one",
            column="phase",
            expected=f"{phase}, or a trial without a push",
        )


def _check_commands(every: Sequence[PhaseWindows], phase: str) -> None:
    """Refuse commands that the hand does not follow.

    Raises InputError: there are few reaches, or commands explain no more of the motion than chance.
    """
    from scipy.stats import f

    trials = min(int(windows.pushed.sum()) for windows in every)
    count = max(windows.instruments.shape[1] for windows in every)
    free = trials - 1 - count
    if free < count:
        raise InputError(
            f"phase {phase}: {trials} reaches are pushed throughout",
            expected=f"{2 * count + 1} or more, and better five times as many",
        )
    # forces drive velocities, displacements places
    followed = max(_followed(every, name) for name in ("hand", "velocity", "acceleration"))
    # by chance each of the d commands explains as much as each remaining degree of freedom, on two
    # axes
    if followed * free / count < f.isf(SELDOM, 2 * count, 2 * free):
        raise InputError(
            f"phase {phase}: the hand does not follow the robot's commands",
            column="command_x",
            expected="the robot's command at each sample, 0 where it let go",
        )


def _followed(every: Sequence[PhaseWindows], name: str) -> float:
    """Ratio of a channel's variance explained by the commands to the residual variance."""
    explained = residual = 0.0
    for windows in every:
        hit = windows.pushed
        D, part = windows.instruments[hit], windows.part(name)[hit]
        D, flat = D - D.mean(axis=0), (part - part.mean(axis=0)).reshape(len(part), -1)
        remainder = flat - D @ np.linalg.lstsq(D, flat, rcond=None)[0]
        explained += float(_energy(flat).sum() - _energy(remainder).sum())
        residual += float(_energy(remainder).sum())
    return explained / residual


def _energy(values: FloatArray) -> FloatArray:
    return np.asarray((values**2).sum(axis=1))


def _trials(numbers: FloatArray) -> str:
    shown = ", ".join(str(int(n)) for n in numbers[:5])
    more = f" and {len(numbers) - 5} more" if len(numbers) > 5 else ""
    return f"trial {shown}{more}"


# The arm's inertia from the same person's experiment in posture.

#: Smallest relative standard error of the links' inertia: the misfit of the two-link model.
FLOOR = 0.01


def inertia_prior(estimates: Sequence[ImpedanceEstimate], arm: TwoLinkArm) -> InertiaPrior:
    """Estimate the three inertial parameters of two links from the hand's M in postures.

    ``M_e = J^-T M_j(q) J^-1`` is linear in them; least squares weighted by the estimates' errors.

    `estimates`: of the hand, in postures whose joint angles or whose place is known.
    `arm`: its lengths.
    Raises InputError: an estimate is not of a hand in a plane, or has neither joint angles nor
    place.
    """
    if not estimates:
        raise InputError("no estimate of the inertia", expected="one posture or more")
    information, right = np.zeros((3, 3)), np.zeros(3)
    for estimate in estimates:
        rows = _rows(arm, _angles(estimate, arm))
        floor = FLOOR * float(np.abs(estimate.inertia).max())
        C = estimate.covariance[:4, :4] + floor**2 * np.eye(4)
        # M_e (4,) = rows (4, 3) phi (3,)
        weighted = np.linalg.solve(C, rows)
        information += rows.T @ weighted
        right += weighted.T @ estimate.inertia.ravel()
    covariance = np.linalg.inv(information)
    return InertiaPrior(covariance @ right, (covariance + covariance.T) / 2)


def _rows(arm: TwoLinkArm, q: FloatArray) -> FloatArray:
    """The hand's M row by row as a linear function (4, 3) of the three parameters."""
    A = np.linalg.inv(arm.jacobian(q))
    return np.einsum("ki,klp,lj->ijp", A, inertia_rows(q), A).reshape(4, 3)


def _angles(estimate: ImpedanceEstimate, arm: TwoLinkArm) -> FloatArray:
    if estimate.level != "hand" or estimate.k != 2:
        raise InputError(
            f"an estimate at level {estimate.level} with {estimate.k} axes",
            expected="one of the hand in a plane: RESULTS.csv of `estimate`",
        )
    if estimate.position is not None and estimate.shoulder_m is not None:
        return arm.joint_angles(estimate.position - estimate.shoulder_m)
    if estimate.joint_angles is not None:
        return np.asarray(estimate.joint_angles)
    raise InputError(
        "an estimate of the inertia without its posture",
        expected="joint angles, or the places of hand and shoulder",
    )


class Phase(NamedTuple):
    """One phase of a condition, with its windows by name: one, or several for pushes throughout."""

    condition: str
    name: str
    windows: tuple[tuple[str, PhaseWindows], ...]


@dataclass(frozen=True)
class Session:
    """Data of a recording for the estimates.

    `groups` tuple of (condition, its trials, phase).
    `prior`: prior of the inertia.
    """

    courses: Courses
    pushes: Pushes
    prior: InertiaPrior | None
    groups: tuple[tuple[str, IntArray, str], ...]

    def phases(self, window_s: float | None, progress: Progress | None) -> Iterator[Phase]:
        """Yield one phase after another, cut and checked; `progress` is called after each.

        Raises InputError: a phase lacks trials, or its labels are not those of its pushes.
        """
        for done, (condition, rows, phase) in enumerate(self.groups, 1):
            cut = tuple(windows_of(self.courses, self.pushes, rows, phase, window_s))
            check_labels([windows for _, windows in cut], phase)
            yield Phase(condition, phase, cut)
            if progress is not None:
                progress(done, len(self.groups))


def session_of(
    recording: Recording,
    inertia: Sequence[ImpedanceEstimate] | None,
    phases: Sequence[str] | None,
) -> Session:
    """Read the data that the estimates need.

    Raises InputError: the recording lacks something (see `course`, `pushes`), or a phase is not
    there.
    """
    pushes = pushes_of(recording)
    wanted = _phases(pushes, phases)
    prior = None if inertia is None else inertia_prior(inertia, geometry_of(recording).arm)
    return Session(courses_of(recording), pushes, prior, tuple(_groups(recording, pushes, wanted)))


def _phases(pushes: Pushes, requested: Sequence[str] | None) -> tuple[str, ...]:
    if requested is None:
        return pushes.phases
    unknown = [name for name in requested if name not in pushes.phases]
    if unknown:
        available = ", ".join(pushes.phases)
        raise InputError(f"no phase {unknown[0]!r}", column="phase", expected=f"one of {available}")
    return tuple(name for name in pushes.phases if name in requested)


def _groups(
    recording: Recording, pushes: Pushes, phases: Sequence[str]
) -> Iterator[tuple[str, IntArray, str]]:
    """Yield condition, its trials, and each phase at which some of them were pushed."""
    condition = recording.trials["condition"].astype(str).to_numpy()
    for name in dict.fromkeys(condition):
        rows = np.flatnonzero(condition == name)
        for phase in phases:
            if pushes.rows(phase)[rows].any():
                yield str(name), rows, phase
