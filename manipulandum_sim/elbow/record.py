"""The recording, its trial table, EMG and truth from the motion of arm and exoskeleton."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray
from armimpedance.core.conventions import perturbation_columns
from armimpedance.core.records import Recording
from manipulandum_sim.elbow.device import RATE_HZ, Exoskeleton
from manipulandum_sim.elbow.emg import Electrodes, raw_emg
from manipulandum_sim.elbow.plant import ANGLE, CAUSES, CURRENT, GAUGE, GYRO, Motion
from manipulandum_sim.elbow.protocol import Protocol
from manipulandum_sim.elbow.subject import OPERATING_ANGLE_RAD, ElbowSubject
from manipulandum_sim.elbow.truth import ElbowMotion, ElbowTruth

MUSCLES: Final = ("biceps", "triceps")
FOUR_MUSCLES: Final = ("biceps", "triceps_long", "brachioradialis", "triceps_lateral")
#: Flexor (0) or extensor (1), its share in that side's torque, mean rectified EMG over the first
#: muscle's of the side in the maximum contraction.
_HEADS: Final = ((0, 0.6, 1.0), (1, 0.45, 1.0), (0, 0.4, 0.7), (1, 0.55, 1.1))
#: How far the heads of a side depart from common activation, by the posture of hand and shoulder
#: that a condition has: without it nobody could tell the two apart.
_TILTS: Final = (0.3, -0.3)


@dataclass(frozen=True)
class Wiring:
    """Settings of a session's recording; see `simulate_elbow`."""

    electrodes: Electrodes
    converted: bool
    four_muscles: bool
    torque: Literal["interaction", "commanded"]
    delay_s: float
    device: Exoskeleton
    perturbation: str | None

    @property
    def muscles(self) -> tuple[str, ...]:
        """Names of the EMG's channels."""
        return FOUR_MUSCLES if self.four_muscles else MUSCLES


def record(
    plan: Protocol,
    motion: Motion,
    wiring: Wiring,
    run_in: int,
    added: FloatArray,
    restless: FloatArray,
    streams: list[np.random.Generator],
) -> tuple[Recording, ElbowTruth]:
    """Cut the run-in and what follows a stop, add EMG and table.

    Parameters
    ----------
    added, restless : (S, T)
        Perturbation and torque of the subject's own, N m.
    streams : list of T generators
        For the EMG.
    """
    cut = _Cut(run_in, np.minimum(motion.stop + 1, len(motion.angle)))
    offsets = np.concatenate([[0], np.cumsum(cut.ends - run_in)])
    time = (np.arange(len(motion.angle)) - run_in) / RATE_HZ
    whole = _shares(plan, wiring.four_muscles, plan.activation(time + wiring.delay_s))
    emg = _emg(plan, motion, wiring, cut, whole, streams)
    measured = [cut.rows(part) for part in motion.measured]
    torque = measured[CURRENT if wiring.torque == "commanded" else GAUGE]
    extra = {"motor1_Nm": measured[CURRENT], "gyro1_rad_s": measured[GYRO]}
    if wiring.perturbation is not None:
        extra[perturbation_columns(1)[0]] = cut.rows(added)
    recording = Recording(
        kind="joint",
        sample_rate_hz=RATE_HZ,
        trials=_table(plan, motion, wiring),
        offsets=offsets,
        time_s=cut.rows(np.broadcast_to(time[:, None], added.shape)),
        position=measured[ANGLE][:, None],
        force=-torque[:, None],
        emg=emg,
        muscles=wiring.muscles,
        perturbation="stochastic",
        torque=wiring.torque,
        subject=plan.subject.record,
        extra=extra,
        provenance=_provenance(plan, motion, wiring),
    )
    exact = _exact(motion, cut, restless)
    return recording, _truth(plan, wiring, offsets, cut, time, cut.rows(whole), exact)


@dataclass(frozen=True)
class _Cut:
    """Which samples of each trial are kept: from the run-in's end to `ends` (T,)."""

    first: int
    ends: Any

    def rows(self, values: FloatArray) -> FloatArray:
        """One trial after another, (N, ...) of (S, T, ...)."""
        return np.concatenate([values[self.first : end, t] for t, end in enumerate(self.ends)])


def _exact(motion: Motion, cut: _Cut, restless: FloatArray) -> ElbowMotion:
    """The motion without the sensors' errors, one trial after another."""
    return ElbowMotion(
        angle=cut.rows(motion.angle),
        rate=cut.rows(motion.rate),
        acceleration=cut.rows(motion.acceleration),
        torque=cut.rows(motion.interaction),
        motor=cut.rows(motion.motor),
        restless=cut.rows(restless),
    )


def _shares(plan: Protocol, four: bool, activation: FloatArray) -> FloatArray:
    """Activation (S, T, m) of the muscles that are recorded from flexor's and extensor's."""
    if not four:
        return activation
    count = len(set(plan.conditions))
    place = np.arange(plan.n_trials) % count
    tilt = np.stack([np.take(_TILTS, place % 2), np.take(_TILTS, place // 2 % 2)], axis=-1)
    parts, seen = [], [0, 0]
    for side, share, _ in _HEADS:
        # the tilts of a side cancel in its torque: share_1 d_1 + share_2 d_2 = 0
        sign = (1.0, -1.0)[seen[side]]
        lean = sign * tilt[:, side] * min(h[1] for h in _HEADS if h[0] == side) / share
        parts.append(activation[..., side] * (1 + lean))
        seen[side] += 1
    return np.stack(parts, axis=-1)


def _emg(
    plan: Protocol,
    motion: Motion,
    wiring: Wiring,
    cut: _Cut,
    activation: FloatArray,
    streams: list[np.random.Generator],
) -> FloatArray:
    mvc = _mvc(plan.subject, wiring.four_muscles)
    parts = [
        raw_emg(
            stream, activation[cut.first :, t], mvc, motion.rate[cut.first :, t],
            wiring.electrodes, wiring.converted,
        )[: cut.ends[t] - cut.first]
        for t, stream in enumerate(streams)
    ]  # fmt: skip
    return np.concatenate(parts)


def _mvc(subject: ElbowSubject, four: bool) -> FloatArray:
    sides = np.array([subject.mvc_F_V, subject.mvc_E_V])
    return np.array([sides[side] * size for side, _, size in _HEADS]) if four else sides


def _table(plan: Protocol, motion: Motion, wiring: Wiring) -> pd.DataFrame:
    """The trial table; a limit that is met in the last sample ends nothing but is told."""
    own, asked, count = plan.subject, plan.rendered, plan.n_trials
    table: dict[str, Any] = {
        "trial": range(1, count + 1),
        "condition": plan.conditions,
        "experiment": plan.test,
        "stopped": [CAUSES[c] for c in motion.cause],
        "q_elbow_rad": OPERATING_ANGLE_RAD,
        "load_Nm": plan.load,
    }
    if not plan.rhythm_rad:
        table |= {"target_flexor": plan.targets[:, 0], "target_extensor": plan.targets[:, 1]}
    if plan.test == "calibration":
        table["target_torque_Nm"] = own.isometric_torque(plan.targets)
    else:
        table |= {
            "rendered_I_kgm2": asked.inertia,
            "rendered_B_Nms_rad": asked.viscosity,
            "rendered_K_Nm_rad": asked.stiffness,
        }
    for name, level in zip(wiring.muscles, _mvc(own, wiring.four_muscles), strict=True):
        table |= {f"mvc_{name}_V": level, f"rest_{name}_V": wiring.electrodes.rest_V}
    return pd.DataFrame(table)


def _provenance(plan: Protocol, motion: Motion, wiring: Wiring) -> tuple[str, ...]:
    said = [f"simulated elbow exoskeleton, test {plan.test}, subject {plan.subject.id}"]
    if wiring.perturbation is not None:
        said.append(f"perturbed by {wiring.perturbation} torque")
    said += [
        f"trial {t + 1} stopped by the {CAUSES[cause]} limit"
        for t, cause in enumerate(motion.cause)
        if cause
    ]
    return tuple(said)


def _truth(
    plan: Protocol,
    wiring: Wiring,
    offsets: Any,
    cut: _Cut,
    time: FloatArray,
    activation: FloatArray,
    motion: ElbowMotion,
) -> ElbowTruth:
    own, device, asked = plan.subject, wiring.device, plan.rendered
    mechanical, rest = plan.activation(time), plan.intended(time)[0]
    K, B = own.impedance(mechanical, rest, plan.law)
    sides = np.array([own.torque_F, -own.torque_E])
    heads = [sides[side] * share for side, share, _ in _HEADS]
    return ElbowTruth(
        test=plan.test,
        subject=own.id,
        law=plan.law,
        muscles=wiring.muscles,
        offsets=offsets,
        I=own.inertia,
        K=cut.rows(K),
        B=cut.rows(B),
        K_muscle=cut.rows(own.muscle_stiffness(mechanical, plan.law)),
        activation=activation,
        activation_delay_s=wiring.delay_s,
        stiffness_law=np.array([own.k0, own.kF, own.kE]),
        viscosity_law=np.array([own.b0, own.bF, own.bE]),
        torque_per_activation=np.array(heads) if wiring.four_muscles else sides,
        gravity=own.gravity,
        operating_angle=OPERATING_ANGLE_RAD,
        device_inertia=device.inertia,
        device_viscosity=device.viscosity,
        device_friction=device.friction,
        rendered=np.array([asked.inertia, asked.viscosity, asked.stiffness]),
        motion=motion,
    )
