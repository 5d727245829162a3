"""A recording played to the live form, sample by sample: is it the same, and is it fast enough?"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter_ns

import numpy as np

from armimpedance.arrays import FloatArray
from armimpedance.errors import EstimationError
from armimpedance.records import Recording
from armimpedance.therapy.arm.movements import movement_torques
from armimpedance.therapy.arm.passive_arm import PassiveArm
from armimpedance.therapy.arm.torques import MovementTorques
from armimpedance.therapy.live.live_contribution import LiveContribution
from armimpedance.therapy.live.sample import LiveSample
from armimpedance.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.therapy.share.metric import (
    WINDOW_S,
    Contribution,
    contribution_of,
    contribution_so_far,
    running_contribution,
    sample_contribution,
)


@dataclass(frozen=True)
class LiveReport:
    """How a recording went through the live form.

    Attributes
    ----------
    n_updates : int
    delay_s : float
        After a sample, until its result is there.
    median_s, p99_s, longest_s : float
        Time of one update.
    largest_difference : float
        From the same recording's results in one piece, in points or Nm, or as a fraction of values
        above 1: of torques and of every value that is flagged valid, with its standard error.
    flags_differ : int
        Validity flags that came out differently.
    movements : tuple of Contribution
        As the live form gave them.
    """

    n_updates: int
    delay_s: float
    median_s: float
    p99_s: float
    longest_s: float
    largest_difference: float
    flags_differ: int
    movements: tuple[Contribution, ...]


def replay(
    recording: Recording,
    robot: TherapyRobot,
    arm: PassiveArm,
    *,
    window_s: float = WINDOW_S,
    unrepeatable: bool = False,
) -> LiveReport:
    """Play every trial to the live form, time each update, compare with the recorded form.

    Raises
    ------
    InputError
        As `movement_torques` and `contribution_of`; samples that are missing.
    EstimationError
        A movement that the live form gave fewer samples of.
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
    each = np.concatenate(times)
    return LiveReport(
        n_updates=len(each),
        delay_s=live.delay_s,
        median_s=float(np.median(each)),
        p99_s=float(np.quantile(each, 0.99)),
        longest_s=float(each.max()),
        largest_difference=max(differences),
        flags_differ=flags,
        movements=tuple(movements),
    )


def _play(
    recording: Recording, row: int, torques: MovementTorques, live: LiveContribution
) -> tuple[list[LiveSample], FloatArray]:
    """Results of the movement's samples, and the time of every update, s."""
    samples = recording.samples_of(row)
    time, q, motor = (
        recording.time_s[samples],
        recording.position[samples],
        -recording.force[samples],
    )
    first, last = np.searchsorted(time, torques.time_s[[0, -1]] - 0.5 / recording.sample_rate_hz)
    spent, found = np.empty(len(time)), []
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
            found.append(result)
    if len(found) != len(torques.time_s):
        raise EstimationError(
            f"trial {torques.trial}: {len(found)} live samples of {len(torques.time_s)}"
        )
    return found, spent


def _compare(
    samples: list[LiveSample],
    torques: MovementTorques,
    robot: TherapyRobot,
    arm: PassiveArm,
    window_s: float,
) -> tuple[float, int]:
    """Largest difference over a movement's samples, and how many flags differ."""
    each = sample_contribution(torques, robot, arm)
    running = running_contribution(torques, robot, arm, window_s)
    so_far = contribution_so_far(torques, robot, arm)

    def course(name: str) -> FloatArray:
        return np.array([getattr(sample, name) for sample in samples])

    both = np.logical_and(course("valid"), each.valid)
    shown = np.logical_and(course("running_valid"), running.valid)
    known = np.logical_and(course("share_valid"), so_far.valid)
    pairs = (
        (course("user_Nm"), each.user),
        (course("arm_Nm"), each.arm),
        (course("percent")[both], each.percent[both]),
        (course("sd")[both], each.sd[both]),
        (course("share_percent")[known], so_far.percent[known]),
        (course("share_sd")[known], so_far.sd[known]),
        (course("running_percent")[shown], running.percent[shown]),
        (course("running_sd")[shown], running.sd[shown]),
    )
    flags = (course("valid") != each.valid).sum() + (course("running_valid") != running.valid).sum()
    return max(_difference(a, b) for a, b in pairs), int(flags)


def _movement_difference(live: Contribution, whole: Contribution) -> float:
    names = ["mean_support_Nm", "mean_arm_Nm", "lowering_share", "saturated_share", "sum_ratio"]
    names += ["n_samples", "still_share", "duration_s"]
    for metric in ("ratio", "projection", "share", "reference"):
        if getattr(live, f"{metric}_valid") and getattr(whole, f"{metric}_valid"):
            names += [f"{metric}_percent", f"{metric}_sd"]
    a, b = (np.array([getattr(result, name) for name in names]) for result in (live, whole))
    return _difference(a, b)


def _flags_differ(live: Contribution, whole: Contribution) -> int:
    names = ("ratio_valid", "projection_valid", "share_valid", "reference_valid")
    return sum(getattr(live, name) != getattr(whole, name) for name in names)


def _difference(a: FloatArray, b: FloatArray) -> float:
    return float((np.abs(a - b) / np.maximum(1.0, np.abs(b))).max(initial=0.0))
