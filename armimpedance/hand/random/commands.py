"""Commands of the robot as instruments, and facts that a recording of joints must state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.conventions import AXES, command_columns, perturbation_columns
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from armimpedance.numerics.signals import refuse_degrees

#: Smallest share of a trial's motion that its own commands explain.
LEAST_SHARE: Final = 0.1


@dataclass(frozen=True, eq=False)
class Commands(FrozenRecord):
    """Instruments at every sample.

    `values` (N, c).
    `told`: True for the robot's commands; else they are the measured motion.
    """

    values: Annotated[FloatArray, "N c"]
    told: bool
    warnings: tuple[str, ...] = ()


def commands_of(recording: Recording) -> Commands:
    """Read the commands of a recording.

    Raises InputError: there are none, and the robot did not impose the position.
    """
    d = recording.axes
    names = [f"command_{axis}" for axis in AXES[:d]]
    families = [names, list(command_columns(recording.kind, d)), list(perturbation_columns(d))]
    for family in families:
        present = [name for name in family if name in recording.extra]
        moving = [name for name in present if np.ptp(np.nan_to_num(recording.extra[name])) > 0]
        if moving:
            return _chosen(recording, family, moving)
    if recording.imposed != "position":
        raise InputError(
            "the samples do not hold the robot's command: in a loop of limb and robot the "
            "force answers the motion and the motion the force",
            column=", ".join(names if recording.kind == "hand" else families[2]),
            expected="the robot's commands, or imposed 'position' in recording.json",
        )
    text = (
        "no commands: the measured motion stands for them, which is right for a robot that yields "
        "to nothing; one that yields makes M, B and K wrong by the person's own force"
    )
    return Commands(recording.position, False, (text,))


def _chosen(recording: Recording, family: list[str], moving: list[str]) -> Commands:
    values = [np.nan_to_num(recording.extra[name]) for name in moving]
    dead = [i for i, name in enumerate(family) if name not in moving]
    if not dead:
        return Commands(np.stack(values, axis=1), True)
    still = ", ".join(family[i] for i in dead)
    values += [recording.position[:, i] for i in dead]
    text = f"no command in {still}: the measured motion of that axis stands for it"
    return Commands(np.stack(values, axis=1), True, (text,))


def check_follows(trial: FloatArray, shares: FloatArray) -> None:
    """Refuse trials whose motion their commands do not explain.

    `trial` (T,): numbers.
    `shares` (T,): share of each trial's motion that is explained.
    """
    wrong = shares < LEAST_SHARE
    if not wrong.any():
        return
    which = ", ".join(f"{int(t)}" for t in trial[wrong][:5])
    raise InputError(
        f"the limb does not follow its commands in trial {which}: they explain "
        f"{100 * max(float(shares[wrong].max()), 0.0):.0f} % of its motion",
        column="commands",
        expected="each trial's own commands on the clock of its samples",
    )


# Facts of a recording of joints that must be stated and can be wrong: source of the torque, unit.

#: Warning for a commanded torque.
COMMANDED: Final = (
    "commanded torque: it holds what the motor was told, so that M, B and K are those of limb and "
    "device together"
)


def check_joints(recording: Recording) -> tuple[str, ...]:
    """Refuse a recording of joints without the necessary facts; return warnings.

    Raises InputError: angles in degrees, or a recording that does not state which torque it holds.
    """
    if recording.kind != "joint":
        return ()
    refuse_degrees(recording.position, tuple(f"q{i + 1}" for i in range(recording.axes)))
    if recording.torque is None:
        raise InputError(
            "it does not say which torque it holds",
            column="torque",
            expected='"interaction" (measured between limb and device) or "commanded" (the '
            "motor's: of limb and device together)",
        )
    return (COMMANDED,) if recording.torque == "commanded" else ()
