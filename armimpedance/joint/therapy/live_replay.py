"""Replay a recording through the live form, sample by sample, to test equality and speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from operator import attrgetter
from time import perf_counter_ns
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import EstimationError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.arm.movements import MovementTorques, movement_torques
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.live_contribution import LiveContribution, LiveSample
from armimpedance.joint.therapy.robot.steady import no_step
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.joint.therapy.share.of_movement import (
    WINDOW_S,
    contribution_of,
    contribution_so_far,
    running_contribution,
    sample_contribution,
)
from armimpedance.joint.therapy.share.result import Contribution

_METRICS: Final = ("ratio", "projection", "share", "reference")


@dataclass(frozen=True, repr=False)
class LiveReport:
    """Result of a replay through the live form.

    `delay_s`: time from a sample to its result.
    `median_s`, `p99_s`, `longest_s`: computing time of one update.
    `largest_difference`: from the results of the whole recording, in points or N m, or relative
    for values above 1; of torques, and of all valid values and their standard errors.
    `flags_differ`: number of validity flags that differ.
    `movements`: results of the live form.
    """

    n_updates: int
    delay_s: float
    median_s: float
    p99_s: float
    longest_s: float
    largest_difference: float
    flags_differ: int
    movements: tuple[Contribution, ...]

    def __repr__(self) -> str:
        differ = f"{self.flags_differ} flags differ" if self.flags_differ else "the same flags"
        return (
            f"live: {self.n_updates} updates, {1e3 * self.median_s:.3f} ms each (median), 99 % "
            f"within {1e3 * self.p99_s:.3f} ms, results {1e3 * self.delay_s:.0f} ms late; at most "
            f"{self.largest_difference:.1g} from the results in one piece, {differ}"
        )


def replay(
    recording: Recording,
    robot: TherapyRobot,
    arm: PassiveArm,
    *,
    window_s: float = WINDOW_S,
    unrepeatable: bool = False,
    step: Callable[[], object] = no_step,
) -> LiveReport:
    """Play every trial to the live form, time each update, and compare with the recorded form.

    Parameters
    ----------
    recording : Recording
        Of a person in the robot.
    robot : TherapyRobot
        Identified.
    arm : PassiveArm
        The person's, calibrated in this robot.
    window_s : float
        Length of the running view's window, s.
    unrepeatable : bool
        True to continue if the passive repetitions of an axis did not agree.
    step : function, optional
        Called after every trial.

    Returns
    -------
    LiveReport

    Raises
    ------
    InputError
        As `movement_torques` and `contribution_of`; samples that are missing.
    EstimationError
        The live form gave fewer samples of a movement.
    """
    forms: dict[int, LiveContribution] = {}
    times, differences, flags, movements = [], [], 0, []
    for row, torques in enumerate(movement_torques(recording, robot, arm)):
        axis, rate = torques.axis, recording.sample_rate_hz
        if axis not in forms:
            forms[axis] = LiveContribution(
                robot, arm, axis, rate, window_s=window_s, unrepeatable=unrepeatable
            )
        live = forms[axis]
        samples, spent = _play(recording, row, torques, live)
        times.append(spent)
        movements.append(live.movement())
        whole = contribution_of(torques, robot, arm, unrepeatable=unrepeatable)
        difference, differ = _compare(samples, torques, robot, arm, window_s)
        differences += [difference, _movement_difference(movements[-1], whole)]
        flags += differ + _flags_differ(movements[-1], whole)
        step()
    update_times = np.concatenate(times)
    return LiveReport(
        n_updates=len(update_times),
        delay_s=live.delay_s,
        median_s=float(np.median(update_times)),
        p99_s=float(np.quantile(update_times, 0.99)),
        longest_s=float(update_times.max()),
        largest_difference=max(differences),
        flags_differ=flags,
        movements=tuple(movements),
    )


def _play(
    recording: Recording, row: int, torques: MovementTorques, live: LiveContribution
) -> tuple[list[LiveSample], FloatArray]:
    """Results of the movement's samples, and the computing time of every update, s."""
    samples = recording.samples_of(row)
    time, q, motor = (
        recording.time_s[samples],
        recording.position[samples],
        -recording.force[samples],
    )
    first, last = np.searchsorted(time, torques.time_s[[0, -1]] - 0.5 / recording.sample_rate_hz)
    spent, inside = np.empty(len(time)), []
    live.reset()
    for i in range(len(time)):
        if i == first:
            live.start(torques.movement, trial=torques.trial, condition=torques.condition)
        before = perf_counter_ns()
        result = live.update(q[i], motor[i], time[i])
        spent[i] = (perf_counter_ns() - before) * 1e-9
        if i == last:
            live.stop()
        if result is not None and result.in_movement:
            inside.append(result)
    if len(inside) != len(torques.time_s):
        raise EstimationError(
            f"trial {torques.trial}: {len(inside)} live samples of {len(torques.time_s)}"
        )
    return inside, spent


def _compare(
    samples: list[LiveSample],
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    window_s: float,
) -> tuple[float, int]:
    """Largest difference over a movement's samples, and number of flags that differ."""
    per_sample = sample_contribution(torques, robot, arm)
    running = running_contribution(torques, robot, arm, window_s)
    so_far = contribution_so_far(torques, robot, arm)

    def course(*names: str) -> FloatArray:
        return np.array([attrgetter(".".join(names))(sample) for sample in samples])

    pairs = [(course("user_Nm"), per_sample.user), (course("arm_Nm"), per_sample.arm)]
    differ = []
    for name, whole in (("of_sample", per_sample), ("share", so_far), ("running", running)):
        flags = course(name, "valid")
        both = np.logical_and(flags, whole.valid)
        differ.append(int((flags != whole.valid).sum()))
        pairs += [
            (course(name, "percent")[both], whole.percent[both]),
            (course(name, "sd")[both], whole.sd[both]),
        ]
    # the live share is shown at once, the recorded one only after it has been valid for a while
    return max(_difference(a, b) for a, b in pairs), differ[0] + differ[2]


def _movement_difference(live: Contribution, whole: Contribution) -> float:
    names = ["mean_support_Nm", "mean_arm_Nm", "lowering_share", "saturated_share", "sum_ratio"]
    names += ["n_samples", "still_share", "duration_s"]
    both = [np.array([getattr(result, name) for name in names]) for result in (live, whole)]
    for metric in _METRICS:
        metrics = getattr(live, metric), getattr(whole, metric)
        if all(t is not None and t.valid for t in metrics):
            both = [np.append(b, [t.percent, t.sd]) for b, t in zip(both, metrics, strict=True)]
    return _difference(*both)


def _flags_differ(live: Contribution, whole: Contribution) -> int:
    def flags(result: Contribution) -> list[bool]:
        metrics = (getattr(result, metric) for metric in _METRICS)
        return [t is not None and t.valid for t in metrics]

    return sum(a != b for a, b in zip(flags(live), flags(whole), strict=True))


def _difference(a: FloatArray, b: FloatArray) -> float:
    return float((np.abs(a - b) / np.maximum(1.0, np.abs(b))).max(initial=0.0))
