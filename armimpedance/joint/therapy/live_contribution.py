"""Contribution while the robot moves: one update per sample, with the results of a recording.

The kernel is symmetric, so that the result of a sample is available half a kernel (about 50 ms)
after it. Kernel, torques, sums and standard errors are those for a recording, one sample at a time.
Only the last kernel and the last window of samples are stored, for movements of any length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.joint.therapy.arm.movements import refuse_other_robot
from armimpedance.joint.therapy.arm.passive_arm import PassiveArm
from armimpedance.joint.therapy.robot.steady import WIDTH_S, kernels_for, least_speed
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot, load_gradient
from armimpedance.joint.therapy.share.error_law import (
    ARM,
    FACTORS,
    ONE,
    USER,
    error_law,
    fill_rows,
    products_of,
    row_length,
    sums_of,
)
from armimpedance.joint.therapy.share.judgement import (
    Judged,
    Judgement,
    direction_notes,
    range_notes,
    usable_elastic,
)
from armimpedance.joint.therapy.share.of_movement import (
    WINDOW_S,
    Labels,
    contribution_from,
    window_samples,
)
from armimpedance.joint.therapy.share.result import Contribution
from armimpedance.numerics.signals import LastRows

# Time stamps of a stream of samples at the sample rate.


def next_time(last_s: float | None, stamp_s: float | None, step_s: float) -> float:
    """Time of the next sample, from the last one and the sample's own time stamp.

    `last_s`: None before the first sample.
    `stamp_s`: None for samples without a time: these are `step_s` apart, from 0.
    `step_s`: time between samples.
    Raises InputError: a time stamp is not finite or is repeated, or samples are missing before it.
    """
    if stamp_s is None:
        return 0.0 if last_s is None else last_s + step_s
    if not np.isfinite(stamp_s):
        raise InputError(f"a time stamp of {stamp_s}", expected="seconds")
    ahead = step_s if last_s is None else stamp_s - last_s
    if not ahead > 0.5 * step_s:
        raise InputError(
            f"the sample at {stamp_s:.6g} s comes after that at {last_s:.6g} s",
            expected=f"a time stamp {step_s:g} s later",
        )
    if not ahead < 1.5 * step_s:
        raise InputError(
            f"a gap of {ahead:.4g} s before the sample at {stamp_s:.6g} s",
            expected=f"samples every {step_s:g} s; reset() begins anew",
        )
    return float(stamp_s)


# Results of a sample for the running robot.


@dataclass(frozen=True, slots=True)
class Reading:
    """A value in per cent, valid or not.

    `percent`, `sd`: value and standard error; NaN without a denominator.
    `valid`: True if the value is well enough determined.
    """

    percent: float
    sd: float
    valid: bool


@dataclass(frozen=True, slots=True)
class LiveSample:
    """Results of the sample half a kernel ago; per cent as in `Contribution`.

    `time_s`: time of that sample.
    `q_rad`, `user_Nm`, `arm_Nm`: angle of the moving axis, and torques about it.
    `counts`: True if the axis moves.
    `of_sample`: contribution (3) of the sample.
    `in_movement`: True within the movement; before it, the values of the movement are NaN.
    `ratio`, `projection`, `share`: of the movement so far. A display shows the share, which is
    separate from the robot's inertia.
    `running`: projection in the running window.
    """

    time_s: float
    q_rad: float
    user_Nm: float
    arm_Nm: float
    counts: bool
    of_sample: Reading
    in_movement: bool
    ratio: Reading
    projection: Reading
    share: Reading
    running: Reading


#: Stored sums: over the sample, over the movement so far, over the running window, and over the
#: movement including the samples that do not count.
SAMPLE, MOVEMENT, WINDOW, EVERYTHING = range(4)


class LiveContribution:
    """Contribution about one axis, sample by sample.

    `robot`: identified; it is adjusted to the arm's length here.
    `axis`: moving axis, column of `update`'s angles, from 0.
    `window_s`: length of the running window, s.
    `unrepeatable`: True to continue if the passive repetitions of this axis did not agree.
    Raises InputError: no such axis, rate or window, or the robot or this axis of the arm was not
    calibrated.
    """

    def __init__(
        self,
        robot: TherapyRobot,
        arm: PassiveArm,
        axis: int,
        sample_rate_hz: float,
        *,
        window_s: float = WINDOW_S,
        unrepeatable: bool = False,
    ) -> None:
        from armimpedance.joint.therapy.arm.passive_arm import arm_bodies
        from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

        if axis not in range(robot.n_axes):
            raise InputError(f"axis {axis}", expected=f"0 to {robot.n_axes - 1}")
        refuse_other_robot(arm, robot)
        self._robot = robot.adjusted_to(arm.upper_arm_m)
        self._arm, self._axis, self._rate = arm, axis, sample_rate_hz
        self._elastic = usable_elastic(arm, robot.axes[axis], unrepeatable=unrepeatable)
        self._law = error_law(robot, arm, robot.axes[axis], sample_rate_hz)
        self._own, self._carried = robot_bodies(self._robot), arm_bodies(self._robot, arm)
        self._theta = robot.identified.theta
        self._limit = float(robot.torque_limit_Nm[axis])
        kernels = kernels_for(sample_rate_hz, WIDTH_S)
        self._half = kernels.half
        self._weights = np.stack([kernels.smooth, kernels.first, kernels.second])
        self._window = window_samples(window_s, sample_rate_hz)
        self._slides_rad_s = least_speed(float(robot.identified.rise_rad_s[axis]))
        self._row = np.empty(row_length(len(self._theta)))
        self._nothing = np.zeros(len(self._row))
        self.reset()

    def reset(self) -> None:
        """Delete all samples: after a gap, or before the next trial."""
        self._measured = LastRows(2 * self._half + 1, self._robot.n_axes + 1)
        self._rows = LastRows(self._window, len(self._row))
        self._sums = np.zeros((4, FACTORS, len(self._row)))
        self._pushed = np.empty(self._robot.n_axes + 1)
        self._count, self._in_window = 0, 0
        self._time_s: float | None = None
        self._forget_movement()

    def _forget_movement(self) -> None:
        self._names = ("", "live", "")
        self._first: int | None = None
        self._last: int | None = None
        self._ends_rad = (0.0, 0.0)
        self._range_rad = (np.inf, -np.inf)
        self._sums[[MOVEMENT, EVERYTHING]] = 0.0

    @property
    def delay_s(self) -> float:
        """Delay of a result after its sample, s."""
        return self._half / self._rate

    @property
    def complete(self) -> bool:
        """True if the kernel has given all samples of a stopped movement."""
        return self._last is not None and self._count > self._last + self._half

    def start(self, movement: str = "", *, trial: str = "live", condition: str = "") -> None:
        """Start a movement with the next sample given to `update`.

        `movement`: name as in the arm's references; with another name there is no comparison (19).
        Raises InputError: the previous movement was not stopped, or the kernel has not yet given
        all of it.
        """
        if self._first is not None and not self.complete:
            raise InputError(
                f"a movement starts before the last one is complete, {self.delay_s:g} s after "
                "its end",
                expected="stop(), and that many more samples, or reset()",
            )
        self._forget_movement()
        self._names, self._first = (movement, trial, condition), self._count

    def stop(self) -> None:
        """Stop the movement with the last sample given to `update`.

        Raises InputError: no movement was started, or it has no sample yet.
        """
        if self._first is None or self._last is not None or self._count == self._first:
            raise InputError("no movement to stop", expected="start(), then samples, then stop()")
        self._last = self._count - 1

    def update(
        self, q: FloatArray, motor: FloatArray, time_s: float | None = None
    ) -> LiveSample | None:
        """Add one sample; return the result of the sample half a kernel ago.

        `q` (n,): angles of all axes, rad.
        `motor` (n,): motor torques of all axes, N m, positive where they accelerate their axis.
        `time_s`: time stamp; without one, the samples are assumed to come at the sample rate.
        Returns: None until the kernel is full.
        Raises InputError: angles or torques are not numbers or not one for each axis, a time stamp
        is repeated, or samples are missing before it. The sample is not added; call `reset` to
        start again.
        """
        self._take(q, motor, time_s)
        if self._count < 2 * self._half + 1:
            return None
        index = self._count - 1 - self._half
        counts, products = self._torques()
        self._rows.push(self._row if counts else self._nothing)
        if index == self._first:
            self._in_window = 0
        self._in_window = min(self._in_window + 1, self._window)
        self._sums[SAMPLE] = products
        self._sums[WINDOW] = sums_of(self._rows.last(self._in_window))
        inside = self._inside(index)
        if inside:
            self._add_to_movement(counts, products)
        return self._sample(counts, inside)

    def movement(self) -> Contribution:
        """Result of the movement so far, for the samples that the kernel has given.

        Raises InputError: no sample of the movement yet, no motor torque, no load from the arm on
        this axis, or the axis has not moved.
        """
        if not self._sums[EVERYTHING, ONE, ONE] > 0:
            raise InputError("no sample of a movement yet", expected="start(), then samples")
        name, trial, condition = self._names
        axis_name = self._robot.axes[self._axis]
        notes = range_notes(self._elastic, *self._range_rad)
        notes += direction_notes(self._elastic, *self._ends_rad)
        labels = Labels(trial, condition, name, axis_name, *self._ends_rad, notes)
        judgement = Judgement(self._sums[MOVEMENT], self._law)
        return contribution_from(judgement, self._sums[EVERYTHING], labels, self._arm, self._rate)

    def _take(self, q: FloatArray, motor: FloatArray, time_s: float | None) -> None:
        n = self._robot.n_axes
        pushed = self._pushed
        try:
            pushed[:n], pushed[n] = q, motor[self._axis]
        except (TypeError, ValueError, IndexError) as error:
            raise InputError("not a sample", expected=f"{n} angles, {n} torques") from error
        if np.shape(q) != (n,) or np.shape(motor) != (n,) or not np.isfinite(pushed).all():
            raise InputError("not a sample", expected=f"{n} angles, {n} torques, all finite")
        self._time_s = next_time(self._time_s, time_s, 1 / self._rate)
        self._measured.push(pushed)
        self._count += 1

    def _torques(self) -> tuple[bool, FloatArray]:
        """Fill the row of the sample in the kernel's middle; return its `counts` and its
        products."""
        axis, n = self._axis, self._robot.n_axes
        # (q, qd, qdd | motor) (3, n + 1) = weights (3, 2 h + 1) measured (2 h + 1, n + 1)
        state = self._weights @ self._measured.last(2 * self._half + 1)
        q, qd, qdd = state[:, :n]
        gradient = load_gradient(self._robot, axis, q, qd)
        fill_rows(
            self._row,
            q=q[axis],
            qd=qd[axis],
            motor=state[0, n],
            robot=self._own.torque(q, qd, qdd)[axis] + gradient @ self._theta,
            rigid_arm=self._carried.torque(q, qd, qdd)[axis],
            robot_inertia=self._own.inertia_torque(q, qdd)[axis],
            elastic=self._elastic.stiffness * q[axis] + self._elastic.offset,
            robot_gradient=gradient,
            torque_limit_Nm=self._limit,
        )
        self._q_rad = float(q[axis])
        return bool(abs(qd[axis]) >= self._slides_rad_s), products_of(self._row)

    def _inside(self, index: int) -> bool:
        """True if the sample with this number is part of the movement."""
        begun = self._first is not None and index >= self._first
        return begun and (self._last is None or index <= self._last)

    def _add_to_movement(self, counts: bool, products: FloatArray) -> None:
        started = self._sums[EVERYTHING, ONE, ONE] > 0
        q = self._q_rad
        self._ends_rad = (self._ends_rad[0] if started else q, q)
        self._range_rad = (min(self._range_rad[0], q), max(self._range_rad[1], q))
        self._sums[EVERYTHING] += products
        if counts:
            self._sums[MOVEMENT] += products

    def _sample(self, counts: bool, inside: bool) -> LiveSample:
        sums, law = self._sums, self._law
        of_sample = Judgement(sums[SAMPLE], law).of_sample
        movement = Judgement(sums[MOVEMENT], law, so_far=True)
        # movement and window together: they share their matrix products
        projections = Judgement(sums[MOVEMENT:EVERYTHING], law).projection
        projection, running = (
            Reading(float(percent), float(sd), bool(valid))
            for percent, sd, valid in zip(
                projections.percent, projections.sd, projections.valid, strict=True
            )
        )
        return LiveSample(
            time_s=(self._time_s or 0.0) - self.delay_s,
            q_rad=self._q_rad,
            user_Nm=float(self._row[USER]),
            arm_Nm=float(self._row[ARM]),
            counts=counts,
            of_sample=Reading(
                float(of_sample.percent), float(of_sample.sd), counts and bool(of_sample.valid)
            ),
            in_movement=inside,
            ratio=_reading(movement.ratio),
            projection=projection,
            share=_reading(movement.share),
            running=running,
        )


def _reading(judged: Judged) -> Reading:
    return Reading(float(judged.percent), float(judged.sd), bool(judged.valid))
