"""Information from the trials of a condition so far: M, B, K, the noise, and the departures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import ArmImpedanceError, InputError
from armimpedance.core.records import Recording, Window
from armimpedance.hand.levels import kinematic_arm
from armimpedance.hand.planning import INEFFICIENCY, PilotNoise, PlannedArm
from armimpedance.hand.still import (
    FEWEST_TRIALS,
    Knowledge,
    Model,
    largest_conditions,
)
from armimpedance.numerics.signals import cut_windows, disturbance_times

#: Size of the first set of a condition, before pushes can be chosen.
FIRST_TRIALS = 8


@dataclass(frozen=True, eq=False)
class SoFar(FrozenRecord):
    """State of one condition.

    `parameters` (3 d^2,): present estimates of M (with the handle), B and K, row by row.
    `knowledge`: information of its trials about them and the departures, with the estimated noise.
    `seen`, `seen_error` (c,): estimated sizes of the departures, and standard errors.
    `jacobian` (d, n) or None: of the arm at the onset, if lengths and angles are known.
    `trials`: number of usable trials.
    """

    name: str
    parameters: Annotated[FloatArray, "p"]
    knowledge: Knowledge
    noise: PilotNoise
    seen: Annotated[FloatArray, "c"]
    seen_error: Annotated[FloatArray, "c"]
    trials: int
    sample_rate_hz: float
    jacobian: FloatArray | None = None

    @property
    def axes(self) -> int:
        """Number of axes d of the hand."""
        return round((len(self.parameters) / 3) ** 0.5)

    @property
    def arm(self) -> PlannedArm:
        """Expected arm of further trials."""
        d = self.axes
        return PlannedArm(self.parameters.reshape(3, d, d), self.name)

    @property
    def stiffness(self) -> FloatArray:
        """Present estimate of K, (d, d)."""
        d = self.axes
        return np.asarray(self.parameters[2 * d * d :].reshape(d, d))


def loss_of(d: int) -> FloatArray:
    """Standard errors of M, B and K relative to the bound, element by element, (3 d^2,)."""
    return np.repeat(np.array(INEFFICIENCY), d * d)


def so_far(recording: Recording, condition: str) -> SoFar | None:
    """Fit a condition of a recording; None if it has too few trials to choose pushes.

    Raises InputError: the recording is not of returning disturbances of the hand in two or three
    axes, or the condition's trials do not give an arm.
    """
    rows = np.flatnonzero(recording.trials["condition"].astype(str) == condition)
    if len(rows) < FIRST_TRIALS:
        return None
    window = cut_windows(recording, rows, disturbance_times(recording))
    if window.usable.sum() < max(FIRST_TRIALS, FEWEST_TRIALS):
        return None
    model = _fitted(recording, rows, window)
    seen, seen_error = model.numbers()
    state = SoFar(
        name=condition,
        parameters=model.parameters,
        knowledge=model.knowledge(),
        noise=PilotNoise.of(model.found_noise, window),
        seen=seen,
        seen_error=seen_error,
        trials=int(window.usable.sum()),
        sample_rate_hz=float(recording.sample_rate_hz),
        jacobian=_jacobian(recording, window),
    )
    try:
        _ = state.arm
    except ArmImpedanceError as error:
        raise InputError(f"{condition}: {error}", expected="trials that give an arm's") from error
    return state


def _fitted(recording: Recording, rows: IntArray, window: Window) -> Model:
    """The fit that checks and intervals have already made, or a new one."""
    for fitted, model in largest_conditions(recording):
        if np.array_equal(fitted, rows):
            return model
    return Model.of(window, "hand")


def _jacobian(recording: Recording, window: Window) -> FloatArray | None:
    angles = window.joint_angles_at_onset
    if angles is None or recording.axes != 2:
        return None
    try:
        arm = kinematic_arm(recording.subject)
    except InputError:
        return None
    return arm.jacobian(angles[window.usable].mean(axis=0))


def conditions_of(recording: Recording, requested: Sequence[str] | None) -> tuple[str, ...]:
    """The requested conditions; default: those of the recording.

    Raises InputError: the recording has other disturbances than those that can be planned here.
    """
    if recording.kind != "hand" or recording.axes < 2 or recording.perturbation != "returning":
        raise InputError(
            f"{recording.perturbation} disturbances, {recording.kind}, {recording.axes} axes",
            expected="returning disturbances of the hand in two or three axes",
        )
    available = tuple(recording.trials["condition"].astype(str).unique())
    return available if requested is None else tuple(dict.fromkeys(requested))
