"""Speed of the simulated manipulandum against scipy's odeint on the same machine, per trial.

Both integrate arm, cast, handle, robot and servo of 1 s trials. odeint gets the loosest tolerance
that still reaches the simulator's own state error, and stops at the disturbance's kinks; the
errors are against the simulator at a tenth of its step. Only ratios are judged.

The compiled integration (extra `fast`) is judged against NumPy's, both as the simulator runs them:
processor time for one trial, for an experiment of 224, for the block of 1,024 of a simulated study,
at errors against the same fine course that differ by rounding; and whole sessions, where random
numbers and the sensors take their time whoever integrates.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import sys

# numba looks for the package coverage and would find the benchmark of that name beside this file
sys.path.pop(0)

import time
from collections.abc import Callable
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
    integrate_compiled,
    make_course,
    make_schedule,
    muscle_command,
    nominal_hand,
    servo_gains,
    simulate_condition,
)

TRIALS = 1000
ODEINT_TRIALS = 8
ASKED = 10.0
BATCHES = (1, 224, 1024)
COMPILED_ASKED = 3.0
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


def processor_time(task: Callable[[], object]) -> float:
    """Seconds of processor time, the best of five."""
    times = []
    for _ in range(5):
        start = time.process_time()
        task()
        times.append(time.process_time() - start)
    return min(times)


def said(name: str, ratio: float, asked: float) -> bool:
    """Print a ratio beside what is asked of it; whether it is missed."""
    verdict = "met" if ratio >= asked else "MISSED"
    print(f"{name:70s} {ratio:8.1f} >= {asked:5.1f}  {verdict}")
    return ratio < asked


def compiled_misses() -> int:
    """Ratios of NumPy's to the compiled integration: how many are missed."""
    start = time.process_time()
    integrate_compiled(*make_batch(1, RIG), RIG.samples, RIG.steps_per_sample)
    print(f"compiled: ready after {time.process_time() - start:.1f} s of processor time")
    missed = 0
    for trials in BATCHES:
        asked = (*make_batch(trials, RIG), RIG.samples, RIG.steps_per_sample)
        plain, compiled = (
            processor_time(lambda run=run, asked=asked: run(*asked))
            for run in (integrate, integrate_compiled)
        )
        print(f"{1e3 * plain / trials:.3f} and {1e3 * compiled / trials:.3f} ms a trial", end="; ")
        print(f"errors {errors_of(trials)} m")
        name = f"{trials} trials integrated: NumPy / compiled"
        missed += said(name, plain / compiled, COMPILED_ASKED)
    return missed


def errors_of(trials: int) -> str:
    """Largest state errors of NumPy and compiled against a tenth of the step, the first trials'."""
    few = min(trials, ODEINT_TRIALS)
    plant, course = make_batch(few, RIG)
    substeps = RIG.steps_per_sample
    fine = simulate_batch(few, replace(RIG, substeps=10 * substeps)).position
    both = (run(plant, course, RIG.samples, substeps) for run in (integrate, integrate_compiled))
    return " and ".join(f"{np.abs(track.position - fine).max():.6e}" for track in both)


def whole_sessions() -> None:
    """Say what whole simulated sessions gain; nothing is asked of these."""
    for noise, emg in (("none", False), ("nominal", False), ("nominal", True)):
        plain, compiled = (
            processor_time(
                lambda c=c, noise=noise, emg=emg: simulate_condition(
                    seed=1, repeats=7, sets=4, noise=noise, emg=emg, compiled=c
                )
            )
            for c in (False, True)
        )
        name = f"whole session of 224 trials, noise {noise}{', EMG' if emg else ''}"
        print(f"{name:70s} {plain / compiled:8.1f}")


def main() -> int:
    """Print measured and asked; 1 if a ratio is missed."""
    if "--compiled" in sys.argv[1:]:
        missed = compiled_misses()
        whole_sessions()
        return int(missed > 0)
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
    print(f"{'name':70s} measured    asked")
    return int(said("one simulated trial: odeint / ours", ratio, ASKED))


if __name__ == "__main__":
    sys.exit(main())
