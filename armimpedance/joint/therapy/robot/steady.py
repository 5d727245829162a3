"""Steady parts of a calibration, from smoothed trials: sweeps at a velocity, and holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import BoolArray, FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.numerics.regression import Fit
from armimpedance.numerics.signals import Kernels, spline_kernels

# Numbers in a row of the trial table.


def number_in(line: Mapping[Any, Any], column: str) -> float | None:
    """Number in this column of a trial's row; None if there is none.

    Raises InputError: the cell has something else.
    """
    value = line.get(column)
    if value is None:
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.inf
    if np.isinf(number):
        raise InputError(
            f"trial {line['trial']}: {value!r:.40}", column=column, expected="a number"
        )
    return None if np.isnan(number) else number


# Angles, their derivatives and motor torques of every trial after the same smoothing kernel.
#
# The kernel is a symmetric spline of finite support: its result for a sample depends only on half a
# width before and after it. A robot that runs it live gets the same numbers with a delay of half a
# width. Trials have no filter transients, but half a width at either end has no result.

#: Support of the kernel, s: its -3 dB frequency is about 9 Hz; therapy movements are below 1 Hz.
WIDTH_S: Final = 0.1


@dataclass(frozen=True)
class SmoothTrial(FrozenRecord):
    """One trial after the kernel; S samples, n axes.

    Attributes
    ----------
    row : int
        Row of the recording's trial table, from 0.
    time_s : (S,)
    q, qd, qdd, motor : (S, n)
        rad, rad/s, rad/s^2, N m; a positive motor torque accelerates its axis.
    """

    row: int
    time_s: Annotated[FloatArray, "S"]
    q: Annotated[FloatArray, "S n"]
    qd: Annotated[FloatArray, "S n"]
    qdd: Annotated[FloatArray, "S n"]
    motor: Annotated[FloatArray, "S n"]

    def between(self, first_s: float, last_s: float) -> SmoothTrial:
        """Samples from `first_s` to `last_s`, both included, on the trial's clock."""
        kept = (self.time_s >= first_s - 1e-9) & (self.time_s <= last_s + 1e-9)
        parts = (getattr(self, name)[kept] for name in ("time_s", "q", "qd", "qdd", "motor"))
        return SmoothTrial(self.row, *parts)


def no_step() -> None:
    """Do nothing: the default for a caller that does not follow the progress."""


def kernels_for(sample_rate_hz: float, width_s: float = WIDTH_S) -> Kernels:
    """Kernels for a sample rate.

    Raises InputError: the width has too few samples.
    """
    if not sample_rate_hz * width_s >= 12:
        raise InputError(
            f"samples at {sample_rate_hz:g} Hz", expected=f"{12 / width_s:g} Hz or more"
        )
    return spline_kernels(width_s, sample_rate_hz)


def smooth_trials(recording: Recording, width_s: float = WIDTH_S) -> tuple[SmoothTrial, ...]:
    """Apply the kernel to all trials.

    Parameters
    ----------
    recording : Recording
        Of kind "joint", with commanded torques. Torques of a `Recording` are by the limb on the
        device; the motors' are the opposite.
    width_s : float
        Support of the kernel, s.

    Returns
    -------
    tuple of SmoothTrial

    Raises
    ------
    InputError
        A trial that is shorter than the kernel.
    """
    kernels = kernels_for(recording.sample_rate_hz, width_s)
    return tuple(_smooth(recording, row, kernels) for row in range(recording.n_trials))


def _smooth(recording: Recording, row: int, kernels: Kernels) -> SmoothTrial:
    samples, half = recording.samples_of(row), kernels.half
    q, motor = recording.position[samples], -recording.force[samples]
    if len(q) < 2 * half + 2:
        raise InputError(
            f"trial {recording.trials['trial'].iloc[row]} has {len(q)} samples",
            expected=f"{2 * half + 2} or more",
        )
    time = recording.time_s[samples][half : len(q) - half]
    weights = np.stack([kernels.smooth, kernels.first, kernels.second])
    # window w (S, n, 2 h + 1), weights (3, 2 h + 1): (q, qd, qdd) = weights w
    windows = np.lib.stride_tricks.sliding_window_view(q, 2 * half + 1, axis=0)
    q_s, qd, qdd = np.einsum("snw,dw->dsn", windows, weights, optimize=True)
    torques = np.lib.stride_tricks.sliding_window_view(motor, 2 * half + 1, axis=0)
    return SmoothTrial(row, time, q_s, qd, qdd, torques @ kernels.smooth)


#: Distance of samples that carry all information after the kernel (-3 dB near 9 Hz), s.
EVERY_S: Final = 0.01
#: Least number of such samples in a steady part.
_LEAST_SAMPLES: Final = 5


@dataclass(frozen=True, eq=False)
class SteadyPart(FrozenRecord):
    """One axis during a sweep or a hold; S samples, `EVERY_S` apart.

    `axis`: counted from 0.
    `q`, `qd` (S,): rad, rad/s.
    `load` (S,): N m, motor torque less that of the rigid bodies: friction, cables and spring.
    `approach`: 1 if the axis came from below, -1 from above; for a sweep, its direction.
    """

    trial: str
    axis: int
    q: Annotated[FloatArray, "S"]
    qd: Annotated[FloatArray, "S"]
    load: Annotated[FloatArray, "S"]
    approach: int

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.approach not in (1, -1):
            raise RecordError(f"trial {self.trial}: approach {self.approach}", expected="1 or -1")

    @property
    def speed(self) -> float:
        """Absolute mean velocity, rad/s."""
        return abs(float(self.qd.mean()))


def steady_parts(
    recording: Recording,
    robot: TherapyRobot,
    condition: str,
    step: Callable[[], object] = no_step,
) -> tuple[SteadyPart, ...]:
    """Steady parts of all trials of one condition, from `onset_s` to `end_s` less half a kernel.

    `recording`: columns `axis`, `onset_s` and `end_s` in its trial table; `approach` for holds.
    `robot`: adjusted as in the recording.
    `step`: called after every trial.
    Raises InputError: a column is missing or wrong, or a steady part is too short.
    """
    from armimpedance.joint.therapy.robot.therapy_robot import robot_bodies

    rows = np.flatnonzero(recording.trials["condition"].astype(str) == condition)
    if len(rows) == 0:
        return ()
    _check_table(recording, rows, robot.n_axes)
    bodies = robot_bodies(robot)
    chosen = recording.select(rows)
    parts = []
    for smooth in smooth_trials(chosen):
        parts.append(_part(chosen, smooth, bodies, condition == "hold"))
        step()
    return tuple(parts)


def white_sd(fitted: Fit) -> FloatArray:
    """Standard errors (p,) of a fit to steady parts for white torque noise.

    They are the textbook's, times a factor for the correlation by the kernel.
    """
    inverse = np.linalg.inv(fitted.triangle)
    sd = fitted.residual_sd * np.sqrt((inverse**2).sum(axis=1))
    return np.asarray(sd * np.sqrt(_repeats()))


def at_least_white(fitted: Fit) -> Fit:
    """Return the fit with standard errors at least those for white torque noise.

    Few sweeps may agree by chance: with six, the estimated error of a Coulomb torque is anywhere
    between a quarter and twice of the true one.
    """
    grown = np.maximum(white_sd(fitted) / np.maximum(fitted.sd, 1e-300), 1.0)
    # C (p, p) = D C D, D the diagonal matrix of the factors
    wide = grown[:, None] * fitted.covariance * grown
    return fitted.with_covariance(wide, fitted.covariance_kind, fitted.dof)


@lru_cache(maxsize=1)
def _repeats() -> float:
    """Sum of the autocorrelation that the kernel gives to samples `EVERY_S` apart."""
    weights = kernels_for(1000.0).smooth
    correlation = np.correlate(weights, weights, mode="full")
    middle, every = len(weights) - 1, round(1000.0 * EVERY_S)
    lags = correlation[middle % every :: every]
    return float(lags.sum() / correlation[middle])


def _check_table(recording: Recording, rows: IntArray, n_axes: int) -> None:
    table = recording.trials
    for row in rows:
        entry = table.iloc[row]
        for column in ("axis", "onset_s", "end_s"):
            if number_in(entry, column) is None:
                raise InputError(
                    f"trial {entry['trial']}: nothing there",
                    column=column,
                    expected="a number for every sweep and hold",
                )
        axis = number_in(entry, "axis")
        if axis not in range(1, n_axes + 1):
            raise InputError(
                f"trial {entry['trial']}: axis {axis:g}",
                column="axis",
                expected=f"a whole number from 1 to {n_axes}",
            )


def _part(recording: Recording, smooth: SmoothTrial, bodies: Any, hold: bool) -> SteadyPart:
    entry = recording.trials.iloc[smooth.row]
    trial, axis = str(entry["trial"]), int(entry["axis"]) - 1
    half = WIDTH_S / 2
    kept = smooth.between(float(entry["onset_s"]) + half, float(entry["end_s"]) - half)
    every = max(round(EVERY_S * recording.sample_rate_hz), 1)
    thin = [getattr(kept, name)[::every] for name in ("q", "qd", "qdd", "motor")]
    if len(thin[0]) < _LEAST_SAMPLES:
        raise InputError(
            f"trial {trial}: a steady part of {max(len(kept.time_s), 0)} samples after the kernel",
            column="end_s",
            expected=f"{WIDTH_S + _LEAST_SAMPLES * EVERY_S:g} s or more between onset_s and end_s",
        )
    q, qd, qdd, motor = thin
    speed = np.abs(qd.mean(axis=0))
    if not hold and int(np.argmax(speed)) != axis:
        raise InputError(
            f"trial {trial}: a sweep of axis {axis + 1} in which axis {int(np.argmax(speed)) + 1} "
            "moves fastest",
            column="axis",
        )
    # friction + cables + spring (S,) = tau_motor - (M qdd + C qd + G), of the robot alone
    load = motor[:, axis] - bodies.torque(q, qd, qdd)[:, axis]
    raw = recording.position[recording.samples_of(smooth.row), axis]
    approach = _approach(entry, raw) if hold else int(np.sign(qd[:, axis].mean()) or 1)
    return SteadyPart(trial, axis, q[:, axis], qd[:, axis], load, approach)


def _approach(entry: Any, q: FloatArray) -> int:
    """Approach from the table, else from the first and last angle of the trial."""
    stated = number_in(entry, "approach")
    if stated is None:
        return 1 if q[-1] >= q[0] else -1
    if stated not in (1.0, -1.0):
        raise InputError(
            f"trial {entry['trial']}: approach {stated:g}",
            column="approach",
            expected="1 from below or -1 from above",
        )
    return int(stated)


# Samples in which the axis moves: only these are used for a contribution.
#
# The friction of gears at rest can have any value up to the static one, in either direction, and
# cannot be distinguished from the person's torque. On the elevation axis it is as large as the
# arm's weight. The sums of a movement therefore leave out the samples in which its axis is slower
# than the range of the friction model; this does not change a constant share.

#: Multiple of the speed over which the Coulomb friction builds up, `Loads.rise_rad_s`.
SLIDING: Final = 5.0
#: An axis that is faster than this moves in any case, rad/s (2.9 degrees per second).
SURELY_RAD_S: Final = 0.05


def slides(velocity: FloatArray, rise_rad_s: float) -> BoolArray:
    """Mask of samples in which an axis moves, of the velocity's shape.

    Parameters
    ----------
    velocity : (...)
        rad/s.
    rise_rad_s : float
        Speed v_s of its friction.

    Returns
    -------
    (...) bool
    """
    return abs(velocity) >= least_speed(rise_rad_s)


def least_speed(rise_rad_s: float) -> float:
    """Least speed of a moving axis, rad/s."""
    return min(SLIDING * rise_rad_s, SURELY_RAD_S)
