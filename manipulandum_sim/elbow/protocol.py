"""The experiments at the elbow: what muscles, load and exoskeleton do in every trial."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final, Literal, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray, FrozenRecord
from armimpedance.core.errors import InputError
from manipulandum_sim.elbow.device import Rendered
from manipulandum_sim.elbow.subject import OPERATING_ANGLE_RAD, ElbowSubject, Law

Test = Literal["posture", "cocontraction", "varying", "calibration", "spring", "damper", "inertia"]

#: What restores the posture between perturbations: soft, so that the elbow can be moved.
POSTURE_REFERENCE: Final = Rendered(viscosity=0.3, stiffness=3.0)
#: The loads of (10a-c).
LOADS: Final = {
    "spring": Rendered(stiffness=8.0),
    "damper": Rendered(viscosity=1.5),
    "inertia": Rendered(inertia=0.10),
}
#: Rhythmic movement against them: amplitude rad (23 degrees), Hz.
RHYTHM_RAD: Final = 0.40
RHYTHM_HZ: Final = 0.8
#: Torque over which one muscle hands over to the other in it, N m.
HAND_OVER_Nm: Final = 0.3
#: Levels of the co-contraction test: name -> (flexor or None where it balances alone, extensor).
LEVELS: Final[dict[str, tuple[float | None, float]]] = {
    "low": (None, 0.03),
    "medium": (None, 0.09),
    "high": (None, 0.16),
    "flexor_low": (0.10, 0.02),
    "flexor_high": (0.17, 0.02),
    "extensor_low": (0.02, 0.10),
    "extensor_high": (0.02, 0.17),
}
#: Levels of the isometric calibration: name -> (flexor, extensor).
ISOMETRIC: Final[dict[str, tuple[float, float]]] = {
    "rest": (0.0, 0.0),
    "flexion_low": (0.10, 0.01),
    "flexion_medium": (0.20, 0.02),
    "flexion_high": (0.35, 0.035),
    "extension_low": (0.01, 0.10),
    "extension_medium": (0.02, 0.20),
    "extension_high": (0.035, 0.35),
    "cocontraction_low": (0.08, 0.10),
    "cocontraction_high": (0.20, 0.22),
}
#: Extensor of the varying test over that of the posture test.
VARYING_FACTOR: Final = 1.5
#: Repetitions of it differ in their load, by this share of the extensor's activation; without it
#: flexor and extensor would go up and down as one and nobody could tell them apart.
SHIFTS: Final = (0.0, 0.3, -0.3, 0.15, -0.15)
#: Room that the varying extensor keeps above silence, of its swing.
ROOM: Final = 1.05


@dataclass(frozen=True)
class Protocol(FrozenRecord):
    """T trials of one test.

    Activations are ``targets + swing sin(2 pi frequency t + phase)``; in a rhythmic movement they
    are what the movement needs.

    Attributes
    ----------
    test, law : str
    subject : ElbowSubject
    conditions : tuple of T str
    targets, swing : (T, 2)
        Flexor, extensor.
    phase : (T,)
        rad, of the variation or of the movement.
    frequency_hz : float
    load : (T,)
        Constant torque of the device on the limb, N m.
    rendered : Rendered
    rhythm_rad : float
        Amplitude of the intended movement; 0 holds a posture.
    """

    test: Test
    law: Law
    subject: ElbowSubject
    conditions: Annotated[tuple[str, ...], "T"]
    targets: Annotated[FloatArray, "T 2"]
    swing: Annotated[FloatArray, "T 2"]
    phase: Annotated[FloatArray, "T"]
    frequency_hz: float
    load: Annotated[FloatArray, "T"]
    rendered: Rendered
    rhythm_rad: float = 0.0

    @property
    def n_trials(self) -> int:
        """Number of trials T."""
        return len(self.conditions)

    @property
    def unperturbed(self) -> bool:
        """True if the device adds no perturbation: isometric trials and rendered loads."""
        return self.test == "calibration" or self.test in LOADS

    @property
    def constant(self) -> bool:
        """True if the activations of every trial are constant."""
        return not (self.rhythm_rad or self.swing.any())

    def intended(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The muscles' rest angle and its two derivatives, each (H, T), at times (H,)."""
        w = 2 * np.pi * self.frequency_hz
        course = w * time_s[:, None] + self.phase
        size = self.rhythm_rad
        angle = OPERATING_ANGLE_RAD + size * np.sin(course)
        return angle, size * w * np.cos(course), -size * w**2 * np.sin(course)

    def activation(self, time_s: FloatArray) -> FloatArray:
        """Activations of flexor and extensor, (H, T, 2), at times (H,)."""
        if self.rhythm_rad:
            return self._of_movement(time_s)
        if self.constant:
            return np.broadcast_to(self.targets, (len(time_s), *self.targets.shape))
        course = np.sin(2 * np.pi * self.frequency_hz * time_s[:, None] + self.phase)
        return np.asarray(self.targets + self.swing * course[..., None])

    def _of_movement(self, time_s: FloatArray) -> FloatArray:
        """One muscle takes the torque of the movement with its load, both keep their tone."""
        angle, rate, acceleration = self.intended(time_s)
        own, load = self.subject, self.rendered
        need = own.gravity * np.sin(angle) + (own.inertia + load.inertia) * acceleration
        need += load.viscosity * rate + load.stiffness * (angle - OPERATING_ANGLE_RAD)
        size = np.hypot(need, HAND_OVER_Nm)
        tone = own.torque_E * own.posture_E
        flexor = (tone + (size + need) / 2) / own.torque_F
        extensor = (tone + (size - need) / 2) / own.torque_E
        return np.stack([flexor, extensor], axis=-1)


def protocol(
    test: Test,
    subject: ElbowSubject,
    repetitions: int,
    phase_of: Callable[[int], float],
    *,
    depth: float = 0.3,
    frequency_hz: float = 0.7,
    law: Law = "linear",
) -> Protocol:
    """The trials of a test, conditions side by side within a repetition.

    Parameters
    ----------
    phase_of : function
        Phase (rad) of the trial of a number, counted from 1.

    Raises
    ------
    InputError
        An unknown test or law, or a variation that would silence a muscle.
    """
    if test not in get_args(Test):
        raise InputError(f"no elbow test {test!r}", expected=", ".join(get_args(Test)))
    if law not in get_args(Law):
        raise InputError(f"no law {law!r}", expected=" or ".join(get_args(Law)))
    names, level = _levels(test, subject)
    targets = np.tile(level, (repetitions, 1))
    swing = np.zeros_like(targets)
    if test == "varying":
        both = [_varying(subject, depth, r, law) for r in range(repetitions)]
        targets, swing = np.stack([b[0] for b in both]), np.stack([b[1] for b in both])
    moving = test in LOADS
    return Protocol(
        test=test,
        law=law,
        subject=subject,
        conditions=tuple(names) * repetitions,
        targets=targets,
        swing=swing,
        phase=np.array([phase_of(t + 1) for t in range(len(targets))]),
        frequency_hz=RHYTHM_HZ if moving else frequency_hz,
        load=np.zeros(len(targets)) if moving else subject.load_that_balances(targets),
        rendered=LOADS.get(test, POSTURE_REFERENCE),
        rhythm_rad=RHYTHM_RAD if moving else 0.0,
    )


def _levels(test: Test, subject: ElbowSubject) -> tuple[tuple[str, ...], FloatArray]:
    """Conditions of one repetition and their activations (C, 2)."""
    if test == "calibration":
        return tuple(ISOMETRIC), np.array(list(ISOMETRIC.values()))
    if test == "cocontraction":
        pairs = [
            (subject.flexor_that_balances(extensor) if flexor is None else flexor, extensor)
            for flexor, extensor in LEVELS.values()
        ]
        return tuple(LEVELS), np.array(pairs)
    return (test,), subject.posture()[None]


def _varying(
    subject: ElbowSubject, depth: float, repetition: int, law: Law
) -> tuple[FloatArray, FloatArray]:
    """Mean and swing (2,) of the activations so that K varies by a share `depth` about its middle.

    The swing is along the line that leaves the torque alone. The repetition's shift is along the
    one that leaves K alone, as far as the swing has room.
    """
    middle = subject.posture(VARYING_FACTOR)
    balanced = np.array([subject.torque_E / subject.torque_F, 1.0])
    exchange = np.array([-subject.kE / subject.kF, 1.0])
    most = float(middle[1]) / ROOM
    room = middle[1] - ROOM * _swing(subject, middle, balanced, depth, most, law)
    wanted = SHIFTS[repetition % len(SHIFTS)] * middle[1]
    mean = middle + np.clip(wanted, -room, room) * exchange
    return mean, balanced * _swing(subject, mean, balanced, depth, most, law)


def _swing(
    subject: ElbowSubject,
    mean: FloatArray,
    direction: FloatArray,
    depth: float,
    most: float,
    law: Law,
) -> float:
    """Size of the swing along `direction` that gives the depth asked for.

    Raises
    ------
    InputError
        It takes more than there is.
    """
    from scipy.optimize import brentq

    rest = np.full(2, OPERATING_ANGLE_RAD)

    def reached(size: float) -> float:
        ends = np.stack([mean + size * direction, mean - size * direction])
        high, low = subject.impedance(ends, rest, law)[0]
        return float((high - low) / (high + low))

    if not 0 < depth <= reached(most):
        raise InputError(
            f"stiffness that varies by {depth:g} of its mean",
            expected=f"more than 0, at most {reached(most):.2f}: then the extensor falls silent",
        )
    return float(brentq(lambda size: reached(size) - depth, 0.0, most, xtol=1e-14))
