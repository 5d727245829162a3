"""Samples of passive joints: motion and passive torque, both after the same filter.

The passive torque is the right-hand side of Venture's equation (6),
``k (q - q_r) + h qd + f sign(qd)``: what resists the motion is positive. For a relaxed limb it is
-H, minus the torque of inertia, Coriolis and gravity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import InputError, RecordError
from armimpedance.core.trials import check_rate, trial_slices
from armimpedance.joint.relaxed.hinge import HingeDynamics


@dataclass(frozen=True)
class PassiveSamples(FrozenRecord):
    """Motion and passive torque of j joints, N samples of all trials one after another.

    Attributes
    ----------
    sample_rate_hz : float
    offsets : (T + 1,) int
        Samples of trial t: ``offsets[t]:offsets[t + 1]``.
    joints : tuple of j str
    q, qd : (N, j)
        rad and rad/s, after the filter.
    torque : (N, j)
        Passive torque, N m, after the filter.
    measured_q : (N, j)
        Before the filter.
    cutoff_hz : float or None
        Cut-off of the zero-phase second-order Butterworth low-pass that q and what the torque is
        made of went through; None: no filter.
    qdd : (N, j) or None
        rad/s^2, after the filter; None where nothing was made of it.
    measured_torque : (N, j) or None
        Before the filter, where it is measured and not computed from the motion.
    hinges : tuple of j HingeDynamics or None
        How each joint moves with the other coordinates as measured, where a skeleton is known.
    trials : tuple of T str
        Names of the trials, for messages.
    notes : tuple of str
        Remarks that a reader of the result must know.
    """

    sample_rate_hz: float
    offsets: Annotated[IntArray, "T+1"]
    joints: Annotated[tuple[str, ...], "j"]
    q: Annotated[FloatArray, "N j"]
    qd: Annotated[FloatArray, "N j"]
    torque: Annotated[FloatArray, "N j"]
    measured_q: Annotated[FloatArray, "N j"]
    cutoff_hz: float | None = None
    qdd: Annotated[FloatArray, "N j"] | None = None
    measured_torque: Annotated[FloatArray, "N j"] | None = None
    hinges: tuple[HingeDynamics, ...] | None = None
    trials: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_rate(self.sample_rate_hz)
        if len(self.offsets) < 2 or self.offsets[0] != 0 or (np.diff(self.offsets) <= 0).any():
            raise RecordError("a trial has no samples", expected="rising offsets from 0")
        if self.offsets[-1] != len(self.q):
            raise RecordError(f"{len(self.q)} samples", expected=f"{self.offsets[-1]}")
        trials = self.trials or tuple(str(t + 1) for t in range(self.n_trials))
        object.__setattr__(self, "trials", trials)
        if len(trials) != self.n_trials or len(self.hinges or self.joints) != len(self.joints):
            raise RecordError("names of trials or dynamics of joints that do not match the samples")

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.offsets) - 1

    def slices(self) -> list[slice]:
        """The samples of each trial."""
        return trial_slices(self.offsets)

    def joint(self, name: str) -> int:
        """Which column bears this joint's name.

        Raises
        ------
        InputError
            None does.
        """
        if name not in self.joints:
            raise InputError(f"no joint {name!r}", expected=f"one of {', '.join(self.joints)}")
        return self.joints.index(name)

    def only(self, joint: int) -> PassiveSamples:
        """The samples of one joint, numbered from 0."""
        one = slice(joint, joint + 1)
        hinges = self.hinges and self.hinges[one]
        return replace(self, joints=self.joints[one], hinges=hinges, **self._signals(np.s_[:, one]))

    def select(self, rows: list[int]) -> PassiveSamples:
        """The samples of these trials only (rows from 0)."""
        kept = [self.slices()[r] for r in rows]
        index = np.concatenate([np.arange(s.start, s.stop) for s in kept])
        hinges = self.hinges and tuple(h.select(rows) for h in self.hinges)
        return replace(
            self,
            offsets=np.concatenate([[0], np.cumsum([s.stop - s.start for s in kept])]),
            hinges=hinges,
            trials=tuple(self.trials[r] for r in rows),
            **self._signals(index),
        )

    def _signals(self, at: Any) -> dict[str, Any]:
        """A part of every signal (N, j)."""
        names = ("q", "qd", "torque", "measured_q", "qdd", "measured_torque")
        signals = {name: getattr(self, name) for name in names}
        return {name: None if x is None else x[at] for name, x in signals.items()}

    def in_thirds(self) -> PassiveSamples:
        """A single trial cut into three that follow each other.

        Raises
        ------
        InputError
            Several trials.
        """
        if self.n_trials != 1:
            raise InputError(f"{self.n_trials} trials to cut into thirds", expected="one")
        count = int(self.offsets[-1])
        edges = [0, count // 3, 2 * count // 3, count]
        names = tuple(f"third {i} of trial {self.trials[0]}" for i in (1, 2, 3))
        hinges = self.hinges and tuple(h.cut(edges) for h in self.hinges)
        return replace(self, offsets=np.array(edges), hinges=hinges, trials=names)

    def with_torque_turned(self, sentence: str) -> PassiveSamples:
        """A copy whose torque has the other sign, and a note that says so."""
        turned = None if self.measured_torque is None else -self.measured_torque
        notes = (*self.notes, sentence)
        return replace(self, torque=-self.torque, measured_torque=turned, notes=notes)
