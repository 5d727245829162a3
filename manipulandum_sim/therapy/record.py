"""Trials of people in the therapy robot through the plant, to recordings and truths."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import FloatArray, IntArray
from armimpedance.core.records import Recording
from manipulandum_sim.therapy.calibration import Seeds, therapy_recording
from manipulandum_sim.therapy.control import TherapyController
from manipulandum_sim.therapy.device import RATE_HZ, TherapyDevice
from manipulandum_sim.therapy.people import (
    PassiveLimbs,
    effort_of,
    payload_of,
    reference_of,
    samples_of,
)
from manipulandum_sim.therapy.plan import TherapyOptions, TherapyTrial
from manipulandum_sim.therapy.plant import Motion, Progress, run
from manipulandum_sim.therapy.reference import REST_S
from manipulandum_sim.therapy.truth import TherapyMotion, TherapyTruth, true_contribution

#: Seconds before the record in which everything settles.
RUN_IN_S: Final = 1.0
#: A person who moves freely moves while faster than this share of the own peak speed.
SPEED_SHARE: Final = 0.05
#: What is true of each trial; see `TherapyTruth`.
_MEASURES: Final = ("contribution", "contribution_elastic", "projection", "cancellation")


@dataclass(frozen=True)
class TherapyRun:
    """Trials that went through the plant together, and what came of them.

    Attributes
    ----------
    trials : list of T TherapyTrial
    motion : Motion
    reference : (S, T, 5)
        rad.
    onset_s, end_s : (T,)
    lengths : (T,)
        Samples that are kept.
    """

    trials: list[TherapyTrial]
    options: TherapyOptions
    device: TherapyDevice
    limbs: PassiveLimbs
    motion: Motion
    reference: FloatArray
    onset_s: FloatArray
    end_s: FloatArray
    lengths: IntArray

    @classmethod
    def of(
        cls,
        trials: list[TherapyTrial],
        options: TherapyOptions,
        device: TherapyDevice,
        model: TherapyDevice,
        progress: Progress | None,
    ) -> TherapyRun:
        asked, limbs = reference_of(trials, options.speed_deg_s), PassiveLimbs.of(trials)
        needed, run_in = samples_of(trials, asked), round(RUN_IN_S * RATE_HZ)
        samples = int(needed.max())
        effort = effort_of(trials, asked, device, run_in + samples, options)
        payload = payload_of(trials, device)
        modes = np.array([trial.mode for trial in trials])

        def user(time_s: float, q: FloatArray, qd: FloatArray) -> FloatArray:
            return effort.torque(round(time_s * RATE_HZ) + run_in, time_s, q, qd)

        motion = run(
            device,
            payload,
            asked.start,
            TherapyController.of(
                model, payload.upper_arm_m, asked, modes, options.inertia_compensation
            ),
            samples,
            user=user,
            passive=limbs,
            run_in=run_in,
            measured=options.noisy,
            progress=progress,
        )
        told = np.stack([asked.at(k / RATE_HZ)[0] for k in range(samples)])
        leads = np.array([trial.leads for trial in trials])
        first, last = _moving(motion.qd, asked.axis, needed)
        onset = np.where(leads, first / RATE_HZ, asked.begin_s)
        end = np.where(leads, last / RATE_HZ, asked.end_s)
        rest = round(REST_S * RATE_HZ)
        lengths = np.minimum(np.round(end * RATE_HZ).astype(np.int64) + rest + 1, needed)
        return cls(trials, options, device, limbs, motion, told, onset, end, lengths)

    def of_person(self, rows: slice, seed: int, exact: bool) -> tuple[Recording, TherapyTruth]:
        """Recording and truth of one person's trials (rows from, to)."""
        trials, lengths = self.trials[rows], self.lengths[rows]
        subject = trials[0].subject
        motion = _columns(self.motion, rows)
        said = (
            f"Simulated: subject {subject.id} in the therapy robot {self.device.name}, "
            f"seed {seed}, noise {self.options.noise}."
        )
        recording = therapy_recording(
            self.device,
            motion,
            self.reference[:, rows],
            self._table(rows),
            lengths,
            Seeds(seed, f"therapy {subject.id}"),
            self.options.noise,
            subject.record,
            said,
        )
        truth = TherapyTruth.of(
            "therapy",
            subject.id,
            self.device.adjusted_to(trials[0].arm.upper_arm_m),
            recording.offsets,
            TherapyMotion.of(motion, lengths) if exact else None,
            **self._contributions(rows),
            stiffness=self.limbs.k[rows],
            rest_rad=self.limbs.rest_rad[rows],
            damping=self.limbs.damping[rows],
            tone_Nm=self.limbs.tone_Nm[rows],
        )
        return recording, truth

    def _table(self, rows: slice) -> pd.DataFrame:
        trials = self.trials[rows]
        return pd.DataFrame(
            {
                "trial": np.arange(len(trials)) + 1,
                "condition": [trial.condition for trial in trials],
                "movement": [trial.movement.name for trial in trials],
                "axis": [trial.movement.axis + 1 for trial in trials],
                "onset_s": np.round(self.onset_s[rows], 6),
                "end_s": np.round(self.end_s[rows], 6),
                "repetition": [trial.repetition for trial in trials],
            }
        )

    def _contributions(self, rows: slice) -> dict[str, FloatArray]:
        """Per trial, of the moving axis from onset to end, percent; cancellation a fraction."""
        found: dict[str, list[float]] = {name: [] for name in _MEASURES}
        for t in range(rows.start, rows.stop):
            first, last = (round(s[t] * RATE_HZ) for s in (self.onset_s, self.end_s))
            part = (slice(first, last + 1), t, self.trials[t].movement.axis)
            user, need = self.motion.user[part], (self.motion.arm + self.motion.passive)[part]
            beside = self.limbs.beside(self.motion.qd[part[0]])[:, t, part[2]]
            true = true_contribution(user, need)
            found["contribution"].append(true.ratio)
            found["contribution_elastic"].append(
                true_contribution(user - beside, need - beside).ratio
            )
            found["projection"].append(true.projection)
            found["cancellation"].append(true.cancellation)
        return {name: np.array(values) for name, values in found.items()}


def _columns(motion: Motion, rows: slice) -> Motion:
    return Motion(**{f.name: getattr(motion, f.name)[:, rows] for f in fields(Motion)})


def _moving(qd: FloatArray, axis: Any, needed: Any) -> tuple[IntArray, IntArray]:
    """First and last sample (T,) about the peak at which an axis is faster than a share of it."""
    samples, trials = qd.shape[:2]
    speed = np.abs(qd[:, np.arange(trials), axis])
    speed[np.arange(samples)[:, None] >= needed] = 0.0
    peak = speed.argmax(axis=0)
    slow = speed < SPEED_SHARE * speed.max(axis=0)
    index = np.arange(samples)[:, None]
    first = np.where(slow & (index < peak), index, -1).max(axis=0) + 1
    last = np.where(slow & (index > peak), index, samples).min(axis=0) - 1
    return first, last
