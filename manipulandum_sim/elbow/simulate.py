"""A subject in the powered elbow exoskeleton: recording and truth (Ruiz 2011)."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Final, get_args

import numpy as np

from armimpedance.core.arrays import FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.records import Recording
from manipulandum_sim.elbow.arguments import (
    LEAST_S,
    TorqueColumn,
    check,
    check_muscles,
    electrodes_of,
    limits_of,
)
from manipulandum_sim.elbow.device import RATE_HZ, Exoskeleton, Limits, NoiseLevel
from manipulandum_sim.elbow.perturbation import Perturbation, perturbation as perturbation_of
from manipulandum_sim.elbow.plant import (
    CAUSES,
    SENSORS,
    Drive,
    Motion,
    Progress,
    Sensing,
    find_stops,
    run,
)
from manipulandum_sim.elbow.protocol import Protocol, Test, protocol
from manipulandum_sim.elbow.record import Wiring, record
from manipulandum_sim.elbow.restless import restless_torque
from manipulandum_sim.elbow.subject import (
    OPERATING_ANGLE_RAD,
    ElbowSubject,
    Law,
    find_elbow_subject,
)
from manipulandum_sim.elbow.truth import ElbowTruth

#: Seconds before the record in which the motion settles.
RUN_IN_S: Final = 2.0
#: What each of a trial's random streams is for.
_STREAMS: Final = ("perturbation", "restless", "sensors", "emg", "phase")


@dataclass(frozen=True)
class _Seeds:
    """Random streams that depend on seed, subject and number of the trial alone."""

    seed: int
    subject: str

    def stream(self, trial: int, purpose: str) -> np.random.Generator:
        key = (zlib.crc32(self.subject.encode()), trial, _STREAMS.index(purpose))
        return np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=key))

    def phase(self, trial: int) -> float:
        """The phase of a trial's rhythm, rad."""
        return float(self.stream(trial, "phase").uniform(0, 2 * np.pi))


@dataclass(frozen=True)
class _Clock:
    """Samples of a trial, those before the record included."""

    run_in: int
    samples: int

    @classmethod
    def of(cls, test: Test, duration_s: float) -> _Clock:
        """The clock of a test's trials; an isometric one needs no time to settle."""
        run_in = 0 if test == "calibration" else round(RUN_IN_S * RATE_HZ)
        return cls(run_in, run_in + round(duration_s * RATE_HZ))

    @property
    def time_s(self) -> FloatArray:
        """(S,), 0 at the first sample of the record."""
        return (np.arange(self.samples) - self.run_in) / RATE_HZ

    @property
    def fine_s(self) -> FloatArray:
        """(2 S - 1,), twice as fine."""
        return np.arange(2 * self.samples - 1) / (2 * RATE_HZ) - self.run_in / RATE_HZ


def simulate_elbow(
    test: Test,
    *,
    subject: str | ElbowSubject = "1",
    seed: int = 0,
    repetitions: int = 5,
    duration_s: float = 10.0,
    perturbation: Perturbation = "white",
    noise: NoiseLevel = "nominal",
    torque: TorqueColumn = "interaction",
    depth: float = 0.3,
    frequency_hz: float = 0.7,
    law: Law = "linear",
    activation_delay_s: float = 0.0,
    four_muscles: bool = False,
    hum_V: float | None = None,
    hum_hz: float = 50.0,
    electrode_noise_V: float | None = None,
    crosstalk: float = 0.0,
    velocity_limit: float = Limits.velocity,
    torque_limit: float = Limits.torque,
    device: Exoskeleton = Exoskeleton(),  # noqa: B008 - frozen
    progress: Progress | None = None,
) -> tuple[Recording, ElbowTruth]:
    """One session of a test, and its truth.

    Parameters
    ----------
    test : str
        ``posture``, ``cocontraction`` (levels of both muscles and of each), ``varying`` (K goes up
        and down), ``calibration`` (isometric, the exoskeleton locked), or a rendered load against
        a rhythmic movement: ``spring``, ``damper``, ``inertia`` (10a-c).
    subject : str or ElbowSubject
        "1" to "4".
    seed : int
        A trial's noise depends on seed, subject and the trial's number alone.
    repetitions : int
        How often every condition of the test is repeated.
    duration_s : float
        Length of a trial.
    perturbation : {"white", "prbs"}
        Kind of the random torque in the first three tests; the others have none.
    noise : {"nominal", "sensor", "none"}
        ``sensor`` leaves out voluntary torque and tremor, ``none`` the sensors' noise and steps
        as well; the EMG's carrier stays, it is a noise by nature.
    torque : {"interaction", "commanded"}
        Which one the torque's column holds.
    depth, frequency_hz : float
        Amplitude of the varying stiffness as a share of its middle, and its frequency in Hz.
    law : {"linear", "saturating"}
        How K and B depend on activation.
    activation_delay_s : float
        Time by which K and B follow the EMG.
    four_muscles : bool
        Calibration only: a second flexor and a second extensor.
    hum_V, hum_hz, electrode_noise_V : float
        Hum of the mains (amplitude, frequency) and noise of the electrodes in the EMG; where they
        are absent, `noise` decides.
    crosstalk : float
        Part of every other muscle's EMG in a muscle's channel.
    velocity_limit, torque_limit : float
        rad/s, N m: beyond, a trial ends.
    device : Exoskeleton, optional
    progress : function, optional
        Called with how many steps are done, of how many.

    Returns
    -------
    (Recording, ElbowTruth)
        Kind "joint"; column ``stopped`` of the trial table says which limit ended a trial.

    Raises
    ------
    InputError
        An argument that makes no recording, or a trial that is stopped within its first second.
    """
    own = find_elbow_subject(subject)
    check(repetitions, duration_s, seed, noise, torque, frequency_hz, activation_delay_s)
    check_muscles(test, four_muscles)
    seeds, limits = _Seeds(seed, own.id), limits_of(velocity_limit, torque_limit)
    electrodes = electrodes_of(noise, hum_V, hum_hz, electrode_noise_V, crosstalk)
    plan = protocol(
        test, own, repetitions, seeds.phase, depth=depth, frequency_hz=frequency_hz, law=law
    )
    clock = _Clock.of(test, duration_s)
    forces = _forces(plan, seeds, clock, perturbation, noise)
    motion = _motion(plan, clock, forces, device, limits, progress)
    told, converted = None if plan.unperturbed else perturbation, noise != "none"
    wiring = Wiring(
        electrodes, converted, four_muscles, torque, activation_delay_s, device, perturbation=told
    )
    streams = [seeds.stream(t + 1, "emg") for t in range(plan.n_trials)]
    return record(plan, motion, wiring, clock.run_in, forces.added, forces.restless, streams)


def _motion(
    plan: Protocol,
    clock: _Clock,
    forces: _Forces,
    device: Exoskeleton,
    limits: Limits,
    progress: Progress | None,
) -> Motion:
    """The motion of arm and device, each trial long enough to be recorded."""
    if plan.test == "calibration":
        motion = _isometric(plan, forces, limits)
    else:
        motion = run(_drive(plan, clock, forces), device, forces.sensors, limits, progress)
    _refuse_short(motion, clock)
    return motion


@dataclass(frozen=True)
class _Forces:
    """Random inputs of T trials: perturbation and restless torque (S, T), sensors (4, S, T)."""

    added: FloatArray
    restless: FloatArray
    sensors: FloatArray | None


def _forces(
    plan: Protocol, seeds: _Seeds, clock: _Clock, kind: Perturbation, noise: NoiseLevel
) -> _Forces:
    if kind not in get_args(Perturbation):
        raise InputError(f"no perturbation {kind!r}", expected=" or ".join(get_args(Perturbation)))
    numbers = range(1, plan.n_trials + 1)
    added = np.zeros((clock.samples, plan.n_trials))
    restless = np.zeros_like(added)
    if not plan.unperturbed:
        columns = [
            perturbation_of(kind, seeds.stream(t, "perturbation"), clock.samples) for t in numbers
        ]
        added = np.stack(columns, axis=1)
    if noise == "nominal":
        torques = [restless_torque(seeds.stream(t, "restless"), clock.samples) for t in numbers]
        restless = np.stack(torques, axis=1)
    if noise == "none":
        return _Forces(added, restless, None)
    shape = (clock.samples, len(SENSORS))
    white = np.stack([seeds.stream(t, "sensors").standard_normal(shape).T for t in numbers], -1)
    return _Forces(added, restless, white * np.array([c.noise_sd for c in SENSORS])[:, None, None])


def _drive(plan: Protocol, clock: _Clock, forces: _Forces) -> Drive:
    """Muscles' stiffness, viscosity and free torque on the fine clock."""
    subject, time = plan.subject, clock.fine_s
    activation = plan.activation(time)
    K = subject.muscle_stiffness(activation, plan.law)
    B = subject.muscle_viscosity(activation, plan.law)
    rest, rest_rate, _ = plan.intended(time)
    push = subject.isometric_torque(activation) + K * rest + B * rest_rate
    push[::2] += forces.restless
    push[1::2] += (forces.restless[:-1] + forces.restless[1:]) / 2
    return Drive(
        inertia=subject.inertia,
        gravity=subject.gravity,
        K=K,
        B=B,
        push=push,
        load=plan.load,
        perturbation=forces.added,
        rendered=plan.rendered,
        q0=OPERATING_ANGLE_RAD,
        angle=rest[0],
        rate=rest_rate[0],
    )


def _isometric(plan: Protocol, forces: _Forces, limits: Limits) -> Motion:
    """The device is locked at the operating angle: it bears whatever the limb exerts."""
    shape = forces.restless.shape
    still, angle = np.zeros(shape), np.full(shape, OPERATING_ANGLE_RAD)
    interaction = plan.subject.load_that_balances(plan.targets) - forces.restless
    exact = np.stack([angle, still, interaction, still])
    measured = Sensing(forces.sensors).read_all(exact)
    stop, cause = find_stops(measured, limits)
    return Motion(angle, still, still, interaction, still, measured, stop, cause)


def _refuse_short(motion: Motion, clock: _Clock) -> None:
    lasted = (motion.stop - clock.run_in) / RATE_HZ
    if (lasted < LEAST_S).any():
        row = int(np.argmin(lasted))
        raise InputError(
            f"trial {row + 1} is stopped by the {CAUSES[motion.cause[row]]} limit "
            f"{max(lasted[row], 0.0):.2f} s after its start",
            expected=f"{LEAST_S:g} s or more: a higher limit, or a weaker perturbation",
        )
