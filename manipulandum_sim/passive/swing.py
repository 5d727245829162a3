"""The two tests of a relaxed arm under motion capture (see `passive_drive`).

The source prints condition numbers of 2.2 to 3.1 without saying of what. Its standard deviations
tell: ``sd_f / sd_h`` is the rms of qd, and with a correlation r of qd and sign(qd) ``sd_f / sd_k =
rms(q - q_r) / sqrt(1 - r^2)``. Read as those of the columns scaled to unit length, the printed
numbers mean r = .66 to .81, as pushed and dying swings have it; read as raw ones, the second test
would need r = .52 and .56, where the swings here have .72. The two tests here reach 2.3 to 2.6,
scaled.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import pandas as pd

from armimpedance.core.arrays import BoolArray, FloatArray
from armimpedance.core.errors import InputError
from armimpedance.core.motion import MarkerRecording, MotionRecording
from manipulandum_sim.passive.chain import Chain
from manipulandum_sim.passive.drive import Drive, Push, Test, held, shaken
from manipulandum_sim.passive.friction import JointLaw, PassivePlant
from manipulandum_sim.passive.plan import Plan, plan_of
from manipulandum_sim.passive.subject import PassiveSubject, hinge_values
from manipulandum_sim.passive.truth import PassiveTruth
from manipulandum_sim.studio import Studio, film
from manipulandum_sim.studio_emg import Burst, relaxed_emg

Progress = Callable[[int, int], None]

#: Step of the integration, at most (s): the motion is then 1e-7 rad from that of an eighth of the
#: step, and 1e-4 rad where joints with dry friction stop and go.
STEP_S: Final = 2e-3
#: The arm follows the trunk for so long before the first frame of ``p5``.
RUN_IN_S: Final = 2.0
#: How far the forearm is lifted, rad.
LIFT_RAD: Final = (0.5, 0.8)
#: Steps from one word about progress to the next.
_STEPS_TOLD: Final = 500
#: Chains times instants whose base is worked out at once.
BLOCK: Final = 20_000


@dataclass(frozen=True)
class Swing:
    """Free motion of T trials at F frames: q, qd, qdd, torque, held, each (F, T, K)."""

    q: FloatArray
    qd: FloatArray
    qdd: FloatArray
    torque: FloatArray
    held: BoolArray


def simulate_passive(
    test: Test,
    *,
    subject: str | PassiveSubject = "1",
    seed: int = 0,
    trials: int | None = None,
    duration_s: float | None = None,
    rate_hz: float = 30.0,
    marker_noise_m: float = 0.5e-3,
    soft_tissue_m: float = 0.0,
    dropout: float = 0.0,
    emg_percent: float = 2.0,
    emg_bursts: Sequence[Burst] = (),
    push: Push | None = None,
    progress: Progress | None = None,
) -> tuple[MarkerRecording, PassiveTruth]:
    """One recording of a test, and its truth.

    Parameters
    ----------
    test, subject
        As for `simulate_passive_many`.
    seed : int
    trials, duration_s, rate_hz
        As for `simulate_passive_many`.
    marker_noise_m, soft_tissue_m, dropout : float
        As for `Studio`.
    emg_percent, emg_bursts, push, progress
        As for `simulate_passive_many`.

    Returns
    -------
    (MarkerRecording, PassiveTruth)
    """
    return simulate_passive_many(
        test,
        [seed],
        subject=subject,
        trials=trials,
        duration_s=duration_s,
        rate_hz=rate_hz,
        studio=Studio(marker_noise_m, soft_tissue_m, dropout),
        emg_percent=emg_percent,
        emg_bursts=emg_bursts,
        push=push,
        progress=progress,
    )[0]


def simulate_passive_many(
    test: Test,
    seeds: Sequence[int],
    *,
    subject: str | PassiveSubject = "1",
    trials: int | None = None,
    duration_s: float | None = None,
    rate_hz: float = 30.0,
    studio: Studio | None = None,
    emg_percent: float = 2.0,
    emg_bursts: Sequence[Burst] = (),
    push: Push | None = None,
    progress: Progress | None = None,
) -> list[tuple[MarkerRecording, PassiveTruth]]:
    """A recording and its truth for every seed, all of them integrated side by side.

    A recording depends on its own seed alone, up to the last bits of the batch's arithmetic.

    Parameters
    ----------
    test : {"p5", "release"}
    seeds : sequence of int
    subject : str or PassiveSubject
    trials, duration_s : optional
        Trials of a recording and length of each; as the source's if absent: 700 frames in one
        trial (``p5``), 1100 in four (``release``).
    rate_hz : float
        Frames of the cameras per second.
    studio : Studio, optional
    emg_percent : float
        Level of biceps and triceps, % of the maximum.
    emg_bursts : sequence of Burst
        Times at which one of them is not relaxed (see `studio_emg.relaxed_emg`); the motion
        ignores it.
    push : Push, optional
        How the examiner pushes in ``p5``.
    progress : function, optional
        Called with how many steps are done, of how many.

    Returns
    -------
    list of (MarkerRecording, PassiveTruth)

    Raises
    ------
    InputError
        Unknown test or subject, or a number that makes no recording.
    """
    plan = plan_of(test, subject, trials, duration_s, rate_hz)
    if len(seeds) == 0 or min(seeds) < 0:
        raise InputError(f"seeds {list(seeds)}", expected="one or more, none negative")
    keys = [
        np.random.SeedSequence(int(seed), spawn_key=(trial,))
        for seed in seeds
        for trial in range(1, plan.trials + 1)
    ]
    drive, start_s, first = _begin(plan, keys, push or Push())
    swing = _integrate(plan, drive, first, start_s, progress)
    coordinates = [_all_coordinates(plan, drive, swing, part) for part in range(3)]
    made = []
    for i, seed in enumerate(seeds):
        rows = slice(i * plan.trials, (i + 1) * plan.trials)
        motion, truth = _exact(plan, swing, coordinates, rows, int(seed))
        emg = relaxed_emg(motion, percent=emg_percent, bursts=emg_bursts, seed=int(seed))
        made.append((film(motion, studio, seed=int(seed), emg=emg), truth))
    return made


def _begin(
    plan: Plan, keys: list[np.random.SeedSequence], push: Push
) -> tuple[Drive, float, FloatArray]:
    """The prescribed motion, when it starts (s before the first frame), and the free angles."""
    skeleton, height = plan.subject.skeleton, plan.subject.height_m
    end = plan.frames / plan.rate_hz
    if plan.test == "p5":
        start = -round(RUN_IN_S * plan.rate_hz) / plan.rate_hz
        drive = shaken(skeleton, height, keys, (start, end), push)
        rest = plan.subject.joints
        free = [h.name for s in skeleton.segments[1:] for h in s.hinges]
        hang = [0.5 * rest[h].q_r for h in free]
        return drive, start, np.tile(hang, (len(keys), 1))
    # the cameras do not know when the forearm is let go: half a frame before the first
    start = -0.5 / plan.rate_hz
    drive = held(skeleton, height, len(keys), (start, end))
    lifted = np.array([np.random.default_rng(key).uniform(*LIFT_RAD) for key in keys])
    free = [h.name for s in skeleton.segments[2:] for h in s.hinges]
    angles = np.tile([plan.subject.joints[h].q_r for h in free], (len(keys), 1))
    angles[:, 0] = np.pi / 2 + lifted
    return drive, start, angles


def _plant(subject: PassiveSubject, drive: Drive) -> tuple[PassivePlant, tuple[str, ...]]:
    """The free part of the arm, and its hinges' names."""
    segments = subject.skeleton.segments[subject.skeleton.index(drive.base) + 1 :]
    hinges = tuple(h.name for s in segments for h in s.hinges)
    k, h, f, q_r, K = (hinge_values(subject, hinges, n) for n in ("k", "h", "f", "q_r", "K"))
    return PassivePlant(Chain(segments), JointLaw(k, h, f, q_r, K)), hinges


def _integrate(
    plan: Plan, drive: Drive, angles: FloatArray, start_s: float, progress: Progress | None
) -> Swing:
    """Integrate from rest at `start_s` over all frames."""
    plant, _ = _plant(plan.subject, drive)
    # an even number of steps per frame, so that half a frame is a whole number of them
    per_frame = 2 * int(np.ceil(0.5 / (plan.rate_hz * STEP_S)))
    dt = 1 / (plan.rate_hz * per_frame)
    before = round(-start_s / dt)
    last = before + (plan.frames - 1) * per_frame
    block = max(1, BLOCK // (2 * len(angles)))
    state, kept = None, []
    for begin in range(0, last + 1, block):
        steps = min(block, last + 1 - begin)
        halves = np.arange(2 * begin, 2 * (begin + steps) + 1, dtype=np.float64)
        bases = drive.base_motion(start_s + dt / 2 * halves)
        if state is None:
            state = plant.start(angles, bases[0])
        for n in range(steps):
            now = begin + n - before
            if progress is not None and now % _STEPS_TOLD == 0:
                progress(begin + n, last)
            if now >= 0 and now % per_frame == 0:
                state = plant.release(state, bases[2 * n])
                kept.append((state, *plant.joint_torque(state, bases[2 * n])))
            state = plant.step(state, bases[2 * n : 2 * n + 3], dt)
    states, qdd, torque = zip(*kept, strict=True)
    q, qd, *_ = (np.stack(part) for part in zip(*states, strict=True))
    at_rest = (qd == 0) & (plant.law.f != 0)
    return Swing(q, qd, np.stack(qdd), np.stack(torque), at_rest)


def _all_coordinates(plan: Plan, drive: Drive, swing: Swing, part: int) -> FloatArray:
    """Prescribed and free coordinates, or a derivative of theirs, (F, T, n)."""
    times = np.arange(plan.frames) / plan.rate_hz
    free = (swing.q, swing.qd, swing.qdd)[part]
    return np.concatenate([drive.at(times)[part], free], axis=2)


def _exact(
    plan: Plan, swing: Swing, coordinates: list[FloatArray], rows: slice, seed: int
) -> tuple[MotionRecording, PassiveTruth]:
    """One recording's motion out of the batch; samples of its trials one after another."""

    def lined_up(values: np.ndarray) -> np.ndarray:
        return np.concatenate(list(values[:, rows].transpose(1, 0, 2)))

    subject, skeleton = plan.subject, plan.subject.skeleton
    q, qd, qdd = (lined_up(part) for part in coordinates)
    free = skeleton.coordinates[-swing.q.shape[2] :]
    numbers = {n: hinge_values(subject, free, n) for n in ("k", "h", "f", "q_r", "K")}
    truth = PassiveTruth(
        test=plan.test,
        subject=subject.name,
        joints=free,
        **numbers,
        coordinates=skeleton.coordinates,
        q=q,
        qd=qd,
        qdd=qdd,
        torque=lined_up(swing.torque),
        held=lined_up(swing.held),
    )
    trials = range(1, plan.trials + 1)
    motion = MotionRecording(
        sample_rate_hz=plan.rate_hz,
        trials=pd.DataFrame({"trial": list(trials), "condition": plan.test}),
        offsets=plan.frames * np.arange(plan.trials + 1),
        time_s=np.tile(np.arange(plan.frames) / plan.rate_hz, plan.trials),
        coordinates=q,
        skeleton=skeleton,
        subject=subject.record,
        provenance=(f"simulated test {plan.test} of passive subject {subject.name}, seed {seed}",),
    )
    return motion, truth
