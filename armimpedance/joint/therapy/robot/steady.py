"""The parts of a calibration that are steady: sweeps at constant velocity, and holds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.records import Recording
from armimpedance.joint.therapy.robot.cells import number_in
from armimpedance.joint.therapy.robot.smooth import (
    WIDTH_S,
    SmoothTrial,
    kernels_for,
    no_step,
    smooth_trials,
)
from armimpedance.joint.therapy.robot.therapy_robot import TherapyRobot
from armimpedance.numerics.regression import Fit

#: After the kernel (-3 dB near 9 Hz) samples at this distance carry all there is, s.
EVERY_S: Final = 0.01
#: A steady part needs this many of them.
_LEAST_SAMPLES: Final = 5


@dataclass(frozen=True, eq=False)
class SteadyPart(FrozenRecord):
    """One axis during a sweep or a hold; S samples, `EVERY_S` apart.

    Attributes
    ----------
    trial : str
    axis : int
        Counted from 0.
    q, qd : (S,)
        rad, rad/s.
    load : (S,)
        N m, motor torque less that of the rigid bodies: friction, cables and spring.
    approach : int
        1 where the axis came from below, -1 from above; the direction of a sweep.
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
        """Mean size of the velocity, rad/s."""
        return abs(float(self.qd.mean()))


def steady_parts(
    recording: Recording,
    robot: TherapyRobot,
    condition: str,
    step: Callable[[], object] = no_step,
) -> tuple[SteadyPart, ...]:
    """All trials of one condition, from `onset_s` to `end_s`, half a kernel off at either end.

    Parameters
    ----------
    recording : Recording
        Columns `axis`, `onset_s` and `end_s` in its trial table; `approach` for holds.
    robot : TherapyRobot
        Adjusted as it was.
    condition : {"sweep", "hold"}
    step : function, optional
        Called after every trial.

    Raises
    ------
    InputError
        A column is missing or wrong, or a steady part is too short.
    """
    from armimpedance.joint.therapy.robot.rigid import robot_bodies

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
    """Standard errors (p,) of a fit to steady parts whose torque noise was white.

    The textbook's, times what the kernel makes neighbouring samples repeat each other.
    """
    inverse = np.linalg.inv(fitted.triangle)
    sd = fitted.residual_sd * np.sqrt((inverse**2).sum(axis=1))
    return np.asarray(sd * np.sqrt(_repeats()))


def at_least_white(fitted: Fit) -> Fit:
    """The fit with standard errors that are no less than white noise of the torque makes them.

    Few sweeps may agree by chance: six of them put the error of a Coulomb torque anywhere between a
    quarter and twice of what it is.
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
    came = _approach(entry, raw) if hold else int(np.sign(qd[:, axis].mean()) or 1)
    return SteadyPart(trial, axis, q[:, axis], qd[:, axis], load, came)


def _approach(entry: Any, q: FloatArray) -> int:
    """From the table, else from where the trial began."""
    given = number_in(entry, "approach")
    if given is None:
        return 1 if q[-1] >= q[0] else -1
    if given not in (1.0, -1.0):
        raise InputError(
            f"trial {entry['trial']}: approach {given:g}",
            column="approach",
            expected="1 from below or -1 from above",
        )
    return int(given)
