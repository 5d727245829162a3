"""Mutation score: how many small faults, put into the rooms of the estimators, do the tests notice?

A mutant is one small change of the product code: a sign, an operator, a limit, a constant, a
transpose, a keyword left out (`mutation/mutants.py`). The sample is fixed: every place has a rank,
which is a hash of the seed, the room, the function and the text of its line, and the first
`--sample` ranks are taken. The same mutants are thus drawn again after other code has been edited,
or moved within its room.

The tests run once under coverage to learn which tests reach which line; what a shared fixture
reaches counts for every test that uses it. A mutant is then put into a copy of the tree, and the
tests that reach its line run, those of its own room first, until one fails. Only as many of them
run (the cheapest) as usually take `--budget` seconds; five times the usual time counts as failed.
A process that has the heavy packages in memory is forked for every mutant. This is why it is a
script of its own: cosmic-ray and mutmut start a fresh interpreter for every mutant (seconds each)
and do not choose tests by line and price.

`mutation/equivalents.json` lists mutants of the sample that provably change no result, each with
its reason; they are left out of the score. Exit status 0 if at least 85 % are killed, else 1.

    python benchmarks/mutation_score.py --out score.json
"""

# The number of threads must be set before numpy is imported.
# ruff: noqa: E402

from __future__ import annotations

import os
import sys
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_threads] = "1"

HERE = Path(__file__).resolve().parent
sys.path.append(sys.path.pop(0))  # The package `coverage` comes before the script of that name.

import argparse
import contextlib
import importlib
import json
import multiprocessing
import shutil
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from typing import Any

import pytest
from mutation.mutants import ROOMS, Mutant, mutants_of, room_of
from mutation.reached import QUIET, Tests, measure

PARTS = ("armimpedance", "manipulandum_sim", "figures", "tests", "pyproject.toml")
# Tests that are slow and look at other rooms; without them the score can only be lower.
LEFT_OUT = (
    *("browser/", "office/", "figures/", "manipulandum_sim/"),
    *("therapy", "contribution", "demo", "body", "mocap/"),
)
ASKED, SEED, SAMPLE, BUDGET = 0.85, 20261122, 300, 20.0
HEAVY = (
    "hypothesis scipy.signal scipy.stats scipy.optimize scipy.interpolate pandas pyarrow.parquet"
)


class Chosen:
    """A pytest plugin that keeps the given tests, in the given order, of the given tree."""

    def __init__(self, tests: list[str], root: Path) -> None:
        self.order, self.root = {test: k for k, test in enumerate(tests)}, root

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Keep and sort, and see that the copy is what the tests import."""
        imported = Path(sys.modules["armimpedance"].__file__ or "")
        assert imported.is_relative_to(self.root), f"{imported} is not of the copy {self.root}"
        kept = [i for i in items if i.nodeid in self.order]
        items[:] = sorted(kept, key=lambda i: self.order[i.nodeid])


def copied(root: Path, folder: Path) -> Path:
    """A copy of the tree, in which the figures also have the name that they are installed under."""
    folder.mkdir()
    for part in (root / p for p in PARTS):
        if part.is_dir():
            shutil.copytree(part, folder / part.name)
        else:
            shutil.copy2(part, folder / part.name)
    (folder / "armimpedance_figures").symlink_to("figures")
    return folder.resolve()


def in_child(root: Path, work: Callable[[], int], limit: float = float("inf")) -> int | None:
    """Exit status of work done by a fork of this process in a tree; None where time ran out."""
    child = os.fork()
    if child == 0:
        status = 70
        try:
            os.setsid()
            with open(os.devnull, "r+b") as null:
                for stream in (0, 1, 2):
                    os.dup2(null.fileno(), stream)
            os.chdir(root)
            sys.path.insert(0, str(root))
            os.environ["PYTHONPATH"] = str(root)
            status = work()
        finally:
            os._exit(status)
    end = time.monotonic() + limit
    while time.monotonic() < end:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.01)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return None


def run_tests(root: Path, tests: list[str]) -> int:
    """Exit status of pytest on these tests."""
    sys.dont_write_bytecode = True
    os.environ["PYTHONDONTWRITEBYTECODE"] = "1"
    files = dict.fromkeys(t.split("::")[0] for t in tests)
    return int(pytest.main([*QUIET, "-x", *files], plugins=[Chosen(tests, root)]))


_OWN: dict[str, Path] = {}


def own_copy(root: Path) -> None:
    """Give a worker process a copy of its own of the tree."""
    _OWN["root"] = copied(root, root.parent / f"worker{os.getpid()}")


def judge(mutant: Mutant, tests: list[str], usual: float) -> Mutant:
    """Put a mutant into this worker's copy, run the tests that reach it and tell the outcome."""
    if not tests:
        mutant.outcome = "not covered"
        return mutant
    root, start = _OWN["root"], time.monotonic()
    file = root / mutant.file
    kept = file.with_suffix(".kept")
    shutil.copy2(file, kept)
    try:
        file.write_text(mutant.mutated(file.read_text(encoding="utf-8")), encoding="utf-8")
        status = in_child(root, partial(run_tests, root, tests), 5 * usual + 20)
    finally:
        os.replace(kept, file)
    mutant.seconds = round(time.monotonic() - start, 2)
    # 2 and 4 say that the mutant cannot be imported; a negative status that it died of a signal.
    if status is None:
        mutant.outcome = "killed by time"
    elif status < 0 or status in (1, 2, 4):
        mutant.outcome = "killed"
    else:
        mutant.outcome = "survived" if status == 0 else f"error {status}"
    return mutant


def all_tests(root: Path, workers: int, kept: Path | None) -> Tests:
    """Which test reaches which line, measured or read from where it was kept."""
    if kept and kept.exists():
        return Tests(json.loads(kept.read_text()))
    files = sorted(str(f.relative_to(root)) for f in root.glob("tests/**/test_*.py"))
    files = [f for f in files if not any(part in f for part in LEFT_OUT)]
    outs = [root.parent / f"map{k}.json" for k in range(workers)]
    works = [
        (root, partial(measure, root, outs[k], files[k::workers], tuple(ROOMS.values())))
        for k in range(workers)
    ]
    with ProcessPoolExecutor(workers, multiprocessing.get_context("fork")) as pool:
        list(pool.map(in_child, *zip(*works, strict=True)))
    parts = [json.loads(out.read_text()) for out in outs]
    for part in parts:
        for test in part["failed"]:
            print(f"not used, it fails without any mutant: {test}", flush=True)
    if kept:
        kept.write_text(json.dumps(parts))
    return Tests(parts)


def sample_of(root: Path, number: int, seed: int, only: str | None) -> list[Mutant]:
    """The mutants of the lowest ranks, without those that are listed as equivalent."""
    inside = (f for room in ROOMS.values() for f in (root / "armimpedance" / room).rglob("*.py"))
    files = sorted(f for f in inside if "show" not in f.parts)  # forms are not estimators
    drawn = sorted((m for f in files for m in mutants_of(root, f, seed)), key=lambda m: m.rank)
    listed = json.loads((HERE / "mutation" / "equivalents.json").read_text())
    equivalent = {tuple(e[k] for k in ("function", "text", "before", "after")) for e in listed}
    sample = drawn[:number]
    kept = [m for m in sample if (m.function, m.text, m.before, m.after) not in equivalent]
    print(
        f"{len(drawn)} places, {len(sample)} drawn, {len(sample) - len(kept)} equivalent",
        flush=True,
    )
    return [m for m in kept if only in (None, room_of(m.file))]


def report(mutants: list[Mutant]) -> float:
    """Print the counts and the survivors; returns the share that is killed."""
    counts = Counter(m.outcome for m in mutants)
    for m in sorted(mutants, key=lambda m: (m.file, m.line)):
        if not m.outcome.startswith("killed"):
            print(f"{m.outcome}  {m.file}:{m.line} {m.function}\n    {m.text}")
            print(f"    {m.before}  ->  {m.after}")
    score = (counts["killed"] + counts["killed by time"]) / max(len(mutants), 1)
    told = ", ".join(f"{number} {outcome}" for outcome, number in sorted(counts.items()))
    print(f"{len(mutants)} mutants: {told}; {score:.1%} killed (asked: {ASKED:.0%})")
    return score


def main() -> int:
    parser = argparse.ArgumentParser(description="How many small faults do the tests notice?")
    parser.add_argument("--root", type=Path, default=HERE.parent, help="the checkout")
    parser.add_argument("--sample", type=int, default=SAMPLE, help="number of mutants")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument(
        "--only", choices=tuple(ROOMS), help="only those mutants that lie in this room"
    )
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--budget", type=float, default=BUDGET, help="seconds of tests per mutant")
    parser.add_argument("--map", type=Path, help="JSON that keeps which test reaches which line")
    parser.add_argument("--out", type=Path, help="JSON of all mutants and their outcomes")
    args = parser.parse_args()
    for name in HEAVY.split():
        importlib.import_module(name)
    with tempfile.TemporaryDirectory() as folder:
        root = copied(args.root.resolve(), Path(folder).resolve() / "tree")
        sample = sample_of(root, args.sample, args.seed, args.only)
        tests = all_tests(root, args.workers, args.map)
        chosen = [tests.chosen(m, args.budget) for m in sample]
        context, judged = multiprocessing.get_context("fork"), []
        with ProcessPoolExecutor(args.workers, context, own_copy, (root,)) as pool:
            for mutant in pool.map(judge, sample, *zip(*chosen, strict=True)):
                judged.append(mutant)
                told = f"{mutant.outcome:9} {mutant.seconds:6.1f} s  {mutant.file}:{mutant.line}"
                print(f"{len(judged):4}/{len(sample)} {told}", flush=True)
    score = report(judged)
    if args.out:
        leave = ("change", "lines", "rank")
        rows = [{k: v for k, v in asdict(m).items() if k not in leave} for m in judged]
        args.out.write_text(json.dumps({"killed": score, "mutants": rows}, indent=1) + "\n")
    return 0 if score >= ASKED else 1


if __name__ == "__main__":
    sys.exit(main())
