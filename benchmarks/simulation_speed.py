"""Speed of the simulated manipulandum against scipy's odeint on the same machine, per trial.

Both integrate arm, cast, handle, robot and servo of 1 s trials. odeint gets the loosest tolerance
that still reaches the simulator's own state error, and stops at the disturbance's kinks; the
errors are against the simulator at a tenth of its step. Only ratios are judged.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import odeint

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "oracles"))

from joint_space_plant import JointSpacePlant

from manipulandum_sim.hand import (
    RATE_HZ,
    SUBJECTS,
    Arm,
    Batch,
    Condition,
    CoupledPlant,
    Course,
    Rig,
    Run,
    Track,
    find_truth,
    integrate,
    make_course,
    make_schedule,
    muscle_command,
    nominal_hand,
    servo_gains,
)

TRIALS = 1000
ODEINT_TRIALS = 8
ASKED = 10.0
TOLERANCES = tuple(1e-8 / 2**k for k in range(16))
RIG = Rig(noise="none", emg=False)


def make_batch(trials: int, rig: Rig) -> tuple[CoupledPlant, Course]:
    """Trials of a relaxed arm in the nominal posture, directions and onsets at random."""
    subject = SUBJECTS["A"]
    arm, handle = Arm.of(subject), rig.handle_mass_kg
    truth = find_truth(arm, [Condition("c", nominal_hand(subject))], handle_mass_kg=handle)
    schedule = make_schedule(0, [Run(0, "c", (1, 0))], -(-trials // 8))
    rows = np.arange(trials)
    batch = Batch(arm, rig, truth, schedule, rows)
    here = np.zeros(trials, dtype=int)
    gains = servo_gains(rig.robot, rig.servo, truth.hand[here], truth.force[here], handle)
    muscles = muscle_command(arm, truth.posture[here], truth.activation[here])
    return CoupledPlant(arm, rig.robot, muscles, gains, handle), make_course(batch)


def simulate_batch(trials: int, rig: Rig) -> Track:
    """What is timed: everything from plant to samples."""
    plant, course = make_batch(trials, rig)
    return integrate(plant, course, rig.samples, rig.steps_per_sample)


def bump(at: float) -> tuple[float, float, float]:
    """The disturbance as floats."""
    s = at / RIG.duration_s
    if not 0 < s < 1:
        return 0.0, 0.0, 0.0
    w, size = s * (1 - s), RIG.amplitude_m
    velocity = size * 192 * w * w * (1 - 2 * s) / RIG.duration_s
    return size * 64 * w**3, velocity, size * 384 * w * ((1 - 2 * s) ** 2 - w) / RIG.duration_s**2


def odeint_trials(tolerance: float) -> np.ndarray:
    """Hand positions (S, 2, T) of the first trials by odeint."""
    plant, course = make_batch(ODEINT_TRIALS, RIG)
    times = np.arange(RIG.samples) / RATE_HZ
    hands = []
    for trial in range(ODEINT_TRIALS):
        onset = float(course.onset[trial] * course.step_s)
        machine = JointSpacePlant(
            plant, trial, onset, course.place[:, trial], course.direction[:, trial], bump
        )
        kinks = [onset, onset + RIG.duration_s]
        states = odeint(
            machine.rate,
            machine.start(),
            times,
            rtol=tolerance,
            atol=tolerance * 1e-1,
            tcrit=kinks,
            mxstep=10_000,
        )
        hands.append([machine.arm.position(*state[:2]) for state in states])
    return np.array(hands).transpose(1, 2, 0)


def timed(task, *arguments: object) -> tuple[object, float]:  # type: ignore[no-untyped-def]
    """What a task returns, and the best of three times."""
    best, result = np.inf, None
    for _ in range(3):
        start = time.perf_counter()
        result = task(*arguments)
        best = min(best, time.perf_counter() - start)
    return result, best


def main() -> int:
    """Print measured and asked; 1 if the ratio is missed."""
    track, ours = timed(simulate_batch, TRIALS, RIG)
    fine = simulate_batch(ODEINT_TRIALS, replace(RIG, substeps=10 * RIG.steps_per_sample)).position
    error = np.abs(track.position[..., :ODEINT_TRIALS] - fine).max()
    for tolerance in TOLERANCES:
        theirs_error = np.abs(odeint_trials(tolerance) - fine).max()
        if theirs_error <= error:
            break
    _, theirs = timed(odeint_trials, tolerance)
    ratio = (theirs / ODEINT_TRIALS) / (ours / TRIALS)
    print(f"state error at the hand: ours {error:.1e} m, odeint {theirs_error:.1e} m", end="")
    print(f" (tolerance {tolerance:g})")
    verdict = "met" if ratio >= ASKED else "MISSED"
    print(f"{'name':70s} measured    asked")
    print(f"{'one simulated trial: odeint / ours':70s} {ratio:8.1f} >= {ASKED:5.1f}  {verdict}")
    return int(ratio < ASKED)


if __name__ == "__main__":
    sys.exit(main())
