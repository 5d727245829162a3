"""Truth of a recording of the simulated elbow: I, B, K, the laws, the device, the motion."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Annotated, Final

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord, IntArray
from armimpedance.core.errors import RecordError
from manipulandum_sim.truth_file import reading_values, write_values

#: Columns over the samples that are often the same throughout a trial, and written so.
_COURSES: Final = ("K", "B", "K_muscle", "activation")


@dataclass(frozen=True)
class ElbowMotion(FrozenRecord):
    """The exact motion at the N samples of a recording.

    Attributes
    ----------
    angle, rate, acceleration : (N,)
        rad, rad/s, rad/s^2.
    torque : (N,)
        By the device **on the limb**, N m.
    motor : (N,)
        The motor's torque; it moves arm and device.
    restless : (N,)
        Voluntary torque and tremor on the limb, N m.
    """

    angle: Annotated[FloatArray, "N"]
    rate: Annotated[FloatArray, "N"]
    acceleration: Annotated[FloatArray, "N"]
    torque: Annotated[FloatArray, "N"]
    motor: Annotated[FloatArray, "N"]
    restless: Annotated[FloatArray, "N"]


@dataclass(frozen=True)
class ElbowTruth(FrozenRecord):
    """Truth of a recording of T trials, N samples, m muscles.

    Attributes
    ----------
    test, subject, law : str
    muscles : tuple of m str
    offsets : (T + 1,) int
    I : float
        Inertia of the limb, kg m^2.
    K, B : (N,)
        Effective: derivatives of the torque on the limb about the operating angle (or about the
        intended movement), gravity's gradient included in K.
    K_muscle : (N,)
        K without gravity's part.
    activation : (N, m)
        As the EMG shows it, 0..1; K and B follow it by `activation_delay_s`.
    activation_delay_s : float
    stiffness_law, viscosity_law : (3,)
        ``K_muscle = k0 + kF aF + kE aE``, ``B = b0 + bF aF + bE aE``; under the law "saturating"
        the activations in them are first bent.
    torque_per_activation : (m,)
        Isometric, N m; flexors positive.
    gravity : float
        m g l of forearm and hand, N m.
    operating_angle : float
        rad.
    device_inertia, device_viscosity, device_friction : float
        kg m^2, N m s/rad, N m.
    rendered : (3,)
        I, B, K that the exoskeleton renders.
    motion : ElbowMotion or None
        Not written to disk: the same seed gives it again.
    """

    test: str
    subject: str
    law: str
    muscles: Annotated[tuple[str, ...], "m"]
    offsets: Annotated[IntArray, "T+1"]
    I: float  # noqa: E741
    K: Annotated[FloatArray, "N"]
    B: Annotated[FloatArray, "N"]
    K_muscle: Annotated[FloatArray, "N"]
    activation: Annotated[FloatArray, "N m"]
    activation_delay_s: float
    stiffness_law: Annotated[FloatArray, "3"]
    viscosity_law: Annotated[FloatArray, "3"]
    torque_per_activation: Annotated[FloatArray, "m"]
    gravity: float
    operating_angle: float
    device_inertia: float
    device_viscosity: float
    device_friction: float
    rendered: Annotated[FloatArray, "3"]
    motion: ElbowMotion | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        samples = int(self.offsets[-1])
        if len(self.K) != samples:
            raise RecordError(f"{len(self.K)} samples", expected=f"{samples}")
        if self.motion is not None and len(self.motion.angle) != samples:
            raise RecordError("a motion of another length", expected=f"{samples} samples")

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.offsets) - 1

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def trial_means(self, name: str) -> FloatArray:
        """Mean of ``K``, ``B``, ``K_muscle`` (T,) or ``activation`` (T, m) over each trial."""
        course = getattr(self, name)
        parts = [course[self.samples_of(row)].mean(axis=0) for row in range(self.n_trials)]
        return np.array(parts)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON (``truth.json``), the motion left out; replaced at once or not at all.

        What stays the same throughout a trial is written once for it.
        """
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "motion"}
        for name in _COURSES:
            parts = [values[name][self.samples_of(row)] for row in range(self.n_trials)]
            values[name] = [(p[:1] if (p == p[0]).all() else p).tolist() for p in parts]
        write_values(values, path)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> ElbowTruth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not such a truth.
        """
        with reading_values(path, "a truth of an elbow") as plain:
            lengths = np.diff(plain["offsets"])
            for name in _COURSES:
                parts = [np.array(p, dtype=float) for p in plain[name]]
                whole = [
                    np.broadcast_to(p, (n, *p.shape[1:]))
                    for p, n in zip(parts, lengths, strict=True)
                ]
                plain[name] = np.concatenate(whole)
            return cls(**plain)
