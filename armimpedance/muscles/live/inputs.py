"""Inputs of live updates: checked samples, and the calibration of each muscle's EMG."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Final, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray, FrozenRecord, frozen_array
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.hand.levels import arm_of_whose, moving_joints
from armimpedance.limb.arm import Arm
from armimpedance.muscles.live.hand_stiffness import StiffnessForm, form_of
from armimpedance.muscles.models import MuscleModel, read_model
from armimpedance.numerics.signals import emg_amplitude, mvc_column, rest_column, without_rest
from armimpedance.show.verbs.results import read_recording

# What an EMG of each muscle means: its maximum, its rest, its noise; and the gain that drifts.

#: Low-pass of the rectified EMG: as late as a muscle is where its activation changes at 1 Hz.
CUTOFF_HZ: Final = 3.5
ORDER: Final = 2
#: Relative error of an amplitude where no EMG of the person says it: surface EMG at `CUTOFF_HZ`.
NOISE: Final = 0.1
#: A muscle that a known load made less active than this says nothing of its gain.
LEAST_ACTIVE: Final = 0.03


@dataclass(frozen=True)
class EmgLevels(FrozenRecord):
    """Levels of the EMG of m muscles.

    Attributes
    ----------
    maximum_V : (m,)
        Mean rectified EMG in a maximum voluntary contraction.
    rest_V : (m,)
        The same of a silent muscle; 0 where it is not known.
    noise : (m,)
        Standard error of an amplitude over the amplitude, from the randomness of the carrier.
    rail_V : float or None
        Where the amplifier ends, if it is known.
    """

    maximum_V: Annotated[FloatArray, "m"]
    rest_V: Annotated[FloatArray, "m"]
    noise: Annotated[FloatArray, "m"]
    rail_V: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.maximum_V > self.rest_V).all() or not (self.rest_V >= 0).all():
            raise InputError("levels of the EMG", expected="0 <= rest < maximum, V")
        if self.rail_V is not None and not self.rail_V > self.maximum_V.max():
            raise InputError(f"a rail of {self.rail_V:g} V", expected="more than the maxima")

    @classmethod
    def of(cls, recording: Recording, muscles: tuple[str, ...]) -> EmgLevels:
        """The levels that a recording's trial table holds, of the muscles in this order.

        Raises
        ------
        InputError
            No EMG of a muscle, no maximum, or EMG in which nothing is random any more.
        """
        missing = [name for name in muscles if name not in recording.muscles]
        if missing or recording.emg_unit != "V":
            raise InputError("the recording has no EMG in V of all muscles", expected=muscles[0])
        columns = [recording.muscles.index(name) for name in muscles]
        table = recording.trials
        maximum = [mvc_column(name) for name in muscles]
        absent = [name for name in maximum if name not in table]
        if absent:
            raise InputError("the trial table has no maximum", column=absent[0], expected="V")
        rest = [rest_column(name) for name in muscles]
        known = all(name in table for name in rest)
        amplitude = emg_amplitude(recording, cutoff_hz=CUTOFF_HZ, order=ORDER, causal=True)
        return cls(
            maximum_V=table[maximum].mean().to_numpy(dtype=float),
            rest_V=table[rest].mean().to_numpy(dtype=float) if known else np.zeros(len(muscles)),
            noise=amplitude.relative_noise[columns],
        )

    @cached_property
    def _scale(self) -> FloatArray:
        """The muscle's own part of its maximum (m,), V."""
        return np.asarray(np.sqrt(self.maximum_V**2 - self.rest_V**2))

    def activation(self, amplitude_V: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Activation of amplitudes (m,), noise at rest taken off, and its standard error (m,)."""
        own, sd = without_rest(amplitude_V, self.noise * amplitude_V, self.rest_V)
        return own / self._scale, sd / self._scale

    def recalibrated(self, rest_V: ArrayLike, loads_V: ArrayLike, known: ArrayLike) -> GainDrift:
        """Follow gains that have drifted: a person's rest and known loads, held once more.

        Parameters
        ----------
        rest_V : (m,)
            Mean rectified EMG at rest now.
        loads_V : (L, m)
            The same under each known load, two or more.
        known : (L, m)
            Activation under the same loads when the model was fitted.

        Returns
        -------
        GainDrift

        Raises
        ------
        InputError
            Shapes that do not belong together, or fewer than two loads.
        """
        m = len(self.maximum_V)
        rest = frozen_array(rest_V, "rest_V", (m,))
        loads = frozen_array(loads_V, "loads_V", (None, m))
        then = frozen_array(known, "known", (len(loads), m))
        if len(loads) < 2:
            raise InputError(f"{len(loads)} known load", expected="two or more")
        own = np.sqrt(np.maximum(loads**2 - rest**2, 0.0))
        scale = self._scale
        square = (then**2).sum(axis=0)
        told = (then > LEAST_ACTIVE).all(axis=0)
        safe = np.where(told, square, 1.0)
        # own_l = gain scale then_l: least squares through zero, muscle by muscle
        gain = np.where(told, (own * then).sum(axis=0) / (safe * scale), 1.0)
        residual = own / scale - gain * then
        sd = np.sqrt((residual**2).sum(axis=0) / (len(loads) - 1) / safe)
        moved = np.hypot(gain * scale, rest)
        levels = replace(
            self,
            maximum_V=np.where(told, moved, self.maximum_V),
            rest_V=np.where(told, rest, self.rest_V),
        )
        return GainDrift(levels, gain, np.where(told, sd, np.inf), told)


@dataclass(frozen=True)
class GainDrift:
    """Result of a recalibration.

    `levels`: to go on with.
    `gain`, `sd` (m,): gain now over gain then, and its standard error from what the loads differ
    by; 1 and inf where the loads do not tell.
    `told` (m,) bool: muscles that every load made active; the others keep their levels.
    """

    levels: EmgLevels
    gain: FloatArray
    sd: FloatArray
    told: FloatArray


Elbow = Literal["held", "free"]
#: No joint angle (rad), place (m), force (N), displacement (m), EMG (V, behind any amplifier) or
#: error of an activation is larger: other units are.
_LARGEST: Final = {
    "q": 2 * np.pi,
    "hand": 10.0,
    "force": 1e4,
    "displacement": 10.0,
    "signal": 10.0,
    "signal_sd": 1.0,
}


def form_for(model: Any) -> StiffnessForm:
    """The form of a model, of one in a file, or the form itself.

    Raises InputError: the file cannot be read, or the model is none of posture and activation.
    """
    if isinstance(model, StiffnessForm):
        return model
    file = model if isinstance(model, str | os.PathLike) else None
    read = model if file is None else read_model(Path(file))
    if not isinstance(read, MuscleModel):
        raise InputError(
            "a model that is not of posture and activation", file=file, expected="`fit muscles`"
        )
    return form_of(read)


def arm_for(whose: Any, joints: int) -> Arm:
    """The arm of a recording, of one at a path, of a subject, or the arm itself.

    Raises InputError: the arm is not known, or has another number of joints.
    """
    arm: Any = whose if hasattr(whose, "jacobian") else arm_of_whose(whose, joints)
    if arm.joints != joints:
        raise InputError(f"an arm of {arm.joints} joints", expected=f"{joints}, as the model")
    return cast(Arm, arm)


def moving_for(whose: Any, joints: int, elbow: Elbow | None) -> tuple[int, ...]:
    """The joints that move: all of an arm that is given as such.

    Raises InputError: the elbow of an arm that is given as such, or of a planar one, is asked
    about.
    """
    if not hasattr(whose, "jacobian"):
        return moving_joints(joints, whose, elbow)
    if elbow is not None:
        raise InputError("elbow of an arm that is given", expected="it with a recording")
    return tuple(range(joints))


def levels_for(levels: Any, muscles: tuple[str, ...]) -> EmgLevels:
    """The levels themselves, or those of a recording or of one at a path.

    Raises InputError: the recording cannot be read, or does not hold the levels of all muscles.
    """
    if isinstance(levels, EmgLevels):
        return levels
    if isinstance(levels, str | os.PathLike):
        levels = read_recording(levels)
    return EmgLevels.of(levels, muscles)


def vector(values: ArrayLike, name: str, length: int, *, lost: bool = False) -> FloatArray:
    """A vector (length,) of finite numbers; with `lost`, NaN where there is no number."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} is no list of numbers", expected=f"{length} numbers") from None
    if array.shape != (length,):
        raise InputError(f"{name} of shape {array.shape}", expected=f"({length},)")
    largest = _LARGEST[name]
    if lost:
        array[~(np.abs(array) <= largest)] = np.nan
        return array
    if not (np.abs(array) <= largest).all():
        raise InputError(f"{name} of {array.tolist()}", expected=f"finite, up to {largest:.4g}")
    return array
