"""Truth of a recording of the therapy robot: the device, the motion, the person."""

from __future__ import annotations

import os
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from armimpedance.core.arrays import FloatArray, IntArray, frozen_array
from armimpedance.core.errors import RecordError
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice
from manipulandum_sim.therapy.plant import Motion
from manipulandum_sim.truth_file import reading_values, write_values

#: Fields of `TherapyTruth` that hold one value for each axis.
_AXES: Final = (
    "coulomb", "static", "viscous", "stribeck_rad_s", "cable_stiffness", "cable_rest_rad",
    "motor_inertia_kgm2",
)  # fmt: skip
#: Those that hold one value for each trial, where a person or a mock-up is in the robot.
_TRIALS: Final = ("contribution", "contribution_elastic", "projection", "cancellation")
#: Those that hold one value for each trial and axis.
_TRIAL_AXES: Final = ("stiffness", "rest_rad", "damping", "tone_Nm")
#: At how many angles the counterbalance spring is written.
_SPRING_POINTS: Final = 106


@dataclass(frozen=True)
class TherapyMotion:
    """The exact courses at the N samples of a recording, columns in the order of the axes.

    Attributes
    ----------
    q, qd, qdd : (N, n)
        rad, rad/s, rad/s^2.
    motor, user : (N, n)
        N m, by the motors, and by the person beyond the passive arm.
    friction, springs, robot : (N, n)
        N m: bristles; cables and counterbalance spring; links and rotors. Their sum is tau_r.
    arm, passive : (N, n)
        N m: what is carried, rigid; stiffness, tone and resistance. Their sum is tau_h.
    sensor : (N,)
        N m, torque beyond the gear of axis 2.
    """

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    motor: FloatArray
    user: FloatArray
    friction: FloatArray
    springs: FloatArray
    robot: FloatArray
    arm: FloatArray
    passive: FloatArray
    sensor: FloatArray

    def __post_init__(self) -> None:
        shape = np.shape(self.q)
        for field in fields(self):
            wanted = shape[:1] if field.name == "sensor" else shape
            value = frozen_array(getattr(self, field.name), field.name, wanted)
            object.__setattr__(self, field.name, value)

    @property
    def tau_r(self) -> FloatArray:
        """Torque that the empty robot needs, (N, n)."""
        return self.robot + self.friction + self.springs

    @property
    def tau_h(self) -> FloatArray:
        """Torque that the passive arm needs, (N, n)."""
        return self.arm + self.passive

    def contribution(
        self, axis: int, samples: slice | IntArray, beside: FloatArray | None = None
    ) -> TrueContribution:
        """The person's share in the passive arm's torque about one axis (from 0).

        Parameters
        ----------
        samples : slice or (S,) int
        beside : (S,), optional
            Of `true_contribution`.
        """
        return true_contribution(self.user[samples, axis], self.tau_h[samples, axis], beside)

    @classmethod
    def of(cls, motion: Motion, lengths: IntArray) -> TherapyMotion:
        """The first samples (T,) of every trial, one trial after another."""
        return cls(**{f.name: rows(getattr(motion, f.name), lengths) for f in fields(cls)})


@dataclass(frozen=True)
class TrueContribution:
    """Per cent: (4), the projection, the share beside another torque; ``|sum| / sum|.|`` of tau_h.

    `share` is NaN where no other torque was named.
    """

    ratio: float
    projection: float
    share: float
    cancellation: float


def true_contribution(
    user: FloatArray, need: FloatArray, beside: FloatArray | None = None
) -> TrueContribution:
    """Contribution from torques (S,) of the person and of the passive arm, N m.

    Parameters
    ----------
    beside : (S,), optional
        A torque of which the person may give any share, as the robot's own inertia.
    """
    share = float("nan")
    if beside is not None:
        both = np.stack([need, beside], axis=1)
        # user (S,) = [need, beside] (S, 2) (c, d) (2,)
        share = 100 * float(np.linalg.lstsq(both, user, rcond=None)[0][0])
    return TrueContribution(
        ratio=_percent(float(user.sum()), float(need.sum())),
        projection=_percent(float(user @ need), float(need @ need)),
        share=share,
        cancellation=float(abs(need.sum()) / np.abs(need).sum()),
    )


def _percent(part: float, whole: float) -> float:
    """Never infinite: a denominator of exactly zero is no number that a truth can hold."""
    return float(100 * part / (whole if whole else np.finfo(float).tiny ** 0.5))


def rows(values: FloatArray, lengths: IntArray) -> FloatArray:
    """The first `lengths` (T,) samples of every trial, one after another, of (S, T, ...)."""
    return np.concatenate([values[:length, t] for t, length in enumerate(lengths)])


@dataclass(frozen=True)
class TherapyTruth:
    """Truth of a recording of T trials on n axes.

    Attributes
    ----------
    session, subject, robot : str
    offsets : (T + 1,) int
    axes : tuple of n str
    coulomb, static, viscous, stribeck_rad_s : (n,)
        Friction: N m, N m, N m s/rad, rad/s.
    cable_stiffness, cable_rest_rad : (n,)
        N m/rad, rad.
    motor_inertia_kgm2 : (n,)
    upper_arm_m : float
        That the robot was adjusted to.
    link_mass_kg : (n,)
        In the order of the chain.
    spring_angle_rad, spring_Nm : (P,)
        What the motor of axis 1 must add for the counterbalance spring.
    contribution : (T,) or None
        ``100 sum tau_user / sum tau_h`` of the moving axis, percent, (4).
    contribution_elastic : (T,) or None
        The same with a tau_h of masses and stiffness alone: tone and resistance of the muscles
        count as the person's.
    projection : (T,) or None
        ``100 sum tau_user tau_h / sum tau_h^2``.
    cancellation : (T,) or None
        ``|sum tau_h| / sum |tau_h|``.
    stiffness, rest_rad : (T, n) or None
        k_s and q_0 of the arm in that repetition.
    damping, tone_Nm : (T, n) or None
        Velocity-dependent resistance, N m s/rad, and constant torque that tau_h has from tone.
    motion : TherapyMotion or None
        Not written to disk: the same seed gives it again.
    """

    session: str
    subject: str
    robot: str
    offsets: IntArray
    axes: tuple[str, ...]
    coulomb: FloatArray
    static: FloatArray
    viscous: FloatArray
    stribeck_rad_s: FloatArray
    cable_stiffness: FloatArray
    cable_rest_rad: FloatArray
    motor_inertia_kgm2: FloatArray
    upper_arm_m: float
    link_mass_kg: FloatArray
    spring_angle_rad: FloatArray
    spring_Nm: FloatArray
    contribution: FloatArray | None = None
    contribution_elastic: FloatArray | None = None
    projection: FloatArray | None = None
    cancellation: FloatArray | None = None
    stiffness: FloatArray | None = None
    rest_rad: FloatArray | None = None
    damping: FloatArray | None = None
    tone_Nm: FloatArray | None = None
    motion: TherapyMotion | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "axes", tuple(self.axes))
        put(self, "offsets", frozen_array(self.offsets, "offsets", (None,), np.int64))
        trials, n = self.n_trials, len(self.axes)
        shapes: dict[str, tuple[int | None, ...]] = dict.fromkeys((*_AXES, "link_mass_kg"), (n,))
        shapes |= {"spring_angle_rad": (None,), "spring_Nm": np.shape(self.spring_angle_rad)}
        shapes |= dict.fromkeys(_TRIALS, (trials,)) | dict.fromkeys(_TRIAL_AXES, (trials, n))
        for name, shape in shapes.items():
            value = getattr(self, name)
            if value is not None:
                put(self, name, frozen_array(value, name, shape))
        if self.motion is not None and len(self.motion.q) != self.offsets[-1]:
            raise RecordError("a motion of another length", expected=f"{self.offsets[-1]} samples")

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.offsets) - 1

    def samples_of(self, row: int) -> slice:
        """The samples of trial `row`, counted from 0."""
        return slice(int(self.offsets[row]), int(self.offsets[row + 1]))

    def samples_at(self, row: int, time_s: FloatArray) -> IntArray:
        """The samples (S,) of trial `row` at these times on its clock."""
        return self.samples_of(row).start + np.rint(np.asarray(time_s) * RATE_HZ).astype(np.int64)

    @classmethod
    def of(
        cls,
        session: str,
        subject: str,
        device: TherapyDevice,
        offsets: IntArray,
        motion: TherapyMotion | None = None,
        **per_trial: FloatArray,
    ) -> TherapyTruth:
        """Truth of a session with this device; `per_trial` are the optional attributes."""
        law = device.friction
        low, high = device.limits_rad[0]
        angles = np.linspace(low, high, _SPRING_POINTS)
        return cls(
            session=session,
            subject=subject,
            robot=device.name,
            offsets=offsets,
            axes=device.axes,
            coulomb=law.coulomb,
            static=law.static,
            viscous=law.viscous,
            stribeck_rad_s=law.stribeck_rad_s,
            cable_stiffness=device.cable_stiffness,
            cable_rest_rad=device.cable_rest_rad,
            motor_inertia_kgm2=device.motor_inertia_kgm2,
            upper_arm_m=device.upper_arm_m,
            link_mass_kg=np.array([link.mass_kg for link in device.links]),
            spring_angle_rad=angles,
            spring_Nm=device.spring.torque(angles),
            motion=motion,
            **per_trial,
        )

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write as JSON (``truth.json``), the motion left out; replaced at once or not at all."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "motion"}
        write_values(values, path)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> TherapyTruth:
        """Read what `write` wrote.

        Raises
        ------
        InputError
            If the file is not such a truth.
        """
        with reading_values(path, "a truth of a therapy robot") as plain:
            return cls(**plain)
