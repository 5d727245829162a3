"""What every peer reads: arrays on the disk, with no word about the truth."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Hand:
    """Pushes of a hand in conditions of `each` trials.

    Attributes
    ----------
    rate_hz : float
    lag_s : (S,)
        Time from the onset of the push.
    position, force : (T, S, 2)
        m; N, by the limb on the handle.
    each : int
        Trials of a condition; trials ``c each`` to ``(c + 1) each`` are condition c.
    """

    rate_hz: float
    lag_s: np.ndarray
    position: np.ndarray
    force: np.ndarray
    each: int

    @property
    def conditions(self) -> list[slice]:
        """The trials of each condition."""
        return [slice(i, i + self.each) for i in range(0, len(self.position), self.each)]


@dataclass(frozen=True)
class Joint:
    """Records (T, S) of a joint under a random torque: rad, and N m on the limb."""

    rate_hz: float
    angle: np.ndarray
    torque: np.ndarray


def load_hand(folder: Path) -> Hand:
    """All trials in the memory, as float64: what a script of a laboratory does first."""
    told = json.loads((folder / "told.json").read_text())
    position, force = (np.load(folder / f"{n}.npy") for n in ("position", "force"))
    lag = np.arange(position.shape[1]) / told["rate_hz"] - told["rest_s"]
    return Hand(told["rate_hz"], lag, position.astype(float), force.astype(float), told["each"])


def load_joint(folder: Path) -> Joint:
    """All records in the memory, as float64."""
    told = json.loads((folder / "told.json").read_text())
    angle, torque = (np.load(folder / f"{n}.npy").astype(float) for n in ("angle", "torque"))
    return Joint(told["rate_hz"], angle, torque)
