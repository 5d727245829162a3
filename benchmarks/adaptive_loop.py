"""Does `next` keep up with a robot whose loop runs at 1 kHz, with 500 trials behind it?

    python benchmarks/adaptive_loop.py --behind 500 --pushes 24

Three processes, as in a laboratory: the loop computes the hand's motion and force every
millisecond; beside it a link turns each push into a line and waits for the answer; and
``armimpedance next RECORDING --lines`` answers. Printed: how late the loop's steps were, with the
answers and without any (what the machine itself costs); how long the answer to a trial took; how
often a push was not there when its pause was over; and how long one decision takes.
"""

from __future__ import annotations

import os

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import argparse
import json
import multiprocessing
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Final

import numpy as np
from adaptive_trials import AMPLITUDE_M, DURATION_S, RATE_HZ, REST_S, Person, pushed

from armimpedance.core.arrays import FloatArray
from armimpedance.core.records import Recording
from armimpedance.hand.adaptive import Setup, recording_of
from armimpedance.hand.adaptive.show import next_trials
from armimpedance.hand.planning import SHAPES, Profile
from armimpedance.recordings import write_recording

SHAPE: Final = "designed"
#: A wish that 500 pushes do not fulfil.
K_PERCENT: Final = 0.5
STEP_S: Final = 1 / RATE_HZ


def behind(number: int) -> Recording:
    """So many pushes along eight directions in turn."""
    angle = np.arange(number) * np.pi / 4
    units = np.column_stack([np.cos(angle), np.sin(angle)])
    profile = Profile(SHAPES.named(SHAPE), AMPLITUDE_M, DURATION_S)
    return recording_of(pushed(Person.of(0), profile, units, np.random.default_rng(0)), Setup())


def link(robot: Connection, recording: str) -> None:
    """Lines to `next` and back: a push for each trial, and how long its answer took."""
    command = [sys.executable, "-m", "armimpedance", "next", recording, "--lines"]
    command += ["--k-percent", str(K_PERCENT), "--shapes", SHAPE, "--max-trials", "100000"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        line: dict[str, Any] = {"ready": True}
        while True:
            text, start = json.dumps(line) + "\n", time.perf_counter()
            child.stdin.write(text)
            child.stdin.flush()
            answer = json.loads(child.stdout.readline())
            robot.send((answer["push"], time.perf_counter() - start))
            trial = robot.recv()
            if trial is None:
                child.stdin.close()
                return
            line = {"trial": trial}


@dataclass
class Loop:
    """A loop of 1 kHz: `late_s` of each step, since its own time."""

    late_s: list[float] = field(default_factory=list)

    def steps(self, number: int) -> Any:
        """Each step at its time; a step that is late does not move the later ones."""
        start = time.perf_counter()
        for step in range(number):
            due = start + step * STEP_S
            while (left := due - time.perf_counter()) > 0:
                time.sleep(left)
            self.late_s.append(time.perf_counter() - due)
            yield step


def push_of(answer: dict[str, Any], person: Person, loop: Loop, rng: np.random.Generator) -> Any:
    """Run one push, step by step: what the robot recorded."""
    profile = Profile(SHAPES.named(answer["shape"]), answer["amplitude_m"], answer["duration_s"])
    t = np.arange(round((2 * REST_S + profile.duration_s) * RATE_HZ) + 1) / RATE_HZ - REST_S
    x, v, a = profile.at(t)
    u, noise = np.array(answer["direction"]), rng.normal(0, 0.3, (len(t), 2))
    M, B, K = (matrix @ u for matrix in person.limb)
    position, force = np.zeros((len(t), 2)), np.zeros((len(t), 2))
    for n in loop.steps(len(t)):
        position[n] = x[n] * u
        force[n] = noise[n] - (a[n] * M + v[n] * B + x[n] * K)
    return {
        "onset_s": REST_S,
        "end_s": REST_S + profile.duration_s,
        "position_m": position.tolist(),
        "force_N": force.tolist(),
    }


def session(recording: str, pushes: int) -> tuple[Loop, FloatArray, int]:
    """Loop, times of the answers (s), and pushes that were not there when their pause was over."""
    own, other = multiprocessing.Pipe()
    beside = multiprocessing.get_context("spawn").Process(target=link, args=(other, recording))
    beside.start()
    loop, answers, missing = Loop(), [], 0
    person, rng = Person.of(0), np.random.default_rng(1)
    push, _ = own.recv()
    for number in range(pushes):
        trial = push_of(push, person, loop, rng)
        own.send(trial)
        for _ in loop.steps(round(push["pause_s"] * RATE_HZ)):
            pass
        missing += not own.poll()
        push, taken = own.recv()
        answers.append(taken)
        print(f"push {number + 1} of {pushes}: answer {1e3 * taken:.1f} ms", flush=True)
    own.send(None)
    beside.join()
    return loop, np.array(answers), missing


def alone(pushes: int) -> Loop:
    """The same loop with nobody to answer."""
    loop = Loop()
    for _ in loop.steps(round(pushes * 2.1 * RATE_HZ)):
        pass
    return loop


def told(loop: Loop) -> str:
    """How late its steps were."""
    late = 1e3 * np.array(loop.late_s)
    return (
        f"{len(late):,} steps; late by more than a step {(late > 1).sum()}, "
        f"99.9 % within {np.quantile(late, 0.999):.2f} ms, worst {late.max():.2f} ms"
    )


def main() -> None:
    """Print what was late."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--behind", type=int, default=500, help="trials that were done before")
    parser.add_argument("--pushes", type=int, default=24)
    asked = parser.parse_args()
    recording = behind(asked.behind)
    start = time.perf_counter()
    made = next_trials(recording, k_percent=K_PERCENT, checks=False, max_trials=100_000)
    print(f"one decision, any course: {time.perf_counter() - start:.2f} s; {made}")
    recording, start = behind(asked.behind), time.perf_counter()
    course = made.pushes[0].profile
    next_trials(recording, k_percent=K_PERCENT, checks=False, course=course, max_trials=100_000)
    print(f"one decision, the course that was chosen: {time.perf_counter() - start:.2f} s")
    with tempfile.TemporaryDirectory() as folder:
        written = str(Path(folder) / "session")
        write_recording(recording, written)
        loop, answers, missing = session(written, asked.pushes)
    print(f"loop with answers: {told(loop)}")
    print(f"loop without:      {told(alone(asked.pushes))}")
    print(
        f"answers: median {1e3 * np.median(answers):.1f} ms, worst {1e3 * answers.max():.1f} ms; "
        f"pushes that were not there in time: {missing}"
    )


if __name__ == "__main__":
    main()
