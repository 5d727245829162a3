"""What live updates are made for, and the numbers of a sample, checked."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Final, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.hand.levels import arm_of_whose, moving_joints
from armimpedance.limb.arm import Arm
from armimpedance.muscles.live.emg_levels import EmgLevels
from armimpedance.muscles.live.form import StiffnessForm, form_of
from armimpedance.muscles.models import MuscleModel, read_model
from armimpedance.show.verbs.sources import read_recording

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

    Raises
    ------
    InputError
        The file cannot be read, or the model is none of posture and activation.
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

    Raises
    ------
    InputError
        The arm is not known, or has another number of joints.
    """
    arm: Any = whose if hasattr(whose, "jacobian") else arm_of_whose(whose, joints)
    if arm.joints != joints:
        raise InputError(f"an arm of {arm.joints} joints", expected=f"{joints}, as the model")
    return cast(Arm, arm)


def moving_for(whose: Any, joints: int, elbow: Elbow | None) -> tuple[int, ...]:
    """The joints that move: all of an arm that is given as such.

    Raises
    ------
    InputError
        The elbow of an arm that is given as such, or of a planar one, is asked about.
    """
    if not hasattr(whose, "jacobian"):
        return moving_joints(joints, whose, elbow)
    if elbow is not None:
        raise InputError("elbow of an arm that is given", expected="it with a recording")
    return tuple(range(joints))


def levels_for(levels: Any, muscles: tuple[str, ...]) -> EmgLevels:
    """The levels themselves, or those of a recording or of one at a path.

    Raises
    ------
    InputError
        The recording cannot be read, or does not hold the levels of all muscles.
    """
    if isinstance(levels, EmgLevels):
        return levels
    if isinstance(levels, str | os.PathLike):
        levels = read_recording(levels)
    return EmgLevels.of(levels, muscles)


def vector(values: ArrayLike, name: str, length: int, *, lost: bool = False) -> FloatArray:
    """A vector (length,) of finite numbers; with `lost`, NaN in the place of those that are none.

    Raises
    ------
    InputError
    """
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
