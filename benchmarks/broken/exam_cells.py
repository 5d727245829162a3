"""`convert`: Kinarm exams as laboratories have them, written byte by byte by the tests' writers.

The writers and the laboratory (`tests/unit/recordings`) use nothing of the reader.
"""

from __future__ import annotations

import importlib.util
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from broken.cell import Answer, Cell, Made, Rig, said, seeds_of

from armimpedance.show.verbs.results import read

TESTS = Path(__file__).resolve().parents[2] / "tests/unit/recordings"
TRIALS = 16
#: What single precision and links leave of places and forces: m, N.
NEAR = {"trials": 0.4, "place": 2e-5, "force": 2e-3}
NOISE_N = 0.05


@lru_cache(maxsize=1)
def writers() -> tuple[Any, Any]:
    """The tests' writers of exams, and their laboratory."""
    return _module("conftest"), _module("kinarm_bench")


def _module(name: str) -> Any:
    known = f"broken_exam_{name}"
    if known not in sys.modules:
        spec = importlib.util.spec_from_file_location(known, TESTS / f"{name}.py")
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[known] = module
        spec.loader.exec_module(module)
    return sys.modules[known]


@lru_cache(maxsize=4)
def pushes(handle: tuple[float, float]) -> list[Any]:
    """Eight pushes around the clock."""
    bench = writers()[1]
    return [bench.push(2 * np.pi * i / 8, handle=handle) for i in range(8)]


def exams(
    force_by: str = "limb",
    told: str | None = None,
    handle: tuple[float, float] = (0.0, 0.0),
    empty: int = 0,
    unit_n: float = 1.0,
    single: bool = False,
    nan: int = 0,
) -> Callable[[Sequence[int]], list[Made]]:
    """Exams of pushes; `told` is what the user says of the force's sign."""

    def make(indices: Sequence[int]) -> list[Made]:
        files, bench = writers()
        made = []
        for i in indices:
            rng, trials = seeds_of("exam", i), []
            for number in range(1, TRIALS + 1):
                one = pushes(handle)[(number - 1) % 8]
                noise = NOISE_N * rng.standard_normal(one.force.shape)
                trials.append(
                    bench.trial_of(
                        files, number, one, force_by=force_by, noise=noise, unit_n=unit_n
                    )
                )
            first, force = trials[0], trials[0].forces * unit_n
            sign = 1.0 if force_by == "limb" else -1.0
            lost = rng.choice(np.arange(1, TRIALS), empty + nan, replace=False)
            for k in lost[:empty]:
                none = np.zeros((0, 2))
                trials[k] = replace(
                    trials[k], samples=0, links=none, forces=none, motors=none, events=()
                )
            for k in lost[empty:]:
                broken = np.array(trials[k].forces)
                broken[50:80] = np.nan
                trials[k] = replace(trials[k], forces=broken)
            robot = bench.robot_of(files, handle)
            content = files.exam_files(trials, robot)
            if single:
                content = {first.name: content[first.name]}
            hand = bench.places(first.links, handle)
            peak = int(np.abs(force[:, 0]).argmax())
            truth = {
                "trials": float(TRIALS - empty - nan),
                "place": float(hand[peak, 0]),
                "force": float(sign * force[peak, 0]),
            }
            made.append(Made(content, truth, {"told": told, "peak": peak, "single": single}))
        return made

    return make


def ask(made: Made) -> Answer:
    """How many trials are read; place and force at the peak of the first."""
    with tempfile.TemporaryDirectory() as folder:
        path = writers()[0].write_exam(Path(folder) / "exam", made.record)
        if made.beside["single"]:
            path = next(path.glob("*.c3d"))
        recording = read(path, force_by=made.beside["told"])
    checks = getattr(recording, "findings", ())
    if not hasattr(recording, "force"):
        return Answer({"trials": (0.0, 0.0, 0.0)}, **said(checks))
    peak = made.beside["peak"]
    values = {
        "trials": float(recording.n_trials),
        "place": float(recording.position[peak, 0]),
        "force": float(recording.force[peak, 0]),
    }
    numbers = {k: (v, v - NEAR[k], v + NEAR[k]) for k, v in values.items()}
    return Answer(numbers, **said(checks))


EXAM = Rig("convert", "Kinarm exam", exams(told="limb"), ask)


def cells() -> list[Cell]:
    """All of this command's."""
    sign, unit = ("force sign",), ("force scale", "units")
    shapes: list[tuple[str, str, tuple[str, ...], Any]] = [
        ("trials without a frame", "3 of 16", ("empty trials",), exams(told="limb", empty=3)),
        ("trials without a frame", "8 of 16", ("empty trials",), exams(told="limb", empty=8)),
        ("trials with holes", "2 of 16", ("broken trials",), exams(told="limb", nan=2)),
        ("whose force is not told", "sensor holds the limb's", sign, exams()),
        ("whose force is not told", "sensor holds the device's", sign, exams("device")),
        ("whose force is told wrong", "device for limb", sign, exams(told="device")),
        ("handle is off its link", ".5 mm across", ("handle", "links"),
         exams(told="limb", handle=(0.0, -0.0005))),
        ("force in kgf in the file", "/ 9.81", unit, exams(told="limb", unit_n=9.81)),
        ("one trial's file alone", "", ("trials",), exams(told="limb", single=True)),
    ]  # fmt: skip
    return [Cell(EXAM, *shape) for shape in shapes]


CLEAN = (EXAM,)
